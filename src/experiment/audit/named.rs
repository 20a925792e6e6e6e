//! States and actions in words.

use std::collections::BTreeSet;

use crate::mdp::{Env, Field, FieldKind, MAX_FIELDS, Schema};

/// What states and actions of an environment are called.
#[derive(Debug, Clone, PartialEq)]
pub struct Naming {
    /// The names of fields and actions.
    pub schema: Schema,
    /// The fields of every state by its index; empty where states have none.
    states: Vec<Vec<f64>>,
    /// How many fields, from the first on, tell all states apart.
    telling: usize,
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
        let states: Vec<_> = (0..env.n_states().unwrap_or(0)).map(fields).collect();
        let telling = telling(&states, n_fields);
        Self { schema, states, telling }
    }

    /// The state with this index: `row 2, col 3`. Fields that follow from those before them are left
    /// out.
    pub fn state(&self, index: usize) -> String {
        self.states.get(index).map_or_else(|| index.to_string(), |fields| self.fields(fields))
    }

    /// A state with these fields.
    pub fn fields(&self, fields: &[f64]) -> String {
        self.where_they(fields, |_, _| true)
    }

    /// In what the state `to` differs from the state `from`; `stays` if in nothing.
    pub fn change(&self, from: usize, to: usize) -> String {
        let (Some(before), Some(after)) = (self.states.get(from), self.states.get(to)) else {
            return to.to_string();
        };
        let text = self.where_they(after, |i, x| before[i].to_bits() != x.to_bits());
        if text.is_empty() { "stays".into() } else { text }
    }

    fn where_they(&self, fields: &[f64], shown: impl Fn(usize, f64) -> bool) -> String {
        let named = self.schema.fields.iter().zip(fields).take(self.telling).enumerate();
        let shown = named.filter(|(i, (_, x))| shown(*i, **x));
        let text = shown.map(|(_, (f, &x))| format!("{} {}", f.name, number(f, x)));
        text.collect::<Vec<_>>().join(", ")
    }

    /// An action: its name, or its number.
    pub fn action(&self, action: usize) -> String {
        self.schema.actions.get(action).cloned().unwrap_or_else(|| action.to_string())
    }
}

/// How many of the `n_fields` fields are enough, all if they never are.
fn telling(states: &[Vec<f64>], n_fields: usize) -> usize {
    let distinct = |n: usize| {
        let bits = |fields: &Vec<f64>| fields[..n].iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        states.iter().map(bits).collect::<BTreeSet<_>>().len() == states.len()
    };
    if states.is_empty() {
        n_fields
    } else {
        (1..n_fields).find(|&n| distinct(n)).unwrap_or(n_fields)
    }
}

fn number(field: &Field, x: f64) -> String {
    match field.kind {
        FieldKind::Float => format!("{x:.4}"),
        FieldKind::Int => format!("{x:.0}"),
        FieldKind::Letter => char::from_u32(x as u32).unwrap_or('?').to_string(),
    }
}
