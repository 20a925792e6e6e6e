//! What kind of term a shaping is: what it depends on, and when it pays. From that follows what a
//! potential could do in its place.

use serde::Serialize;

use crate::mdp::FiniteMdp;

/// What agrees, relative to the largest |F|.
const TOLERANCE: f64 = 1e-9;

/// The kind of a term F(s, a, s′) that is added to the reward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// 0 everywhere.
    Nothing,
    /// The same on every transition: a cost or a wage of living.
    Constant,
    /// Paid only when an episode ends: it changes what the endings are worth, as a potential that is
    /// not 0 there would.
    AtTheEnd,
    /// A function of the state arrived in: paid again and again for being there.
    OfNextState,
    /// Pays for going one way between two states and takes nothing back on the way home.
    OneWay,
    /// Two actions that lead from one state to the same other are paid differently.
    OfAction,
    /// None of these.
    Other,
}

/// One transition and what is added to its reward.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    from: u32,
    action: u32,
    to: u32,
    terminated: bool,
    f: f64,
}

/// The pattern of `f` (one value per outcome) on the transitions out of `reachable` states.
pub fn pattern(mdp: &FiniteMdp, f: &[f64], reachable: &[bool]) -> Pattern {
    let mut edges = Vec::new();
    for s in (0..mdp.n_states()).filter(|&s| reachable[s]) {
        for a in 0..mdp.n_actions() {
            let range = mdp.range(s, a);
            edges.extend(range.filter(|&i| mdp.outcomes()[i].probability > 0.0).map(|i| {
                let o = mdp.outcomes()[i];
                let (from, action) = (s as u32, a as u32);
                Edge { from, action, to: o.next_state, terminated: o.terminated, f: f[i] }
            }));
        }
    }
    let largest = edges.iter().fold(0.0f64, |m, e| m.max(e.f.abs()));
    let same = |a: f64, b: f64| (a - b).abs() <= TOLERANCE * largest;
    let Some(first) = edges.first().map(|e| e.f) else { return Pattern::Nothing };
    if largest == 0.0 {
        return Pattern::Nothing;
    }
    if edges.iter().all(|e| same(e.f, first)) {
        return Pattern::Constant;
    }
    if edges.iter().all(|e| e.terminated || same(e.f, 0.0)) {
        return Pattern::AtTheEnd;
    }
    let constant_within = |edges: &[Edge], key: fn(&Edge) -> (u32, u32, bool)| {
        edges.windows(2).all(|w| key(&w[0]) != key(&w[1]) || same(w[0].f, w[1].f))
    };
    edges.sort_by_key(|e| (e.to, e.terminated, e.from));
    if constant_within(&edges, |e| (e.to, 0, e.terminated)) {
        return Pattern::OfNextState;
    }
    edges.sort_by_key(|e| (e.from, e.to, e.terminated, e.action));
    if !constant_within(&edges, |e| (e.from, e.to, e.terminated)) {
        return Pattern::OfAction;
    }
    if one_way(&edges, largest) { Pattern::OneWay } else { Pattern::Other }
}

/// Whether F has one sign, and wherever it pays for s → s′ it pays nothing for s′ → s. `edges` are
/// sorted by where they come from and go to.
fn one_way(edges: &[Edge], largest: f64) -> bool {
    let small = TOLERANCE * largest;
    let back = |e: &Edge| {
        let at = edges.partition_point(|b| (b.from, b.to, b.terminated) < (e.to, e.from, false));
        edges.get(at).filter(|b| (b.from, b.to, b.terminated) == (e.to, e.from, false))
    };
    let positive = edges.iter().all(|e| e.f >= -small);
    let negative = edges.iter().all(|e| e.f <= small);
    let paid = |e: &&Edge| e.f.abs() > small && !e.terminated && e.from != e.to;
    let returns = edges.iter().filter(paid).filter_map(back);
    let mut seen = false;
    let unpaid = returns.map(|b| b.f.abs() <= small).all(|free| {
        seen = true;
        free
    });
    (positive || negative) && seen && unpaid
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Outcome;

    /// Three states in a row, 0 left and 1 right; the right end exits.
    fn corridor() -> FiniteMdp {
        let go = |next_state, terminated| {
            vec![Outcome { probability: 1.0, next_state, reward: 0.0, terminated }]
        };
        let table = [
            vec![go(0, false), go(1, false)],
            vec![go(0, false), go(2, false)],
            vec![go(1, false), go(2, true)],
        ];
        FiniteMdp::new(&table, vec![1.0, 0.0, 0.0]).unwrap()
    }

    fn of(f: impl Fn(usize, usize, &Outcome) -> f64) -> Pattern {
        let mdp = corridor();
        let paid = mdp.with_rewards(|s, a, o| f(s, a, o));
        let f: Vec<f64> = paid.outcomes().iter().map(|o| o.reward).collect();
        pattern(&mdp, &f, &[true; 3])
    }

    #[test]
    fn each_kind_is_told_apart() {
        assert_eq!(of(|_, _, _| 0.0), Pattern::Nothing);
        assert_eq!(of(|_, _, _| -0.01), Pattern::Constant);
        assert_eq!(of(|_, _, o| if o.terminated { 250.0 } else { 0.0 }), Pattern::AtTheEnd);
        assert_eq!(of(|_, _, o| f64::from(o.next_state)), Pattern::OfNextState);
        let progress = |s: usize, o: &Outcome| (f64::from(o.next_state) - s as f64).max(0.0);
        assert_eq!(of(|s, _, o| progress(s, o)), Pattern::OneWay);
        assert_eq!(of(|s, _, o| f64::from(o.next_state) - s as f64), Pattern::Other);
    }

    #[test]
    fn a_bonus_for_an_action_is_seen_where_two_lead_the_same_way() {
        let stay =
            |reward| vec![Outcome { probability: 1.0, next_state: 0, reward, terminated: false }];
        let mdp = FiniteMdp::new(&[vec![stay(0.0), stay(0.0)]], vec![1.0]).unwrap();
        assert_eq!(pattern(&mdp, &[0.0, 1.0], &[true]), Pattern::OfAction);
    }
}
