//! States and actions in words.

use crate::mdp::{Env, Field, FieldKind, MAX_FIELDS, Schema};

/// What states and actions of an environment are called.
#[derive(Debug, Clone, PartialEq)]
pub struct Naming {
    /// The names of fields and actions.
    pub schema: Schema,
    /// The fields of every state by its index; empty where states have none.
    states: Vec<Vec<f64>>,
}

impl Naming {
    pub(super) fn new<E: Env>(env: &E) -> Self {
        let schema = env.schema();
        let n_fields = schema.fields.len();
        let fields = |index: usize| {
            let mut fields = [0.0; MAX_FIELDS];
            if let Some(obs) = env.state(index) {
                env.fields(&obs, &mut fields);
            }
            fields[..n_fields].to_vec()
        };
        let states = (0..env.n_states().unwrap_or(0)).map(fields).collect();
        Self { schema, states }
    }

    /// The state with this index: `row 2, col 3`. An index that other fields make up is left out.
    pub fn state(&self, index: usize) -> String {
        self.states.get(index).map_or_else(|| index.to_string(), |fields| self.fields(fields))
    }

    /// A state with these fields.
    pub fn fields(&self, fields: &[f64]) -> String {
        let named = self.schema.fields.iter().zip(fields);
        let shown = named.filter(|(f, _)| f.name != "index" || fields.len() == 1);
        let text = shown.map(|(f, &x)| format!("{} {}", f.name, number(f, x)));
        text.collect::<Vec<_>>().join(", ")
    }

    /// An action: its name, or its number.
    pub fn action(&self, action: usize) -> String {
        self.schema.actions.get(action).cloned().unwrap_or_else(|| action.to_string())
    }
}

fn number(field: &Field, x: f64) -> String {
    match field.kind {
        FieldKind::Float => format!("{x:.4}"),
        FieldKind::Int => format!("{x:.0}"),
        FieldKind::Letter => char::from_u32(x as u32).unwrap_or('?').to_string(),
    }
}
