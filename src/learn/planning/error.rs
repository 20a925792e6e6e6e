//! Why a model has no solution.

/// Why there are no values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlanError {
    /// γ = 1, and in these states the policy goes on for ever.
    Endless(Vec<usize>),
    /// γ = 1, and whatever is played in this state, the episode may never end.
    NoProperPolicy(usize),
    /// The equations of this many states that lead to each other could not be solved.
    NotSolved(usize),
    /// A value is not a finite number.
    NotFinite,
}

impl PlanError {
    /// The same with other names of the states.
    pub(super) fn of_model(self, name: impl Fn(usize) -> usize) -> Self {
        match self {
            Self::Endless(mut states) => {
                for s in &mut states {
                    *s = name(*s);
                }
                states.sort_unstable();
                Self::Endless(states)
            }
            Self::NoProperPolicy(s) => Self::NoProperPolicy(name(s)),
            Self::NotSolved(_) | Self::NotFinite => self,
        }
    }
}

impl std::fmt::Display for PlanError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Endless(states) => {
                f.write_str("with gamma = 1 the value is not defined: ")?;
                match states.as_slice() {
                    [s] => write!(f, "an episode may stay in state {s} for ever")?,
                    [a, .., b] => write!(
                        f,
                        "an episode may stay among {} states ({a} to {b}) for ever",
                        states.len()
                    )?,
                    [] => unreachable!("a component has states"),
                }
                f.write_str("; use gamma < 1")
            }
            Self::NoProperPolicy(s) => write!(
                f,
                "with gamma = 1 no policy has a value: from state {s} none is sure to end the \
                 episode; use gamma < 1"
            ),
            Self::NotSolved(n) => write!(
                f,
                "{n} states lead to each other for so long that their values cannot be computed; \
                 use a smaller gamma"
            ),
            Self::NotFinite => {
                f.write_str("a value is not finite: are all rewards and probabilities numbers?")
            }
        }
    }
}

impl std::error::Error for PlanError {}
