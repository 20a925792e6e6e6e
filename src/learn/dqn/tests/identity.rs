//! Shaping by a potential is the same as starting from it (Wiewiora 2003), for networks: what is
//! learned from `r + γ Φ(s′) − Φ(s)` with `Q = f` is what is learned from `r` with `Q = f + Φ(s)`,
//! Φ being frozen in the network that learns and in its target, and 0 where s′ is terminal. The
//! errors of both are the same number, hence the gradients and all weights.

use crate::learn::dqn::{bootstrap, td_error};
use crate::mdp::streams::Stream;
use crate::nn::{Activations, Adam, Gradient, Kernels, Loss, Mlp, Shape, blend};
use crate::shaping::ActionSet;

const GAMMA: f64 = 0.97;
const N: usize = 4;
const ROWS: usize = 8;
const ACTIONS: usize = 3;

struct Transition {
    s: [f64; N],
    a: usize,
    reward: f64,
    next: [f64; N],
    terminal: bool,
}

fn potential(s: &[f64]) -> f64 {
    3.0 * s[0] - 2.0 * s[1] * s[2] + 0.5
}

/// A state for an episode: what was lived through by chance.
fn experience() -> Vec<Transition> {
    let mut stream = Stream::new(1, "identity");
    let mut state = || [(); N].map(|()| 2.0 * stream.uniform() - 1.0);
    let states: Vec<[f64; N]> = (0..400).map(|_| state()).collect();
    let pairs = states.chunks(2).enumerate();
    pairs
        .map(|(i, pair)| Transition {
            s: pair[0],
            a: i % ACTIONS,
            reward: 2.0 * pair[0][3] + if i % 7 == 0 { 3.0 } else { 0.0 },
            next: pair[1],
            terminal: i % 11 == 0,
        })
        .collect()
}

/// Where the potential is.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// In the rewards, with this discount and this potential of terminal states.
    Rewards { gamma: f64, terminal: f64 },
    /// In the action values.
    Values,
}

#[derive(Debug, Clone, Copy)]
struct Case {
    place: Place,
    double: bool,
    loss: Loss,
    /// Whether rewards are clipped to ±1.
    clipped: bool,
    updates: usize,
}

/// The network after learning.
fn learned(case: Case, all: &[Transition]) -> Mlp<f64> {
    let kernels = Kernels::detect();
    let shape = Shape { n_inputs: N, hidden: vec![16, 16], n_actions: ACTIONS, dueling: false };
    let mut mlp = Mlp::<f64>::new(shape, &mut Stream::new(2, "identity"));
    let (mut target, mut adam) = (mlp.clone(), Adam::new(&mlp));
    let room = || Activations::new(&mlp, ROWS);
    let (mut at_s, mut at_next, mut target_at_next) = (room(), room(), room());
    let mut gradient = Gradient::new(&mlp, ROWS);
    let mut stream = Stream::new(3, "identity");
    let inside = |s: &[f64]| if matches!(case.place, Place::Values) { potential(s) } else { 0.0 };
    // f + Φ(s), for all actions.
    let lifted = |f: &[f64], s: &[f64]| [0, 1, 2].map(|a| f[a] + inside(s));
    for update in 0..case.updates {
        if update % 50 == 0 {
            blend(kernels, 1.0, &mlp, &mut target);
        }
        let batch: Vec<&Transition> = (0..ROWS).map(|_| &all[stream.below(all.len())]).collect();
        let s: Vec<f64> = batch.iter().flat_map(|t| t.s).collect();
        let next: Vec<f64> = batch.iter().flat_map(|t| t.next).collect();
        mlp.forward(kernels, &s, N, &mut at_s);
        mlp.forward(kernels, &next, N, &mut at_next);
        target.forward(kernels, &next, N, &mut target_at_next);
        for (row, t) in batch.iter().enumerate() {
            let mut reward = t.reward;
            if let Place::Rewards { gamma, terminal } = case.place {
                let after = if t.terminal { terminal } else { potential(&t.next) };
                reward += gamma * after - potential(&t.s);
            }
            if case.clipped {
                reward = reward.clamp(-1.0, 1.0);
            }
            let online = lifted(at_next.q(row), &t.next);
            let values = lifted(target_at_next.q(row), &t.next);
            let value = bootstrap(&values, case.double.then_some(&online), ActionSet::ALL);
            let discount = if t.terminal { 0.0 } else { GAMMA };
            let q = lifted(at_s.q(row), &t.s)[t.a];
            let (_, slope) = case.loss.of(td_error(q, reward, discount, value));
            gradient.set_row(row, t.a, slope / ROWS as f64);
        }
        gradient.backward(kernels, &mlp, (&s, N), &at_s);
        adam.step(kernels, 0.001, &gradient, &mut mlp);
    }
    mlp
}

fn gap(a: &Mlp<f64>, b: &Mlp<f64>) -> f64 {
    a.params().iter().zip(b.params()).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

fn greedy(mlp: &Mlp<f64>, all: &[Transition]) -> Vec<usize> {
    let mut out = Activations::new(mlp, 1);
    let choice = |t: &Transition| {
        mlp.forward(Kernels::detect(), &t.s, N, &mut out);
        crate::learn::dqn::best(out.q(0), ActionSet::ALL)
    };
    all.iter().map(choice).collect()
}

const RIGHT: Place = Place::Rewards { gamma: GAMMA, terminal: 0.0 };

/// Rounding is all that may tell them apart.
#[test]
fn shaping_is_starting_from_the_potential() {
    let all = experience();
    for (double, loss) in [
        (false, Loss::SquaredError),
        (false, Loss::Huber),
        (true, Loss::SquaredError),
        (true, Loss::Huber),
    ] {
        let case = Case { place: RIGHT, double, loss, clipped: false, updates: 4000 };
        let shaped = learned(case, &all);
        let started = learned(Case { place: Place::Values, ..case }, &all);
        let gap = gap(&shaped, &started);
        assert!(gap <= 1e-11, "double: {double}, {loss:?}: {gap:e}");
        // Adding Φ(s) to all values of a state changes no choice.
        assert_eq!(greedy(&shaped, &all), greedy(&started, &all));
    }
}

#[test]
fn shaping_that_is_wrong_is_something_else() {
    let all = experience();
    for clipped in [false, true] {
        let loss = Loss::SquaredError;
        let case = Case { place: Place::Values, double: true, loss, clipped, updates: 300 };
        let started = learned(case, &all);
        let right = gap(&started, &learned(Case { place: RIGHT, ..case }, &all));
        assert_eq!(right > 1e-3, clipped, "clipped: {clipped}: {right:e}");
        for place in [
            Place::Rewards { gamma: 0.9, terminal: 0.0 },
            Place::Rewards { gamma: GAMMA, terminal: 1.0 },
        ] {
            let gap = gap(&started, &learned(Case { place, ..case }, &all));
            assert!(gap > 1e-3, "{place:?}: {gap:e}");
        }
    }
}
