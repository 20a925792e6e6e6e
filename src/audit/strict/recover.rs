//! From shaping rewards to the one potential that could have made them.

use super::forest::{Anchor, Forest, NONE, endless_step, leaving};
use crate::mdp::FiniteMdp;
use crate::mdp::math::pow_int;

/// Beyond this, rounding errors of the recovered potential may pass the tolerance.
const MAX_GROWTH: f64 = 1e6;

/// What Φ is beyond a terminal transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::audit) enum Beyond {
    /// Nothing.
    Zero,
    /// Whatever the rewards say, one value per terminal state.
    Unknown,
}

/// A potential that agrees with the rewards along the forest.
#[derive(Debug)]
pub(in crate::audit) struct Recovered {
    /// Φ, one value per state; 0 where no episode can be.
    pub(in crate::audit) phi: Vec<f64>,
    /// Φ of the anchors.
    pub(in crate::audit) anchors: Vec<f64>,
    /// How many constants could be chosen at will: groups of states that nothing ties to a terminal
    /// transition, and in which every way from one state to another has the same discount.
    pub(in crate::audit) free: usize,
    /// Whether rounding errors stay below the tolerance.
    pub(in crate::audit) sound: bool,
}

impl Recovered {
    /// S, the rewards being of this `magnitude`.
    pub(in crate::audit) fn scale(&self, magnitude: f64) -> f64 {
        self.phi.iter().chain(&self.anchors).fold(magnitude, |m, x| m.max(x.abs()))
    }

    /// Φ where a transition leads.
    #[inline]
    pub(in crate::audit) fn beyond(&self, forest: &Forest, next: u32, terminated: bool) -> f64 {
        if terminated {
            self.anchors[forest.terminal[next as usize] as usize]
        } else {
            self.phi[next as usize]
        }
    }
}

/// Solves `γΦ(s′) − Φ(s) = F` along the forest, `Φ(s) = γΦ(s′) − F` from its anchors backwards,
/// where errors are damped. What Φ is at an anchor follows from the transitions that are not of the
/// forest: from a way back to the anchor, or from one to another anchor.
///
/// A constant that stays free is chosen such that the group's first state has the value `like`
/// gives it, or else such that the largest Φ of its terminal states is 0.
pub(in crate::audit) fn recover(
    mdp: &FiniteMdp,
    f: &[f64],
    gamma: f64,
    forest: &Forest,
    beyond: Beyond,
    like: Option<&[f64]>,
) -> Recovered {
    let mut anchors = vec![0.0; forest.anchors.len()];
    let mut phi = vec![0.0; mdp.n_states()];
    propagate(mdp, f, gamma, forest, &anchors, &mut phi);
    let fixed = |anchor: &Anchor| beyond == Beyond::Zero && matches!(anchor, Anchor::Terminal(_));
    if forest.anchors.iter().all(fixed) {
        return Recovered { phi, anchors, free: 0, sound: true };
    }
    let mut links = Links::new(gamma, forest.anchors.iter().map(fixed));
    let take_in = |links: &mut Links, s: usize, i: usize| {
        let o = &mdp.outcomes()[i];
        let next = o.next_state as usize;
        let near = (forest.anchor[s], i64::from(forest.depth[s]), phi[s]);
        let far = if o.terminated {
            (forest.terminal[next], 0, 0.0)
        } else {
            (forest.anchor[next], i64::from(forest.depth[next]), phi[next])
        };
        links.equation(near, far, f[i]);
    };
    // Where no episode ends the way round that begins in the root says best what Φ is there.
    for anchor in &forest.anchors {
        if let &Anchor::Root(root) = anchor
            && let Some(i) = endless_step(mdp, root)
        {
            take_in(&mut links, root as usize, i);
        }
    }
    let (grounded, endless) = forest.order.split_at(forest.grounded);
    for &s in endless.iter().chain(grounded) {
        let s = s as usize;
        if links.open == 0 {
            break;
        }
        for (i, _) in leaving(mdp, s).filter(|(i, _)| *i as u32 != forest.step[s]) {
            take_in(&mut links, s, i);
        }
    }
    let free = links.choose(forest, &phi, like);
    for (a, value) in anchors.iter_mut().enumerate() {
        *value = links.value(a);
    }
    propagate(mdp, f, gamma, forest, &anchors, &mut phi);
    Recovered { phi, anchors, free, sound: links.growth <= MAX_GROWTH }
}

/// `Φ(s) = γΦ(s′) − F` from the anchors backwards.
fn propagate(
    mdp: &FiniteMdp,
    f: &[f64],
    gamma: f64,
    forest: &Forest,
    anchors: &[f64],
    phi: &mut [f64],
) {
    for &s in &forest.order {
        let s = s as usize;
        phi[s] = if forest.step[s] == NONE {
            anchors[forest.anchor[s] as usize]
        } else {
            let i = forest.step[s] as usize;
            let o = &mdp.outcomes()[i];
            let next = if o.terminated {
                anchors[forest.terminal[o.next_state as usize] as usize]
            } else {
                phi[o.next_state as usize]
            };
            gamma * next - f[i]
        };
    }
}

/// Φ = γ^depth · x + rest, x being Φ of the anchor: (anchor, depth, rest).
type Affine = (u32, i64, f64);

/// How the anchors' potentials depend on one another: every one is `γ^power` times that of the one
/// that its group is led by, plus `rest`. Powers are whole, so that equal discounts are seen to be.
struct Links {
    gamma: f64,
    /// To which anchor each refers; itself if it leads.
    to: Vec<u32>,
    power: Vec<i64>,
    rest: Vec<f64>,
    /// Of leaders: Φ, where it is known.
    known: Vec<Option<f64>>,
    /// How many groups are not known.
    open: usize,
    /// By how much an error of one value may have grown in another.
    growth: f64,
}

impl Links {
    /// Anchors of which some are `fixed` at 0.
    fn new(gamma: f64, fixed: impl Iterator<Item = bool>) -> Self {
        let known: Vec<Option<f64>> = fixed.map(|fixed| fixed.then_some(0.0)).collect();
        Self {
            gamma,
            to: (0..known.len() as u32).collect(),
            power: vec![0; known.len()],
            rest: vec![0.0; known.len()],
            open: known.iter().filter(|known| known.is_none()).count(),
            known,
            growth: 1.0,
        }
    }

    /// γ^power.
    fn gain(&self, power: i64) -> f64 {
        pow_int(self.gamma, power)
    }

    /// The leader of an anchor's group, with the power and the rest that lead there.
    fn lead(&mut self, anchor: u32) -> Affine {
        // The way up, then down again, so that each on it refers to the leader itself.
        let mut path = Vec::new();
        let mut at = anchor as usize;
        while self.to[at] as usize != at {
            path.push(at);
            at = self.to[at] as usize;
        }
        let leader = at as u32;
        let (mut power, mut rest) = (0, 0.0);
        for &at in path.iter().rev() {
            rest = self.rest[at] + self.gain(self.power[at]) * rest;
            power += self.power[at];
            (self.to[at], self.power[at], self.rest[at]) = (leader, power, rest);
        }
        (leader, power, rest)
    }

    fn affine(&mut self, (anchor, depth, rest): Affine) -> Affine {
        let (leader, power, offset) = self.lead(anchor);
        let offset = if offset == 0.0 { 0.0 } else { self.gain(depth) * offset };
        (leader, power + depth, rest + offset)
    }

    /// Takes in `γΦ(far) − Φ(near) = F`.
    fn equation(&mut self, near: Affine, far: Affine, f: f64) {
        if near.0 == far.0 && self.known[near.0 as usize].is_some() {
            return;
        }
        let (a, power_a, rest_a) = self.affine(near);
        let (b, power_b, rest_b) = self.affine(far);
        let (power_b, rest_b) = (power_b + 1, self.gamma * rest_b);
        let (known_a, known_b) = (self.known[a as usize], self.known[b as usize]);
        // γ^power_b x_b + rest_b − γ^power_a x_a − rest_a = F
        let right = f - rest_b + rest_a;
        if a == b {
            if known_a.is_none() && power_a != power_b && self.gamma != 1.0 {
                let factor = self.gain(power_b) - self.gain(power_a);
                self.growth = self.growth.max(1.0 / factor.abs());
                self.known[a as usize] = Some(right / factor);
                self.open -= 1;
            }
        } else if known_a.is_none() && (known_b.is_some() || power_b >= power_a) {
            self.refer((a, power_a), (b, power_b), -right);
        } else if known_b.is_none() {
            self.refer((b, power_b), (a, power_a), right);
        }
    }

    /// Takes in `γ^power_a x_a = γ^power_b x_b + rest`, of which a is not known.
    fn refer(&mut self, (a, power_a): (u32, i64), (b, power_b): (u32, i64), rest: f64) {
        let growth = self.gain(-power_a);
        self.growth = self.growth.max(growth).max(self.gain(power_b - power_a));
        self.to[a as usize] = b;
        self.power[a as usize] = power_b - power_a;
        self.rest[a as usize] = rest * growth;
        self.open -= 1;
    }

    /// Φ of an anchor, once its group is known.
    fn value(&mut self, anchor: usize) -> f64 {
        let (leader, power, rest) = self.lead(anchor as u32);
        let x = self.known[leader as usize].unwrap_or(0.0);
        if x == 0.0 { rest } else { self.gain(power) * x + rest }
    }

    /// Chooses a value for every group that has none; how many they were.
    fn choose(&mut self, forest: &Forest, phi: &[f64], like: Option<&[f64]>) -> usize {
        let mut chosen: Vec<Option<f64>> = vec![None; self.to.len()];
        let mut choose = |place: u32, x: f64, least: bool| {
            let place = &mut chosen[place as usize];
            *place = Some(match *place {
                Some(other) if least => x.min(other),
                Some(other) => other,
                None => x,
            });
        };
        if let Some(like) = like {
            for s in (0..phi.len()).filter(|&s| forest.anchor[s] != NONE) {
                let own = (forest.anchor[s], i64::from(forest.depth[s]), phi[s]);
                let (leader, power, rest) = self.affine(own);
                choose(leader, (like[s] - rest) * self.gain(-power), false);
            }
        } else {
            for a in 0..self.to.len() as u32 {
                if let Anchor::Terminal(_) = forest.anchors[a as usize] {
                    let (leader, power, rest) = self.lead(a);
                    choose(leader, -rest * self.gain(-power), true);
                }
            }
        }
        let mut free = 0;
        for (a, x) in chosen.into_iter().enumerate() {
            if self.to[a] as usize == a && self.known[a].is_none() {
                free += 1;
                self.known[a] = Some(x.unwrap_or(0.0));
            }
        }
        free
    }
}
