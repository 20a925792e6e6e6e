//! What a variant's table says of a state: from the numbers that scripts see to the cell they lie
//! in, and to Φ there. Serves pictures and play, which are outside of training.

use super::assemble::{diagnostic_of, middle};
use super::shaped;
use crate::env::{EnvVisitor, Session};
use crate::learn::{LinearQ, QTable};
use crate::mdp::{Env, MAX_FIELDS, Schema};
use crate::nn::{Activations, Kernels, Mlp};
use crate::script::{Diagnostic, DiscretiserSpec, Host, PhiOn, Variant};
use crate::shaping::{
    ActionSet, Active, Bins, CellFn, Fault, Features, Fields, Inputs, PhiFn, ShieldFn,
};

/// From a state to the row of the table that stands for it.
pub(super) enum Locate {
    /// The environment's own state index.
    Index,
    /// Uniform bins.
    Bins(Bins),
    /// Scripted cells.
    Cells(CellFn),
}

impl Locate {
    /// `None` where values are linear in features: there is no table.
    fn new(host: &Host, variant: &Variant, schema: &Schema) -> Option<Self> {
        Some(match &variant.discretiser {
            DiscretiserSpec::StateIndex => Self::Index,
            DiscretiserSpec::Bins(dims) => {
                Self::Bins(Bins::new(dims).expect("checked when the plan was resolved"))
            }
            DiscretiserSpec::Features(_) | DiscretiserSpec::Raw => return None,
            DiscretiserSpec::Cells { shape, cell } => {
                Self::Cells(host.callbacks().cells(cell, shape, &variant.normalise, schema))
            }
        })
    }

    /// The row of the session's present state.
    fn present(&mut self, session: &Session) -> Result<usize, Fault> {
        match self {
            Self::Index => Ok(session.state_index().expect("only for finite environments")),
            Self::Bins(bins) => Ok(bins.index(session.fields())),
            Self::Cells(cell) => cell.at(session.fields()),
        }
    }
}

/// Action values as they were learned, to be asked of a session's present state.
pub(super) enum Lookup {
    /// A table.
    Table(Locate, QTable),
    /// Features and weights.
    Linear {
        /// Both of them.
        q: LinearQ,
        /// The present state's features.
        active: Active,
        /// Its values.
        row: Vec<f64>,
    },
    /// A network.
    Network(Box<Network>),
}

/// A network, with room for one state.
pub(super) struct Network {
    net: Mlp<f32>,
    inputs: Inputs,
    kernels: Kernels,
    /// What is kept of the state, and the inputs that are made of it.
    kept: Vec<f32>,
    x: Vec<f32>,
    activations: Activations<f32>,
    /// Its values.
    row: Vec<f64>,
}

impl Network {
    fn present(&mut self, session: &Session) -> &[f64] {
        let mut state = Fields {
            values: [0.0; MAX_FIELDS],
            index: session.state_index().unwrap_or(0),
            allowed: ActionSet::ALL,
        };
        state.values[..session.fields().len()].copy_from_slice(session.fields());
        self.inputs.keep(&state, &mut self.kept);
        self.inputs.expand(&self.kept, &mut self.x);
        self.net.forward(self.kernels, &self.x, self.x.len(), &mut self.activations);
        for (value, q) in self.row.iter_mut().zip(self.activations.q(0)) {
            *value = f64::from(*q);
        }
        &self.row
    }
}

impl Lookup {
    /// Those of `variant`, whose table or weights `q` holds.
    pub(super) fn new(host: &Host, variant: &Variant, schema: &Schema, q: QTable) -> Self {
        match Locate::new(host, variant, schema) {
            Some(locate) => Self::Table(locate, q),
            None => Self::linear(LinearQ::from_weights(
                features(variant).expect("without a table there are features"),
                q,
            )),
        }
    }

    /// Linear ones.
    pub(super) fn linear(q: LinearQ) -> Self {
        let (active, row) = (q.features().active(), vec![0.0; q.weights().n_actions()]);
        Self::Linear { q, active, row }
    }

    /// Those of a network that sees `inputs`.
    pub(super) fn network(net: Mlp<f32>, inputs: Inputs) -> Self {
        Self::Network(Box::new(Network {
            kernels: Kernels::detect(),
            kept: vec![0.0; inputs.n_kept()],
            x: vec![0.0; inputs.n_inputs()],
            activations: Activations::new(&net, 1),
            row: vec![0.0; net.shape().n_actions],
            net,
            inputs,
        }))
    }

    /// One value per action.
    pub(super) fn present(&mut self, session: &Session) -> Result<&[f64], Fault> {
        match self {
            Self::Table(locate, q) => Ok(q.row(locate.present(session)?)),
            Self::Linear { q, active, row } => {
                q.features().see(session.fields(), active);
                q.values(active, row);
                Ok(row)
            }
            Self::Network(network) => Ok(network.present(session)),
        }
    }
}

/// The features that a variant's values are linear in.
pub(super) fn features(variant: &Variant) -> Option<Features> {
    match &variant.discretiser {
        DiscretiserSpec::Features(spec) => {
            Some(Features::new(spec).expect("checked when the plan was resolved"))
        }
        _ => None,
    }
}

/// A state of a finite environment.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedState {
    /// Its fields.
    pub fields: Vec<f64>,
    /// Whether an episode can be in it and act.
    pub acts: bool,
}

/// The states that a variant's table speaks of.
pub struct Landscape {
    /// What their numbers are called.
    pub schema: Schema,
    /// Every state by its index, on environments whose table goes by it.
    pub states: Option<Vec<ListedState>>,
    /// The features, where there is no table.
    pub features: Option<Features>,
    shield: Option<ShieldFn>,
    locate: Option<Locate>,
    phi: Option<PhiFn>,
    /// Whether Φ is taken at the cell's representative, as in training.
    on_cell: bool,
}

impl Landscape {
    /// The landscape of `variant`.
    ///
    /// # Errors
    /// If the environment cannot be made.
    pub fn new(host: &Host, variant: &Variant) -> Result<Self, Diagnostic> {
        let env =
            variant.environment().map_err(|e| Diagnostic::error(e.message).maybe_hint(e.hint))?;
        let schema = env.schema();
        let n_actions = env.n_actions();
        let by_index = matches!(variant.discretiser, DiscretiserSpec::StateIndex);
        let locate = Locate::new(host, variant, &schema);
        let phi = shaped::phi(host, variant, &schema);
        Ok(Self {
            states: by_index.then(|| env.visit(ListStates)),
            on_cell: matches!(locate, Some(Locate::Bins(_))) && variant.potential_on == PhiOn::Cell,
            features: features(variant),
            shield: variant
                .allowed
                .as_ref()
                .map(|allowed| host.callbacks().shield(allowed, n_actions, &schema)),
            schema,
            locate,
            phi,
        })
    }

    /// What the shield allows in each state, on environments whose table goes by it; `None` without
    /// a shield. Everything where it fails, as it may in states that it keeps an episode from.
    pub fn allowed(&mut self) -> Option<Vec<ActionSet>> {
        let (shield, states) = (self.shield.as_mut()?, self.states.as_ref()?);
        let mut allowed = |s: &ListedState| {
            if s.acts { shield.at(&s.fields).unwrap_or(ActionSet::ALL) } else { ActionSet::ALL }
        };
        Some(states.iter().map(&mut allowed).collect())
    }

    /// A state with every field in the middle of its range, 0 where that is unbounded.
    pub fn middle(&self) -> Vec<f64> {
        middle(&self.schema)[..self.schema.fields.len()].to_vec()
    }

    /// The row of the table for a state with these fields; `None` where states have indices of
    /// their own (see [`Self::states`]), and where there is no table.
    ///
    /// # Errors
    /// If a scripted discretiser fails.
    pub fn cell(&mut self, fields: &[f64]) -> Result<Option<usize>, Diagnostic> {
        match &mut self.locate {
            None | Some(Locate::Index) => Ok(None),
            Some(Locate::Bins(bins)) => Ok(Some(bins.index(fields))),
            Some(Locate::Cells(cell)) => cell.at(fields).map(Some).map_err(diagnostic_of),
        }
    }

    /// Φ as the learner meets it in an episode (from 1), in a state of `cell` with these fields;
    /// `None` without one. What the learner's own values add to it is not in it.
    ///
    /// # Errors
    /// If the callback fails.
    pub fn phi(
        &mut self,
        cell: usize,
        fields: &[f64],
        episode: u32,
    ) -> Result<Option<f64>, Diagnostic> {
        let Some(phi) = &mut self.phi else { return Ok(None) };
        let mut state = [0.0; MAX_FIELDS];
        let n_fields = self.schema.fields.len();
        match &self.locate {
            Some(Locate::Bins(bins)) if self.on_cell => {
                state = middle(&self.schema);
                bins.centre(cell, &mut state);
            }
            _ => state[..n_fields].copy_from_slice(fields),
        }
        phi.at(&state[..n_fields], episode).map(Some).map_err(diagnostic_of)
    }
}

struct ListStates;

impl EnvVisitor for ListStates {
    type Out = Vec<ListedState>;

    fn visit<E: Env + Clone + 'static>(self, env: E) -> Self::Out {
        let n_fields = env.schema().fields.len();
        // Without a model nobody knows which states are reached.
        let reachable = env.finite().map(|mdp| mdp.reachable());
        let state = |index: usize| {
            let mut fields = vec![0.0; n_fields];
            let obs = env.state(index).expect("finite states have an index");
            env.fields(&obs, &mut fields);
            ListedState { fields, acts: reachable.as_ref().is_none_or(|r| r[index]) }
        };
        (0..env.n_states().unwrap_or(0)).map(state).collect()
    }
}
