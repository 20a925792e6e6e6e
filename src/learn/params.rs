//! The parameters of agents: what they admit, their values, and an agent's configuration.

use std::collections::BTreeMap;

use serde::Serialize;

use super::registry::{AgentSpec, Build};
use super::{AlphaSource, Exploration, Schedule, Unit};

/// The value of an agent's parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParamValue {
    /// A whole number.
    Int(u64),
    /// A real number.
    Float(f64),
    /// A schedule.
    Schedule(Schedule),
    /// True or false.
    Bool(bool),
    /// A step size by the number of visits.
    VisitCount {
        /// `N^−omega`.
        omega: f64,
    },
    /// A behaviour policy.
    Exploration(Exploration),
    /// One of several words.
    Word(&'static str),
    /// Widths of layers.
    Widths(Widths),
    /// A script's function, which the script host keeps.
    Function,
}

impl std::fmt::Display for ParamValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Int(n) => write!(f, "{n}"),
            Self::Float(x) => write!(f, "{x:?}"),
            Self::Bool(yes) => write!(f, "{yes}"),
            Self::Word(word) => write!(f, "{word:?}"),
            Self::Widths(widths) => write!(f, "{:?}", widths.as_slice()),
            Self::Function => write!(f, "a function"),
            Self::VisitCount { omega: 1.0 } => write!(f, "visit_count()"),
            Self::VisitCount { omega } => write!(f, "visit_count({omega:?})"),
            Self::Exploration(exploration) => write!(f, "{exploration}"),
            Self::Schedule(Schedule::Constant { value }) => write!(f, "{value:?}"),
            Self::Schedule(Schedule::Linear { start, end, over, unit }) => {
                write!(f, "linear({start:?}, {end:?}, {over}{})", steps(*unit))
            }
            Self::Schedule(Schedule::Exponential { start, factor, min, unit }) => {
                write!(f, "exponential({start:?}, {factor:?}, {min:?}{})", steps(*unit))
            }
        }
    }
}

/// The option of a schedule that goes by steps.
fn steps(unit: Unit) -> &'static str {
    match unit {
        Unit::Episode => "",
        Unit::Step => ", #{ steps: true }",
    }
}

/// The widths of a network's hidden layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Widths {
    n: usize,
    values: [u32; Self::MAX_LAYERS],
}

impl Widths {
    /// The largest number of hidden layers.
    pub const MAX_LAYERS: usize = 6;

    /// The largest number of units in a layer.
    pub const MAX_UNITS: u64 = 4096;

    /// These; `None` if there are none or too many of them, or one is 0 or too wide.
    pub const fn new(widths: &[u64]) -> Option<Self> {
        if widths.is_empty() || widths.len() > Self::MAX_LAYERS {
            return None;
        }
        let mut values = [0; Self::MAX_LAYERS];
        let mut i = 0;
        while i < widths.len() {
            if widths[i] == 0 || widths[i] > Self::MAX_UNITS {
                return None;
            }
            values[i] = widths[i] as u32;
            i += 1;
        }
        Some(Self { n: widths.len(), values })
    }

    /// One for each layer.
    pub fn as_slice(&self) -> &[u32] {
        &self.values[..self.n]
    }
}

impl Serialize for Widths {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.as_slice().serialize(serializer)
    }
}

/// What a parameter admits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParamKind {
    /// A finite real number in `min..=max`; `min` itself excluded if `open`.
    Float {
        /// Lower limit.
        min: f64,
        /// Upper limit.
        max: f64,
        /// Whether the lower limit is excluded.
        open: bool,
    },
    /// A whole number of at least `min`.
    Int {
        /// Lower limit.
        min: u64,
    },
    /// A number or a schedule whose values stay in `0..=1`; 0 excluded if `open`.
    Rate {
        /// Whether 0 is excluded.
        open: bool,
    },
    /// True or false.
    Bool,
    /// A step size: a rate above 0, or one that goes by visits.
    StepSize,
    /// A behaviour policy.
    Exploration,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A finite number from 0 to `max`, or [`Self::NONE`].
    Maybe {
        /// Upper limit.
        max: f64,
        /// Whether 0 is excluded.
        open: bool,
    },
    /// The widths of hidden layers.
    Widths,
}

impl ParamKind {
    /// What a parameter is that may be left out and was.
    pub const NONE: &'static str = "none";

    /// What is allowed, in words.
    pub fn allowed(&self) -> String {
        match *self {
            Self::Bool => "true or false".into(),
            Self::Word(words) => {
                let quoted: Vec<String> = words.iter().map(|w| format!("{w:?}")).collect();
                quoted.join(" or ")
            }
            Self::Float { min, max, open } => match (min.is_finite(), max.is_finite()) {
                (true, true) if open => format!("a number above {min} and at most {max}"),
                (true, true) => format!("a number from {min} to {max}"),
                (true, false) if open => format!("a number above {min}"),
                (true, false) => format!("a number of at least {min}"),
                _ => "a finite number".into(),
            },
            Self::Maybe { max, open } => {
                let number = Self::Float { min: 0.0, max, open }.allowed();
                format!("{number}, or {:?}", Self::NONE)
            }
            Self::Widths => format!(
                "a list of 1 to {} whole numbers from 1 to {}",
                Widths::MAX_LAYERS,
                Widths::MAX_UNITS
            ),
            Self::Int { min } => format!("a whole number of at least {min}"),
            Self::Rate { open: false } => "a number from 0 to 1, or a schedule of such".into(),
            Self::Rate { open: true } => {
                "a number above 0 and at most 1, or a schedule of such".into()
            }
            Self::StepSize => {
                "a number above 0 and at most 1, a schedule of such, or visit_count()".into()
            }
            Self::Exploration => {
                format!("{:?}, softmax(temperature) or ucb(c)", Exploration::DEFAULT)
            }
        }
    }

    /// Whether `value` is allowed; turns a plain number into what the parameter stores.
    pub fn accept(&self, value: ParamValue) -> Option<ParamValue> {
        let number = match value {
            ParamValue::Int(n) => n as f64,
            ParamValue::Float(x) => x,
            _ => f64::NAN,
        };
        match (*self, value) {
            (Self::Word(words), ParamValue::Word(word)) => words.contains(&word).then_some(value),
            (Self::Float { min, max, open }, _) => {
                let above = if open { number > min } else { number >= min };
                (above && number <= max && number.is_finite()).then_some(ParamValue::Float(number))
            }
            (Self::Int { min }, ParamValue::Int(n)) => (n >= min).then_some(value),
            (Self::Maybe { .. }, ParamValue::Word(Self::NONE))
            | (Self::Widths, ParamValue::Widths(_))
            | (Self::StepSize, ParamValue::VisitCount { .. })
            | (Self::Exploration, ParamValue::Exploration(_))
            | (Self::Bool, ParamValue::Bool(_)) => Some(value),
            (Self::StepSize, _) => Self::Rate { open: true }.accept(value),
            (Self::Maybe { max, open }, _) => Self::Float { min: 0.0, max, open }.accept(value),
            (
                Self::Bool | Self::Word(_) | Self::Int { .. } | Self::Exploration | Self::Widths,
                _,
            ) => None,
            (Self::Rate { open }, _) => {
                let schedule = match value {
                    ParamValue::Schedule(schedule) => schedule,
                    // NaN, of which no range is right, if it is no number.
                    _ => Schedule::constant(number),
                };
                let (low, high) = schedule.range();
                let above = if open { low > 0.0 } else { low >= 0.0 };
                (above && high <= 1.0).then_some(ParamValue::Schedule(schedule))
            }
        }
    }
}

/// What a script's function takes and gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signature {
    /// In words: `(s) -> number or (s, a) -> number`.
    pub text: &'static str,
    /// How many arguments it may take.
    pub arities: &'static [usize],
}

/// A parameter of an agent.
#[derive(Debug, Clone, PartialEq)]
pub struct ParamSpec {
    /// Its key in the agent's map.
    pub name: &'static str,
    /// What it admits.
    pub kind: ParamKind,
    /// The functions it may be instead.
    pub function: Option<Signature>,
    /// Its value when the key is left out.
    pub default: ParamValue,
    /// One line: what it does.
    pub doc: &'static str,
}

/// An agent and its resolved parameters, defaults filled in.
#[derive(Debug, Clone)]
pub struct AgentConfig {
    /// Which agent.
    pub spec: &'static AgentSpec,
    /// Every parameter of the spec.
    pub params: BTreeMap<&'static str, ParamValue>,
}

impl AgentConfig {
    /// The agent with its defaults.
    pub fn new(spec: &'static AgentSpec) -> Self {
        Self { spec, params: spec.params.iter().map(|p| (p.name, p.default)).collect() }
    }

    /// A numeric parameter.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn float(&self, name: &str) -> f64 {
        match self.params[name] {
            ParamValue::Float(x) => x,
            ParamValue::Int(n) => n as f64,
            _ => unreachable!("{name} is a number"),
        }
    }

    /// A whole-number parameter.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn int(&self, name: &str) -> u64 {
        match self.params[name] {
            ParamValue::Int(n) => n,
            _ => unreachable!("{name} is a whole number"),
        }
    }

    /// A schedule.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn schedule(&self, name: &str) -> Schedule {
        match self.params[name] {
            ParamValue::Schedule(s) => s,
            ParamValue::Float(x) => Schedule::constant(x),
            ParamValue::Int(n) => Schedule::constant(n as f64),
            _ => unreachable!("{name} is a schedule"),
        }
    }

    /// A step size.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn alpha(&self) -> AlphaSource {
        match self.params["alpha"] {
            ParamValue::VisitCount { omega } => AlphaSource::VisitCount { omega },
            _ => AlphaSource::Schedule(self.schedule("alpha")),
        }
    }

    /// The behaviour policy; ε-greedy if the agent has no such parameter.
    pub fn exploration(&self) -> Exploration {
        match self.params.get("exploration") {
            Some(ParamValue::Exploration(exploration)) => *exploration,
            _ => Exploration::EpsilonGreedy,
        }
    }

    /// The widths of a network's layers.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn widths(&self, name: &str) -> Vec<usize> {
        match self.params[name] {
            ParamValue::Widths(widths) => widths.as_slice().iter().map(|n| *n as usize).collect(),
            _ => unreachable!("{name} is a list of widths"),
        }
    }

    /// The parameters that play a part: ε does with ε-greedy behaviour only, which goes without
    /// saying, what is left out does not, and priorities do with prioritised replay only.
    pub fn in_effect(&self) -> impl Iterator<Item = (&'static str, ParamValue)> {
        let unsaid = match self.exploration() {
            Exploration::EpsilonGreedy => "exploration",
            Exploration::Softmax { .. } | Exploration::Ucb { .. } => "epsilon",
        };
        let uniform = self.params.get("prioritized_replay") == Some(&ParamValue::Bool(false));
        let plays = move |(name, value): &(&&'static str, &ParamValue)| {
            let idle = uniform && name.starts_with("prioritized_replay_");
            **name != unsaid && **value != ParamValue::Word(ParamKind::NONE) && !idle
        };
        self.params.iter().filter(plays).map(|(k, v)| (*k, *v))
    }

    /// One of several words.
    ///
    /// # Panics
    /// If the agent has no such parameter: the registry's own mistake.
    pub fn word(&self, name: &str) -> &'static str {
        match self.params[name] {
            ParamValue::Word(word) => word,
            _ => unreachable!("{name} is a word"),
        }
    }

    /// Whether it has a switch of this name, and the switch is on.
    pub fn is_on(&self, name: &str) -> bool {
        self.params.get(name) == Some(&ParamValue::Bool(true))
    }

    /// Whether it learns the state values of a policy that is given.
    pub fn is_predictor(&self) -> bool {
        matches!(self.spec.build, Build::Predictor(_))
    }

    /// Whether it learns a network.
    pub fn is_network(&self) -> bool {
        matches!(self.spec.build, Build::Network(_))
    }

    /// Whether it plans on a model instead of learning from steps.
    pub fn is_planner(&self) -> bool {
        matches!(self.spec.build, Build::Planner(_))
    }
}
