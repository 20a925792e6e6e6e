//! End components: sets of states and actions among which an episode can go on for ever (de Alfaro
//! 1997; Baier & Katoen 2008, section 10.6.3).

use crate::learn::planning::{Components, Dynamics, Sources};

/// States, and actions in them that lead nowhere else and never end; each state can be reached from
/// each other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct EndComponent {
    /// Places, in order.
    pub(super) states: Vec<usize>,
    /// Pairs `place * n_actions + a`, in order: at least one a state.
    pub(super) pairs: Vec<usize>,
}

/// The maximal end components of the pairs that are `usable`, in order.
///
/// Pairs that may lead out of their strongly connected component go, with all that then can no
/// longer stay, until none does.
pub(super) fn end_components(
    dynamics: &Dynamics,
    usable: impl Fn(usize) -> bool,
) -> Vec<EndComponent> {
    let (n, n_actions) = (dynamics.len(), dynamics.n_actions());
    let sources = dynamics.sources();
    let mut staying = Staying {
        n_actions,
        sources: &sources,
        pairs: vec![true; n * n_actions],
        counts: vec![n_actions; n],
    };
    for i in 0..n * n_actions {
        if dynamics.ends(i) || !usable(i) {
            staying.remove(i);
        }
    }
    loop {
        let edges = Edges::new(dynamics, &staying.pairs);
        let components = Components::new(n, |s| edges.of(s));
        let mut done = true;
        for i in 0..n * n_actions {
            let own = components.of(i / n_actions);
            let leaves = |&to: &u32| components.of(to as usize) != own;
            if staying.pairs[i] && dynamics.next(i).0.iter().any(leaves) {
                staying.remove(i);
                done = false;
            }
        }
        if done {
            return collect(&components, &staying);
        }
    }
}

fn collect(components: &Components, staying: &Staying<'_>) -> Vec<EndComponent> {
    let mut found: Vec<EndComponent> = components
        .iter()
        .filter(|nodes| nodes.iter().all(|&s| staying.counts[s as usize] > 0))
        .map(|nodes| {
            let mut states: Vec<usize> = nodes.iter().map(|&s| s as usize).collect();
            states.sort_unstable();
            let all =
                states.iter().flat_map(|s| s * staying.n_actions..(s + 1) * staying.n_actions);
            let pairs = all.filter(|&i| staying.pairs[i]).collect();
            EndComponent { states, pairs }
        })
        .collect();
    found.sort_unstable_by_key(|component| component.states[0]);
    found
}

/// The pairs with which an episode may still be thought to stay.
struct Staying<'a> {
    n_actions: usize,
    sources: &'a Sources,
    pairs: Vec<bool>,
    /// How many of them each state has.
    counts: Vec<usize>,
}

impl Staying<'_> {
    /// Removes a pair, and all that may lead to a state that has none left.
    fn remove(&mut self, pair: usize) {
        let mut stack = vec![pair];
        while let Some(i) = stack.pop() {
            if std::mem::replace(&mut self.pairs[i], false) {
                let s = i / self.n_actions;
                self.counts[s] -= 1;
                if self.counts[s] == 0 {
                    stack.extend(self.sources.of(s).iter().map(|&i| i as usize));
                }
            }
        }
    }
}

/// Where the pairs that are left lead.
struct Edges {
    offsets: Vec<u32>,
    next: Vec<u32>,
}

impl Edges {
    fn new(dynamics: &Dynamics, pairs: &[bool]) -> Self {
        let (mut offsets, mut next) = (vec![0], Vec::new());
        for (i, pair) in pairs.iter().enumerate() {
            if *pair {
                next.extend_from_slice(dynamics.next(i).0);
            }
            if (i + 1).is_multiple_of(dynamics.n_actions()) {
                offsets.push(next.len() as u32);
            }
        }
        Self { offsets, next }
    }

    fn of(&self, s: usize) -> &[u32] {
        &self.next[self.offsets[s] as usize..self.offsets[s + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learn::planning::Over;
    use crate::mdp::{FiniteMdp, Outcome};

    /// States 0 and 1 lead to each other by action 0; action 1 of state 1 may fall to 2, which
    /// leads to 3 and back by action 1, and ends by action 0. State 4 only gets away.
    fn model() -> FiniteMdp {
        let go = |probability, next_state, terminated| Outcome {
            probability,
            next_state,
            reward: 0.0,
            terminated,
        };
        let sure = |to| vec![go(1.0, to, false)];
        let end = vec![go(1.0, 0, true)];
        FiniteMdp::new(
            &[
                vec![sure(1), sure(4)],
                vec![sure(0), vec![go(0.5, 0, false), go(0.5, 2, false)]],
                vec![end.clone(), sure(3)],
                vec![vec![go(0.9, 2, false), go(0.1, 0, true)], sure(2)],
                vec![sure(0), end],
            ],
            vec![0.2; 5],
        )
        .unwrap()
    }

    #[test]
    fn the_components_of_a_small_model() {
        let dynamics = Dynamics::new(&model(), Over::Every);
        let found = end_components(&dynamics, |_| true);
        let expected = [
            EndComponent { states: vec![0, 1, 4], pairs: vec![0, 1, 2, 8] },
            EndComponent { states: vec![2, 3], pairs: vec![5, 7] },
        ];
        assert_eq!(found, expected);
        // Without the way from 3 back for sure, nothing holds an episode there; without the way
        // from 4 back, not there either.
        let found = end_components(&dynamics, |i| i != 7 && i != 8);
        assert_eq!(found, [EndComponent { states: vec![0, 1], pairs: vec![0, 2] }]);
    }
}
