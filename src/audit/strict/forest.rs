//! The shortest ways to where a potential is known: breadth first, backwards.

use crate::mdp::{FiniteMdp, Outcome};

/// No outcome, no state, no anchor.
pub(in crate::audit) const NONE: u32 = u32::MAX;

/// The outcomes of every action in state `s` that can happen, with their indices.
#[inline]
pub(in crate::audit) fn leaving(
    mdp: &FiniteMdp,
    s: usize,
) -> impl Iterator<Item = (usize, &Outcome)> {
    let range = mdp.range(s, 0).start..mdp.range(s, mdp.n_actions() - 1).end;
    range.clone().zip(&mdp.outcomes()[range]).filter(|(_, o)| o.probability > 0.0)
}

/// Where the way from a state ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::audit) enum Anchor {
    /// The episode ends, in this state.
    Terminal(u32),
    /// It cannot end: the state is one that is walked through again and again, or a dead end
    /// without any outcome.
    Root(u32),
}

/// One way from every reachable state to an anchor, as short as can be: one of its transitions
/// leads to a state that is a step nearer.
#[derive(Debug)]
pub(in crate::audit) struct Forest {
    /// The outcome that is the way's next step, one per state; [`NONE`] at roots.
    pub(in crate::audit) step: Vec<u32>,
    /// How many steps it has, one per state.
    pub(in crate::audit) depth: Vec<u32>,
    /// Where it ends, one per state: an index into `anchors`.
    pub(in crate::audit) anchor: Vec<u32>,
    /// Terminal states first, in the order in which they are met.
    pub(in crate::audit) anchors: Vec<Anchor>,
    /// The anchor that stands for each terminal state; [`NONE`] where no transition ends.
    pub(in crate::audit) terminal: Vec<u32>,
    /// The reachable states: each one after that to which its way leads.
    pub(in crate::audit) order: Vec<u32>,
    /// How many of them, the first of `order`, can come to a terminal transition.
    pub(in crate::audit) grounded: usize,
}

impl Forest {
    /// Of the states that are `reachable`; takes `O(states + outcomes)`.
    ///
    /// Every transition that ends an episode leads to one ground, from which the search starts.
    /// States from which no episode ends are searched from roots: from such a state the first
    /// transition is followed, or one that stays if there is, until a state comes again.
    pub(in crate::audit) fn new(mdp: &FiniteMdp, reachable: &[bool]) -> Self {
        let n = mdp.n_states();
        let mut forest = Self {
            step: vec![NONE; n],
            depth: vec![0; n],
            anchor: vec![NONE; n],
            anchors: Vec::new(),
            terminal: vec![NONE; n],
            order: Vec::with_capacity(n),
            grounded: 0,
        };
        for s in (0..n).filter(|&s| reachable[s]) {
            for (_, o) in leaving(mdp, s).filter(|(_, o)| o.terminated) {
                let place = &mut forest.terminal[o.next_state as usize];
                if *place == NONE {
                    *place = forest.anchors.len() as u32;
                    forest.anchors.push(Anchor::Terminal(o.next_state));
                }
            }
        }
        let before = Predecessors::new(mdp, reachable);
        for &(s, i) in before.of(n) {
            let end = mdp.outcomes()[i as usize].next_state;
            forest.reach(s, i, 1, forest.terminal[end as usize]);
        }
        forest.search(&before, 0);
        forest.grounded = forest.order.len();
        let mut walked = vec![NONE; n];
        for s in (0..n).filter(|&s| reachable[s]) {
            if forest.anchor[s] == NONE {
                let root = recurrent(mdp, s as u32, &mut walked);
                let from = forest.order.len();
                forest.reach(root, NONE, 0, forest.anchors.len() as u32);
                forest.anchors.push(Anchor::Root(root));
                forest.search(&before, from);
            }
        }
        forest
    }

    #[inline]
    fn reach(&mut self, s: u32, step: u32, depth: u32, anchor: u32) {
        let place = s as usize;
        if self.anchor[place] == NONE {
            self.step[place] = step;
            self.depth[place] = depth;
            self.anchor[place] = anchor;
            self.order.push(s);
        }
    }

    /// Goes on from the states of `order` that were found last.
    fn search(&mut self, before: &Predecessors, from: usize) {
        let mut at = from;
        while at < self.order.len() {
            let v = self.order[at] as usize;
            for &(s, i) in before.of(v) {
                self.reach(s, i, self.depth[v] + 1, self.anchor[v]);
            }
            at += 1;
        }
    }
}

/// A state that a walk from `s` comes to again, or a dead end.
fn recurrent(mdp: &FiniteMdp, s: u32, walked: &mut [u32]) -> u32 {
    let mut at = s;
    while walked[at as usize] != s {
        walked[at as usize] = s;
        match endless_step(mdp, at) {
            Some(i) => at = mdp.outcomes()[i].next_state,
            None => break,
        }
    }
    at
}

/// The transition by which a walk that never ends leaves `s`: the first, but rather one that stays.
pub(in crate::audit) fn endless_step(mdp: &FiniteMdp, s: u32) -> Option<usize> {
    let mut all = leaving(mdp, s as usize);
    let stays = leaving(mdp, s as usize).find(|(_, o)| o.next_state == s);
    stays.or_else(|| all.next()).map(|(i, _)| i)
}

/// The transitions that lead to each state; to the ground, which is number `n_states`, those that
/// end an episode. Of several between the same two the first.
struct Predecessors {
    starts: Vec<u32>,
    /// Where a transition starts, and its index among the outcomes.
    list: Vec<(u32, u32)>,
}

impl Predecessors {
    fn new(mdp: &FiniteMdp, reachable: &[bool]) -> Self {
        let n = mdp.n_states();
        let mut starts = vec![0u32; n + 2];
        let mut seen = vec![NONE; n + 1];
        each(mdp, reachable, &mut seen, |_, _, to| starts[to + 1] += 1);
        for to in 0..=n {
            starts[to + 1] += starts[to];
        }
        let mut list = vec![(0, 0); starts[n + 1] as usize];
        let mut next = starts.clone();
        seen.fill(NONE);
        each(mdp, reachable, &mut seen, |s, i, to| {
            list[next[to] as usize] = (s as u32, i as u32);
            next[to] += 1;
        });
        Self { starts, list }
    }

    #[inline]
    fn of(&self, to: usize) -> &[(u32, u32)] {
        &self.list[self.starts[to] as usize..self.starts[to + 1] as usize]
    }
}

/// Calls `visit(s, outcome, to)` for the first transition from each state to each other.
#[inline]
fn each(
    mdp: &FiniteMdp,
    reachable: &[bool],
    seen: &mut [u32],
    mut visit: impl FnMut(usize, usize, usize),
) {
    let n = mdp.n_states();
    for s in (0..n).filter(|&s| reachable[s]) {
        for (i, o) in leaving(mdp, s) {
            let to = if o.terminated { n } else { o.next_state as usize };
            if seen[to] != s as u32 {
                seen[to] = s as u32;
                visit(s, i, to);
            }
        }
    }
}
