//! The agent: acts, keeps what happens, and learns from it.

use super::config::DqnConfig;
use super::log::{LogRow, Sums};
use super::n_steps::{Arrival, NSteps};
use super::replay::Replay;
use super::sum_tree::SumTree;
use super::update::{bootstrap, td_error};
use crate::learn::behaviour::{EpsilonGreedy, Explore};
use crate::learn::greedy::pick_allowed;
use crate::learn::{Agent, Last, Learn, QTable, ScheduleState, Seen};
use crate::mdp::Action;
use crate::mdp::math::pow;
use crate::mdp::streams::Stream;
use crate::nn::{Activations, Adam, Buffer, Gradient, Kernels, Mlp, Shape, blend};
use crate::shaping::{ActionSet, Fields, Inputs};

/// What a network agent is built for.
#[derive(Debug)]
pub struct NetworkSetup {
    /// What it sees of a state.
    pub inputs: Inputs,
    /// Number of actions.
    pub n_actions: usize,
    /// Whether a shield may refuse actions.
    pub shielded: bool,
    /// The run's seed.
    pub seed: u64,
    /// The network to start from, in place of a random one.
    pub model: Option<Mlp<f32>>,
}

/// Deep Q-learning (Mnih et al. 2015), plain or double (van Hasselt, Guez & Silver 2016), with
/// dueling heads (Wang et al. 2016), n-step targets (Hessel et al. 2018) and prioritised replay
/// (Schaul et al. 2016) as options.
///
/// ```text
/// y = R + γ max_a Q⁻(S′, a)                  DQN; R alone if S′ is terminal
/// y = R + γ Q⁻(S′, argmax_a Q(S′, a))        Double DQN
/// w ← w − α ∇ mean loss(Q(S, A) − y)         by Adam, over a minibatch of past transitions
/// ```
///
/// Where the time limit cut an episode off, S′ is the last state and is bootstrapped from (Pardo et
/// al. 2018). The order of a step: it is kept, the target network is updated if that is due, the
/// network is trained if that is due, the next action is chosen.
#[derive(Debug, Clone)]
pub struct Dqn {
    pub(super) config: DqnConfig,
    inputs: Inputs,
    kernels: Kernels,
    pub(super) q: Mlp<f32>,
    pub(super) target: Mlp<f32>,
    pub(super) adam: Adam<f32>,
    pub(super) learning_rate: ScheduleState,
    pub(super) behaviour: EpsilonGreedy,
    /// Randomness of replay.
    pub(super) sampling: Stream,
    pub(super) replay: Replay,
    pub(super) tree: Option<(SumTree, ScheduleState)>,
    window: NSteps,
    batch: Batch,
    /// What is kept of S and S′, and the inputs of one of them.
    s: Vec<f32>,
    next: Vec<f32>,
    one: Buffer<f32>,
    a: Action,
    acting: Activations<f32>,
    row: Vec<f64>,
    pub(super) counts: Counts,
    pub(super) sums: Sums,
    pub(super) log: Vec<LogRow>,
    /// The value of the first state, the discounted return since, and the next reward's discount.
    start: [f64; 3],
}

/// How far it has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Counts {
    /// Steps made.
    pub(super) steps: u64,
    /// Gradient steps made.
    pub(super) updates: u64,
    /// Episodes ended.
    pub(super) episodes: u32,
    /// The step at which the loss was no longer finite; nothing was learned after it.
    pub(super) failed: Option<u64>,
}

/// Room for a minibatch.
#[derive(Debug, Clone)]
struct Batch {
    places: Vec<usize>,
    weights: Vec<f64>,
    /// Inputs, shape `[batch_size, n_inputs]`.
    x: Buffer<f32>,
    next: Buffer<f32>,
    at_x: Activations<f32>,
    at_next: Activations<f32>,
    target_at_next: Activations<f32>,
    gradient: Gradient<f32>,
    errors: Vec<f32>,
}

impl Dqn {
    /// Before its first step.
    ///
    /// # Panics
    /// If `setup.model` has another shape than the configuration asks for.
    pub fn new(config: DqnConfig, setup: NetworkSetup) -> Self {
        let NetworkSetup { inputs, n_actions, shielded, seed, model } = setup;
        let shape = Shape {
            n_inputs: inputs.n_inputs(),
            hidden: config.net_arch.clone(),
            n_actions,
            dueling: config.dueling,
        };
        let q = match model {
            None => Mlp::new(shape, &mut Stream::new(seed, "network")),
            Some(model) => {
                assert_eq!(*model.shape(), shape, "another network");
                model
            }
        };
        let (rows, n_inputs, n_kept) = (config.batch_size, inputs.n_inputs(), inputs.n_kept());
        let activations = |rows| Activations::new(&q, rows);
        let batch = Batch {
            places: vec![0; rows],
            weights: vec![1.0; rows],
            x: Buffer::zeros(rows * n_inputs),
            next: Buffer::zeros(rows * n_inputs),
            at_x: activations(rows),
            at_next: activations(rows),
            target_at_next: activations(rows),
            gradient: Gradient::new(&q, rows),
            errors: vec![0.0; rows],
        };
        let tree = config
            .priorities
            .map(|p| (SumTree::new(config.buffer_size), ScheduleState::new(p.beta)));
        Self {
            kernels: Kernels::detect(),
            target: q.clone(),
            adam: Adam::new(&q),
            learning_rate: ScheduleState::new(config.learning_rate),
            behaviour: EpsilonGreedy::new(config.epsilon, Stream::new(seed, "agent")),
            sampling: Stream::new(seed, "replay"),
            replay: Replay::new(config.buffer_size, n_kept, if shielded { n_actions } else { 0 }),
            tree,
            window: NSteps::new(config.n_steps, config.gamma, n_kept),
            batch,
            s: vec![0.0; n_kept],
            next: vec![0.0; n_kept],
            one: Buffer::zeros(n_inputs),
            a: 0,
            acting: activations(1),
            row: vec![0.0; n_actions],
            counts: Counts::default(),
            sums: Sums::default(),
            log: Vec::new(),
            start: [0.0; 3],
            q,
            inputs,
            config,
        }
    }

    /// The same, computed by `kernels`: no result changes.
    #[must_use]
    pub fn with_kernels(self, kernels: Kernels) -> Self {
        Self { kernels, ..self }
    }

    /// The network that learns.
    pub fn network(&self) -> &Mlp<f32> {
        &self.q
    }

    /// What was written down every `log_interval` steps.
    pub fn log(&self) -> &[LogRow] {
        &self.log
    }

    /// The step, counted from 1, at which the loss was no longer finite. Nothing was learned from
    /// then on.
    pub fn failed_at(&self) -> Option<u64> {
        self.counts.failed
    }

    /// The value that the best action was believed to have in the first state of the last episode,
    /// and the discounted return that the episode then brought.
    pub fn last_start(&self) -> (f64, f64) {
        (self.start[0], self.start[1])
    }

    /// Steps made.
    pub fn steps(&self) -> u64 {
        self.counts.steps
    }

    /// Gradient steps made.
    pub fn updates(&self) -> u64 {
        self.counts.updates
    }

    /// Chooses an action in the state of which `self.s` is kept.
    #[inline]
    fn choose(&mut self, s: Fields) -> Action {
        self.inputs.expand(&self.s, &mut self.one);
        self.q.forward(self.kernels, &self.one, self.one.len(), &mut self.acting);
        for (value, q) in self.row.iter_mut().zip(self.acting.q(0)) {
            *value = f64::from(*q);
        }
        let a = self.behaviour.choose(&self.row, s);
        if self.counts.steps < self.config.learning_starts {
            return pick_allowed(self.row.len(), s, self.sampling.uniform());
        }
        a
    }

    /// Keeps what the last action brought, and learns if that is due. `next` is where it led.
    #[inline]
    fn experience(&mut self, reward: f64, next: Option<Fields>, ended: bool) {
        let [_, sum, discount] = &mut self.start;
        *sum += *discount * reward;
        *discount *= self.config.gamma;
        match &next {
            Some(next) => self.inputs.keep(next, &mut self.next),
            // Whatever was there would do, but not be the same after training was interrupted.
            None => self.next.fill(0.0),
        }
        let arrival = Arrival {
            kept: &self.next,
            allowed: next.map_or(ActionSet::ALL, |next| next.allowed()),
            terminated: next.is_none(),
        };
        let Self { window, replay, tree, .. } = self;
        window.step(&self.s, self.a, reward, arrival, ended, |e| {
            let place = replay.push(e);
            if let Some((tree, _)) = tree {
                tree.set(place, tree.largest());
            }
        });
        self.counts.steps += 1;
        let c = &self.config;
        if self.counts.steps.is_multiple_of(c.target_update_interval) {
            blend(self.kernels, c.tau, &self.q, &mut self.target);
        }
        let starts = self.replay.len() >= c.batch_size && self.counts.steps > c.learning_starts;
        if starts && self.counts.steps.is_multiple_of(c.train_freq) {
            for _ in 0..c.gradient_steps {
                if self.counts.failed.is_none() {
                    self.train();
                }
            }
        }
        self.learning_rate.step();
        if let Some((_, beta)) = &mut self.tree {
            beta.step();
        }
        if self.counts.steps.is_multiple_of(self.config.log_interval) {
            self.write_down();
        }
    }

    /// One gradient step on one minibatch.
    fn train(&mut self) {
        self.draw();
        let Self { batch: b, q, target, kernels, inputs, replay, config, .. } = self;
        let n = inputs.n_inputs();
        for (i, &place) in b.places.iter().enumerate() {
            let e = replay.get(place);
            inputs.expand(e.s, &mut b.x[i * n..][..n]);
            inputs.expand(e.next, &mut b.next[i * n..][..n]);
        }
        target.forward(*kernels, &b.next, n, &mut b.target_at_next);
        if config.double {
            q.forward(*kernels, &b.next, n, &mut b.at_next);
        }
        q.forward(*kernels, &b.x, n, &mut b.at_x);
        let (mut loss, mut values, mut errors) = (0.0, 0.0, 0.0);
        let share = 1.0 / b.places.len() as f64;
        for (i, &place) in b.places.iter().enumerate() {
            let e = replay.get(place);
            let online = config.double.then(|| b.at_next.q(i));
            let value = bootstrap(b.target_at_next.q(i), online, e.allowed);
            let q = b.at_x.q(i)[e.a];
            let error = td_error(q, e.reward, e.discount, value);
            let (l, slope) = config.loss.of(error);
            b.gradient.set_row(i, e.a, slope * (b.weights[i] * share) as f32);
            b.errors[i] = error;
            loss += b.weights[i] * f64::from(l);
            values += f64::from(q);
            errors += f64::from(error.abs());
        }
        if !loss.is_finite() {
            self.counts.failed = Some(self.counts.steps);
            return;
        }
        b.gradient.backward(*kernels, q, (&b.x, n), &b.at_x);
        if let Some(max) = config.max_grad_norm {
            b.gradient.clip(*kernels, max);
        }
        self.adam.step(*kernels, self.learning_rate.value(), &b.gradient, q);
        if let (Some((tree, _)), Some(p)) = (&mut self.tree, config.priorities) {
            for (&place, error) in b.places.iter().zip(&b.errors) {
                tree.set(place, pow(f64::from(error.abs()) + p.eps, p.alpha));
            }
        }
        self.counts.updates += 1;
        self.sums.loss += loss * share;
        self.sums.q += values * share;
        self.sums.td_error += errors * share;
        self.sums.batches += 1;
    }

    /// Draws a minibatch and the weights of what is in it.
    fn draw(&mut self) {
        let Self { batch: b, replay, sampling, config, .. } = self;
        let Some((tree, beta)) = &self.tree else {
            if config.replace {
                replay.draw(sampling, &mut b.places);
            } else {
                replay.draw_distinct(sampling, &mut b.places);
            }
            return;
        };
        // One transition out of each of as many equal shares of the priorities as the minibatch has
        // places (Schaul et al. 2016, section 3.3).
        let share = tree.total() / b.places.len() as f64;
        let len = replay.len();
        let mut largest = 0.0f64;
        for (i, (place, weight)) in b.places.iter_mut().zip(&mut b.weights).enumerate() {
            *place = tree.find((i as f64 + sampling.uniform()) * share, len);
            let p = tree.get(*place) / tree.total();
            *weight = pow(len as f64 * p, -beta.value());
            largest = largest.max(*weight);
        }
        for weight in &mut b.weights {
            *weight /= largest;
        }
    }

    fn write_down(&mut self) {
        let [loss, q, td_error, start_value, start_return] = self.sums.take();
        self.log.push(LogRow {
            step: self.counts.steps,
            episode: self.counts.episodes + 1,
            updates: self.counts.updates,
            loss,
            q,
            td_error,
            epsilon: self.behaviour.epsilon(),
            learning_rate: self.learning_rate.value(),
            buffer: self.replay.len() as u64,
            start_value,
            start_return,
        });
    }
}

impl Agent for Dqn {
    fn gamma(&self) -> f64 {
        self.config.gamma
    }

    fn bootstraps_when_truncated(&self) -> bool {
        true
    }

    fn epsilon(&self) -> f64 {
        self.behaviour.epsilon()
    }

    fn q(&self) -> Option<&QTable> {
        None
    }

    fn dqn(&self) -> Option<&Dqn> {
        Some(self)
    }
}

impl Learn<Fields> for Dqn {
    fn begin(&mut self, s: Fields) -> Action {
        self.inputs.keep(&s, &mut self.s);
        self.a = self.choose(s);
        let best = self.row.iter().enumerate().filter(|(a, _)| s.allows(*a)).map(|(_, q)| *q);
        self.start = [best.fold(f64::NEG_INFINITY, f64::max), 0.0, 1.0];
        self.a
    }

    fn step(&mut self, reward: f64, next: Fields) -> Action {
        self.experience(reward, Some(next), false);
        std::mem::swap(&mut self.s, &mut self.next);
        self.a = self.choose(next);
        self.a
    }

    fn end(&mut self, reward: f64, last: Last<Fields>) {
        let next = match last {
            Last::Terminated => None,
            Last::Truncated(next) => Some(next),
        };
        self.experience(reward, next, true);
        let [value, sum, _] = self.start;
        self.sums.start_value += value;
        self.sums.start_return += sum;
        self.sums.episodes += 1;
        self.counts.episodes += 1;
        self.behaviour.end_episode();
        self.learning_rate.end_episode();
        if let Some((_, beta)) = &mut self.tree {
            beta.end_episode();
        }
    }
}
