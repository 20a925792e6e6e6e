//! A task that a shaping would break, where it is no potential's.
//!
//! For every F that is not potential-based there are rewards under which no policy that is optimal
//! with F is optimal without (Ng, Harada & Russell 1999, necessity). Here they are made for the
//! model's own dynamics. A policy π₀ and an action with `A_F ≠ 0` give two policies that differ in one
//! state s₀ only; call `paid` the action of the one that F makes worse, there by D, and N its
//! discounted visits to s₀. The task pays `D / 2N` for `paid` in s₀, nothing for `tempting`, the other,
//! nothing for π₀ elsewhere, and fines every other action. Starting in s₀, `paid` is worth D/2 more
//! without F and D/2 less with it.

use serde::Serialize;

use super::strict::forest::{Forest, NONE, endless_step};
use crate::learn::planning::{Dynamics, PlanError, Policy, PolicyValue, Problem, Start};
use crate::mdp::{Action, FiniteMdp};

/// How many pairs (s, a) are tried: with γ = 1 some policies never end.
const ATTEMPTS: usize = 32;

/// A task on the same dynamics, and what the shaping does to it. Verified by solving it with the
/// shaping and without.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BrokenTask {
    /// s₀, where episodes of this task start.
    pub start: usize,
    /// The action in s₀ that alone is optimal.
    pub paid: Action,
    /// The action in s₀ that alone is optimal once F is added.
    pub tempting: Action,
    /// The reward of `paid` in s₀.
    pub reward: f64,
    /// What an action other than `policy`'s costs elsewhere, and a third action in s₀.
    pub fine: f64,
    /// D/2: by how much `paid` is the better without F, and `tempting` with it, over the episode.
    pub margin: f64,
    /// The actions that are not fined, one per state of the model; `paid` in s₀.
    pub policy: Vec<Action>,
}

/// Looks for a task that `f` (learned minus native reward, one value per outcome of `mdp`) would
/// break. `dynamics` are those of the reachable states. `None` if F has no advantages, being a
/// potential's in expectation; if they are too small for the two solutions to be told apart; or if,
/// with γ = 1, every policy that F prefers goes round for ever.
///
/// # Errors
/// If a value is not finite, or γ = 1 and the shortest ways never end.
pub fn broken_task(
    mdp: &FiniteMdp,
    dynamics: &Dynamics,
    f: &[f64],
    gamma: f64,
) -> Result<Option<BrokenTask>, PlanError> {
    let n_actions = dynamics.n_actions();
    let policy = shortest_ways(mdp, dynamics);
    let rewards = dynamics.expect(mdp, |i| f[i]);
    let value = dynamics.value(&rewards, gamma, Policy::Deterministic(&policy))?.v;
    let mut advantages = dynamics.q_from_v(&rewards, gamma, &value);
    advantages.iter_mut().enumerate().for_each(|(i, q)| *q -= value[i / n_actions]);
    let scale = value.iter().chain(&rewards).fold(0.0f64, |m, x| m.max(x.abs()));
    let mut pairs: Vec<usize> = (0..advantages.len())
        .filter(|&i| i % n_actions != policy[i / n_actions] && advantages[i].abs() > 1e-8 * scale)
        .collect();
    pairs.sort_by(|&i, &j| advantages[j].abs().total_cmp(&advantages[i].abs()).then(i.cmp(&j)));
    let task = Task { mdp, dynamics, rewards: &rewards, gamma };
    Ok(pairs.into_iter().take(ATTEMPTS).find_map(|pair| task.attempt(&policy, pair)))
}

/// The first actions of the shortest ways to an end, or round where there is none, by place. With
/// them every episode that can end is sure to.
fn shortest_ways(mdp: &FiniteMdp, dynamics: &Dynamics) -> Vec<Action> {
    let mut reachable = vec![false; mdp.n_states()];
    (0..dynamics.len()).for_each(|place| reachable[dynamics.state(place)] = true);
    let forest = Forest::new(mdp, &reachable);
    let action = |place| {
        let s = dynamics.state(place);
        let step = match forest.step[s] {
            NONE => endless_step(mdp, s as u32)?,
            step => step as usize,
        };
        (0..mdp.n_actions()).find(|&a| mdp.range(s, a).contains(&step))
    };
    (0..dynamics.len()).map(|place| action(place).unwrap_or(0)).collect()
}

struct Task<'a> {
    mdp: &'a FiniteMdp,
    dynamics: &'a Dynamics,
    /// Expected F.
    rewards: &'a [f64],
    gamma: f64,
}

impl Task<'_> {
    fn value(&self, rewards: &[f64], policy: &[Action]) -> Option<Vec<f64>> {
        let value = self.dynamics.value(rewards, self.gamma, Policy::Deterministic(policy));
        value.ok().map(|PolicyValue { v, .. }| v)
    }

    /// The task in which π₀ and the other action of `pair` compete.
    fn attempt(&self, policy: &[Action], pair: usize) -> Option<BrokenTask> {
        let n_actions = self.dynamics.n_actions();
        let (start, other) = (pair / n_actions, pair % n_actions);
        let mut changed = policy.to_vec();
        changed[start] = other;
        let (mut paid, mut tempting) = (policy.to_vec(), changed);
        let mut shaped = [self.value(self.rewards, &paid)?, self.value(self.rewards, &tempting)?];
        if shaped[1][start] < shaped[0][start] {
            std::mem::swap(&mut paid, &mut tempting);
            shaped.swap(0, 1);
        }
        let margin = (shaped[1][start] - shaped[0][start]) / 2.0;
        let in_start = |i: usize| i / n_actions == start;
        let visit: Vec<f64> =
            (0..self.rewards.len()).map(|i| f64::from(u8::from(in_start(i)))).collect();
        let reward = margin / self.value(&visit, &paid)?[start];
        // The fine outweighs what any other action could win from either of the two.
        let pair_paid = start * n_actions + paid[start];
        let pays: Vec<f64> =
            (0..self.rewards.len()).map(|i| if i == pair_paid { reward } else { 0.0 }).collect();
        let plain = self.value(&pays, &paid)?;
        let temptation =
            self.best_advantage(&pays, &plain).max(self.best_advantage(self.rewards, &shaped[1]));
        let fine = 2.0 * (temptation + margin);
        let allowed = |i: usize| {
            let (s, a) = (i / n_actions, i % n_actions);
            a == paid[s] || a == tempting[s]
        };
        let task: Vec<f64> =
            (0..pays.len()).map(|i| if allowed(i) { pays[i] } else { -fine }).collect();
        let with_shaping: Vec<f64> = task.iter().zip(self.rewards).map(|(r, f)| r + f).collect();
        let prefers = |rewards: &[f64], from: &[Action], action: Action| {
            self.prefers(rewards, from, start) == Some(action)
        };
        let breaks = prefers(&task, &tempting, paid[start])
            && prefers(&with_shaping, &paid, tempting[start]);
        breaks.then(|| {
            let mut unfined = vec![0; self.mdp.n_states()];
            for (place, &action) in paid.iter().enumerate() {
                unfined[self.dynamics.state(place)] = action;
            }
            BrokenTask {
                start: self.dynamics.state(start),
                paid: paid[start],
                tempting: tempting[start],
                reward,
                fine,
                margin,
                policy: unfined,
            }
        })
    }

    /// The largest `r + γ Σ p V(s′) − V(s)`.
    fn best_advantage(&self, rewards: &[f64], v: &[f64]) -> f64 {
        let q = self.dynamics.q_from_v(rewards, self.gamma, v);
        let n_actions = self.dynamics.n_actions();
        q.iter().enumerate().fold(0.0, |m, (i, q)| m.max(q - v[i / n_actions]))
    }

    /// The action that is optimal in `start`, if it is so by far enough to be certain.
    fn prefers(&self, rewards: &[f64], from: &[Action], start: usize) -> Option<Action> {
        let problem =
            Problem { dynamics: self.dynamics, rewards, gamma: self.gamma, allowed: None };
        let optimum = problem.optimum(Start::Policy(from, &vec![0.0; self.dynamics.len()])).ok()?;
        let scale = optimum.v.iter().chain(rewards).fold(0.0f64, |m, x| m.max(x.abs()));
        let row = &optimum.q[start * self.dynamics.n_actions()..][..self.dynamics.n_actions()];
        let mut order: Vec<Action> = (0..row.len()).collect();
        order.sort_by(|&a, &b| row[b].total_cmp(&row[a]));
        let second = order.get(1).map_or(f64::NEG_INFINITY, |&a| row[a]);
        (row[order[0]] - second > 1e-8 * scale).then_some(order[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::specimens::{
        lake, model, potential_rewards, random_model, rewards, symmetric,
    };
    use crate::learn::planning::{Over, Planner, PolicyIteration};
    use crate::mdp::streams::Stream;
    use serde_json::json;

    fn run(mdp: &FiniteMdp, f: &[f64], gamma: f64) -> Option<BrokenTask> {
        broken_task(mdp, &Dynamics::new(mdp, Over::Reachable), f, gamma).unwrap()
    }

    /// The task as a model of its own, solved apart from how it was made.
    fn breaks(mdp: &FiniteMdp, f: &[f64], gamma: f64, task: &BrokenTask) {
        let mut at = 0;
        let mut with = |shaping: f64| {
            at = 0;
            let rewards = mdp.with_rewards(|s, a, _| {
                at += 1;
                let native = match (s == task.start, a) {
                    (true, a) if a == task.paid => task.reward,
                    (true, a) if a == task.tempting => 0.0,
                    (false, a) if a == task.policy[s] => 0.0,
                    _ => -task.fine,
                };
                native + shaping * f[at - 1]
            });
            let v0 = vec![0.0; mdp.n_states()];
            let solution = PolicyIteration { gamma }.solve(&rewards, &v0).unwrap();
            solution.q.row(task.start).to_vec()
        };
        let (plain, shaped) = (with(0.0), with(1.0));
        let best = |row: &[f64]| (0..row.len()).max_by(|&a, &b| row[a].total_cmp(&row[b])).unwrap();
        assert_eq!((best(&plain), best(&shaped)), (task.paid, task.tempting));
        let ahead = plain[task.paid] - plain[task.tempting];
        assert!(ahead > 0.0 && shaped[task.tempting] > shaped[task.paid], "{plain:?} {shaped:?}");
        // `paid` is played at every visit, and worth D/2 together.
        assert!((plain[task.paid] - task.margin).abs() < 1e-9 * plain[task.paid].max(1.0));
    }

    #[test]
    fn every_random_shaping_breaks_some_task() {
        let mut stream = Stream::new(1, "necessity");
        let mut found = 0;
        while found < 100 {
            let n = 2 + stream.below(12);
            let mdp = random_model(&mut stream, n, 0.1);
            if mdp.n_actions() == 1 {
                continue;
            }
            let f = rewards(&mdp, |_, _, _| symmetric(&mut stream));
            let gamma = [0.5, 0.9, 0.99][found % 3];
            breaks(&mdp, &f, gamma, &run(&mdp, &f, gamma).unwrap());
            found += 1;
        }
    }

    #[test]
    fn a_potential_breaks_none() {
        let mut stream = Stream::new(2, "necessity");
        for _ in 0..50 {
            let mdp = random_model(&mut stream, 10, 0.1);
            let phi: Vec<f64> = (0..10).map(|_| symmetric(&mut stream)).collect();
            assert_eq!(run(&mdp, &potential_rewards(&mdp, 0.9, &phi), 0.9), None);
        }
    }

    #[test]
    fn harmless_here_is_not_harmless_everywhere() {
        // A cost per step leaves the dry lake's optimal policies as they are.
        let mdp = lake(false);
        let cost = rewards(&mdp, |_, _, _| -0.01);
        for gamma in [0.99, 1.0] {
            breaks(&mdp, &cost, gamma, &run(&mdp, &cost, gamma).unwrap());
        }
        let taxi = model("Taxi-v4", &json!({}));
        let pickup = rewards(&taxi, |_, a, o| if a == 4 && o.reward == -1.0 { 2.0 } else { 0.0 });
        breaks(&taxi, &pickup, 0.99, &run(&taxi, &pickup, 0.99).unwrap());
        // Undiscounted, setting down and picking up again is worth infinitely much.
        assert_eq!(run(&taxi, &pickup, 1.0), None);
    }
}
