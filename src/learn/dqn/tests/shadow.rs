//! The agent against one that keeps everything in lists and follows its documentation step by step:
//! the same weights to the last bit, with any options.

use super::{Chance, N_ACTIONS, N_FIELDS, Step, config, setup};
use crate::learn::dqn::{Dqn, DqnConfig, Priorities, SumTree};
use crate::learn::{Schedule, ScheduleState, Unit};
use crate::mdp::math::pow;
use crate::mdp::streams::Stream;
use crate::nn::{Activations, Adam, Gradient, Kernels, Loss, Mlp, blend};
use crate::shaping::ActionSet;

struct Kept {
    s: Vec<f32>,
    a: usize,
    reward: f32,
    discount: f32,
    /// Nothing is looked at if it is terminal.
    next: Option<(Vec<f32>, ActionSet)>,
    /// For prioritised replay.
    priority: f64,
}

/// What an agent should have learned.
struct Shadow {
    config: DqnConfig,
    q: Mlp<f32>,
    target: Mlp<f32>,
    adam: Adam<f32>,
    /// The last `buffer_size` transitions are remembered; place `i % buffer_size` is that of
    /// transition `i`.
    kept: Vec<Kept>,
    episode: Vec<Step>,
    stream: Stream,
    beta: Option<ScheduleState>,
    learning_rate: ScheduleState,
    largest: f64,
    steps: u64,
    updates: u64,
}

fn shown(s: &crate::shaping::Fields) -> Vec<f32> {
    s.values[..N_FIELDS].iter().map(|x| *x as f32).collect()
}

/// The action values of one state.
fn values(q: &Mlp<f32>, s: &[f32]) -> Vec<f32> {
    let mut out = Activations::new(q, 1);
    q.forward(Kernels::detect(), s, s.len(), &mut out);
    out.q(0).to_vec()
}

impl Shadow {
    fn new(agent: &Dqn, seed: u64) -> Self {
        let config = agent.config.clone();
        Self {
            q: agent.q.clone(),
            target: agent.q.clone(),
            adam: Adam::new(&agent.q),
            kept: Vec::new(),
            episode: Vec::new(),
            stream: Stream::new(seed, "replay"),
            beta: config.priorities.map(|p| ScheduleState::new(p.beta)),
            learning_rate: ScheduleState::new(config.learning_rate),
            largest: 1.0,
            steps: 0,
            updates: 0,
            config,
        }
    }

    /// The transition from step `i` of the episode over `n` rewards, or those that are left.
    fn transition(&self, i: usize) -> Kept {
        let last = (i + self.config.n_steps).min(self.episode.len()) - 1;
        let (mut reward, mut discount) = (0.0, 1.0);
        for step in &self.episode[i..=last] {
            reward += discount * step.reward;
            discount *= self.config.gamma;
        }
        let next = self.episode[last].next.map(|next| (shown(&next), next.allowed));
        let Step { s, a, .. } = self.episode[i];
        let discount = if next.is_some() { discount as f32 } else { 0.0 };
        let priority = self.largest;
        Kept { s: shown(&s), a, reward: reward as f32, discount, next, priority }
    }

    fn see(&mut self, step: &Step) {
        if self.steps < self.config.learning_starts {
            // The random action.
            self.stream.uniform();
        }
        self.episode.push(*step);
        let n = self.config.n_steps;
        let begun = self.episode.len();
        // What began n steps ago is complete; at the end everything is.
        let first = begun.saturating_sub(n);
        let complete =
            if step.ended { first..begun } else { first..first + usize::from(begun >= n) };
        for i in complete {
            let kept = self.transition(i);
            self.kept.push(kept);
        }
        self.steps += 1;
        let c = self.config.clone();
        if self.steps.is_multiple_of(c.target_update_interval) {
            blend(Kernels::detect(), c.tau, &self.q, &mut self.target);
        }
        let held = self.kept.len().min(c.buffer_size);
        if held >= c.batch_size
            && self.steps > c.learning_starts
            && self.steps.is_multiple_of(c.train_freq)
        {
            for _ in 0..c.gradient_steps {
                self.train();
            }
        }
        self.learning_rate.step();
        if let Some(beta) = &mut self.beta {
            beta.step();
        }
        if step.ended {
            self.episode.clear();
            self.learning_rate.end_episode();
            if let Some(beta) = &mut self.beta {
                beta.end_episode();
            }
        }
    }

    /// The number of the transition that is at `place` now.
    fn at(&self, place: usize) -> usize {
        let size = self.config.buffer_size;
        (0..self.kept.len()).rev().find(|i| i % size == place).unwrap()
    }

    /// The transitions of a minibatch, each with its weight.
    fn draw(&mut self) -> Vec<(usize, f64)> {
        let c = self.config.clone();
        let held = self.kept.len().min(c.buffer_size);
        let mut places: Vec<usize> = Vec::new();
        let Some(p) = c.priorities else {
            while places.len() < c.batch_size {
                let place = self.stream.below(held);
                if c.replace || !places.contains(&place) {
                    places.push(place);
                }
            }
            return places.iter().map(|place| (self.at(*place), 1.0)).collect();
        };
        // The sums as the tree makes them; that it draws as it should is another test.
        let mut tree = SumTree::new(c.buffer_size);
        for place in 0..held {
            tree.set(place, self.kept[self.at(place)].priority);
        }
        let beta = self.beta.as_ref().unwrap().value();
        let mut drawn = Vec::new();
        for i in 0..c.batch_size {
            let mass = (i as f64 + self.stream.uniform()) * (tree.total() / c.batch_size as f64);
            let place = tree.find(mass, held);
            let probability = tree.get(place) / tree.total();
            assert!(p.eps > 0.0 && probability > 0.0);
            drawn.push((self.at(place), pow(held as f64 * probability, -beta)));
        }
        let most = drawn.iter().fold(0.0f64, |m, (_, w)| m.max(*w));
        for (_, weight) in &mut drawn {
            *weight /= most;
        }
        drawn
    }

    fn train(&mut self) {
        let drawn = self.draw();
        let c = self.config.clone();
        let kernels = Kernels::detect();
        let rows = drawn.len();
        let x: Vec<f32> = drawn.iter().flat_map(|(i, _)| self.kept[*i].s.clone()).collect();
        let mut activations = Activations::new(&self.q, rows);
        let mut gradient = Gradient::new(&self.q, rows);
        self.q.forward(kernels, &x, N_FIELDS, &mut activations);
        let mut errors = Vec::new();
        for (row, &(i, weight)) in drawn.iter().enumerate() {
            let e = &self.kept[i];
            let mut y = e.reward;
            if let Some((next, allowed)) = &e.next {
                let target = values(&self.target, next);
                let chooser = if c.double { values(&self.q, next) } else { target.clone() };
                let allowed = (0..N_ACTIONS).filter(|a| allowed.contains(*a));
                let largest = allowed.clone().map(|a| chooser[a]).fold(f32::MIN, f32::max);
                let a = allowed.clone().find(|a| chooser[*a] == largest).unwrap();
                y = e.discount.mul_add(target[a], e.reward);
            }
            let error = activations.q(row)[e.a] - y;
            errors.push(error);
            let slope = match c.loss {
                Loss::SquaredError => 2.0 * error,
                Loss::Huber => error.clamp(-1.0, 1.0),
            };
            gradient.set_row(row, e.a, slope * (weight * (1.0 / rows as f64)) as f32);
        }
        gradient.backward(kernels, &self.q, (&x, N_FIELDS), &activations);
        if let Some(max) = c.max_grad_norm {
            gradient.clip(kernels, max);
        }
        self.adam.step(kernels, self.learning_rate.value(), &gradient, &mut self.q);
        if let Some(p) = c.priorities {
            for ((i, _), error) in drawn.iter().zip(errors) {
                let priority = pow(f64::from(error.abs()) + p.eps, p.alpha);
                self.kept[*i].priority = priority;
                self.largest = self.largest.max(priority);
            }
        }
        self.updates += 1;
    }
}

/// Configurations that have every option on and off.
pub(super) fn configs() -> Vec<DqnConfig> {
    let line = |start, end, over, unit| Schedule::Linear { start, end, over, unit };
    let priorities = Priorities { alpha: 0.6, beta: line(0.4, 1.0, 150, Unit::Step), eps: 1e-3 };
    let double = DqnConfig { double: true, ..config() };
    let huber = DqnConfig { loss: Loss::Huber, ..config() };
    let everything = DqnConfig {
        double: true,
        dueling: true,
        n_steps: 3,
        priorities: Some(priorities),
        learning_rate: line(0.02, 0.001, 150, Unit::Step),
        max_grad_norm: Some(0.1),
        learning_starts: 25,
        tau: 0.05,
        target_update_interval: 1,
        loss: Loss::Huber,
        ..config()
    };
    vec![
        config(),
        double.clone(),
        huber,
        DqnConfig { dueling: true, replace: true, ..double },
        DqnConfig { n_steps: 3, ..config() },
        DqnConfig { n_steps: 20, batch_size: 3, ..config() },
        DqnConfig { max_grad_norm: Some(0.05), tau: 0.3, target_update_interval: 3, ..config() },
        DqnConfig { train_freq: 4, gradient_steps: 3, learning_starts: 50, ..config() },
        DqnConfig { learning_rate: line(0.02, 0.001, 20, Unit::Episode), ..config() },
        DqnConfig { priorities: Some(priorities), ..config() },
        everything,
    ]
}

#[test]
fn the_agent_learns_what_its_documentation_says() {
    for shielded in [false, true] {
        for config in configs() {
            let mut agent = Dqn::new(config.clone(), setup(shielded, 9));
            let mut shadow = Shadow::new(&agent, 9);
            let mut world = Chance::new(shielded);
            while shadow.steps < 200 {
                world.episode(&mut agent, |step, agent| {
                    shadow.see(step);
                    assert!(step.s.allowed.contains(step.a), "a refused action is played");
                    assert_eq!(agent.updates(), shadow.updates, "{config:?}");
                    let at = shadow.steps;
                    assert!(agent.q == shadow.q, "the network, step {at}, {config:?}");
                    assert!(agent.target == shadow.target, "the target, step {at}, {config:?}");
                });
            }
            assert!(agent.updates() > 30, "{config:?}");
        }
    }
}
