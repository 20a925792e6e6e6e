//! Whether a shaping term is a difference of potentials on all pairs of states, asked directly.
//!
//! `F(x, y) = γΦ(y) − Φ(x)` for some Φ if and only if, for all states x, y, w, z,
//!
//! `F(x, y) + γ F(y, z) = F(x, w) + γ F(w, z)`,
//!
//! and, if γ = 1, also `F(z, z) = 0`. For with z fixed and `B(y) = F(y, z)` the left side is some
//! A(x), so that `F(x, y) = A(x) − γB(y)`; put into the identity, that makes A − B a constant c, and
//! `F(x, y) = B(x) − γB(y) + c`. For γ < 1 a constant added to Φ = −B takes c up; for γ = 1 it must
//! be 0. Where an episode can end, Φ must be 0 beyond the end, ⊥: `F(x, y) + γ F(y, ⊥) = F(x, ⊥)`.
//!
//! States are drawn uniformly from a box, pairs of them without regard to whether one can follow
//! another. So a violation shows that F is not potential-based *as a function*; transitions that
//! happen may all be paid right. Agreement bounds, with a confidence of 95 %, the share of the
//! quadruples under this law that violate it ([`rule_of_three`](super::rule_of_three)).

use serde::Serialize;

use super::pathwise::{finite, rule_of_three};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::streams::Stream;
use crate::mdp::{Action, Env, MAX_FIELDS};
use crate::shaping::{Fault, Transition};

/// States that are drawn before a box is given up: where none of them is one to be in.
const TRIES: usize = 10_000;

/// What [`query`] asks.
#[derive(Debug, Clone, PartialEq)]
pub struct QuerySettings {
    /// The learner's discount factor γ.
    pub gamma: f64,
    /// Number of quadruples.
    pub quadruples: usize,
    /// The range of each of the state's fields, finite: what states are drawn from.
    pub ranges: Vec<[f64; 2]>,
    /// Whether an episode can end in a terminal state.
    pub terminates: bool,
    /// The seed of everything that is drawn.
    pub seed: u64,
}

/// What came of [`query`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Query {
    /// Number of quadruples: the N of [`Self::bound`].
    pub quadruples: usize,
    /// How many of them violate the identity.
    pub violations: usize,
    /// The largest |F|.
    pub scale: f64,
    /// The largest difference of the two sides.
    pub difference: f64,
    /// What rounding can explain.
    pub tolerance: f64,
    /// The clearest violation.
    pub witness: Option<Witness>,
}

impl Query {
    /// With a confidence of 95 %, the largest that the share of violating quadruples can be under
    /// this law, if none was found.
    pub fn bound(&self) -> Option<f64> {
        (self.violations == 0).then(|| rule_of_three(self.quadruples))
    }
}

/// Two ways that should have been paid the same.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Witness {
    /// The one way and the other.
    pub ways: [Vec<Leg>; 2],
    /// `Σ γᵏ F` of each.
    pub sums: [f64; 2],
}

/// One pair of states.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leg {
    /// The fields of the first state.
    pub from: Vec<f64>,
    /// The action that was named.
    pub action: Action,
    /// The fields of the second state.
    pub to: Vec<f64>,
    /// Whether the second state was called terminal.
    pub terminated: bool,
    /// What F is.
    pub f: f64,
}

/// A state to ask about.
#[derive(Clone, Copy)]
struct Asked<O> {
    obs: O,
    action: Action,
    /// What a step from there by `action` pays natively.
    reward: f64,
}

/// Asks `f` (the reward learned from less the native one, the potential's part included) about
/// random pairs of states; `None` if `env` cannot be put into states of the box
/// ([`Env::set_state`]). Actions are random; the native reward is that of a real step from the first
/// state of a pair by its action; `t.step` is 0.
///
/// # Errors
/// If `f` fails or is not finite.
pub fn query<E, F>(env: &E, settings: &QuerySettings, f: F) -> Result<Option<Query>, Fault>
where
    E: Env + Clone,
    F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
{
    let stream = Stream::new(settings.seed, "audit query");
    let rng = NumpyRng::from_u64(settings.seed);
    let mut asker = Asker { env: env.clone(), settings, f, stream, rng };
    asker.env.reset(&mut asker.rng);
    let gamma = settings.gamma;
    let (mut differences, mut scale, mut native) = (Vec::new(), 0.0f64, 0.0f64);
    let mut clearest: (f64, Option<Witness>) = (0.0, None);
    for _ in 0..settings.quadruples {
        let Some(states) = asker.states() else { return Ok(None) };
        let [x, y, z, w] = &states;
        let mut ways =
            vec![[vec![(x, y, false), (y, z, false)], vec![(x, w, false), (w, z, false)]]];
        if settings.terminates {
            ways.push([vec![(x, y, false), (y, z, true)], vec![(x, w, true)]]);
        }
        if gamma >= 1.0 {
            ways.push([vec![(z, z, false)], vec![]]);
        }
        let mut difference = 0.0f64;
        for [one, other] in ways {
            let (one, other) = (asker.way(&one)?, asker.way(&other)?);
            let sums = [&one, &other]
                .map(|way| way.iter().rev().fold(0.0, |sum, leg| leg.f + gamma * sum));
            let largest = one.iter().chain(&other).fold(0.0f64, |m, leg| m.max(leg.f.abs()));
            scale = scale.max(largest);
            let apart = (sums[0] - sums[1]).abs();
            difference = difference.max(apart);
            if apart > clearest.0 {
                clearest = (apart, Some(Witness { ways: [one, other], sums }));
            }
        }
        native = states.iter().fold(native, |m, s| m.max(s.reward.abs()));
        differences.push(difference);
    }
    // Rewards are rounded when F is added to them.
    let tolerance = 1e-9 * scale + 16.0 * f64::EPSILON * native;
    Ok(Some(Query {
        quadruples: settings.quadruples,
        violations: differences.iter().filter(|&&d| d > tolerance).count(),
        scale,
        difference: clearest.0,
        tolerance,
        witness: clearest.1.filter(|_| clearest.0 > tolerance),
    }))
}

struct Asker<'a, E, F> {
    env: E,
    settings: &'a QuerySettings,
    f: F,
    stream: Stream,
    rng: NumpyRng,
}

/// A pair of states, and whether the second one is to be terminal.
type Pair<'a, O> = (&'a Asked<O>, &'a Asked<O>, bool);

impl<E, F> Asker<'_, E, F>
where
    E: Env,
    F: FnMut(&E, &Transition<'_, E::Obs>) -> Result<f64, Fault>,
{
    /// Four states.
    fn states(&mut self) -> Option<[Asked<E::Obs>; 4]> {
        let first = self.state()?;
        let mut states = [first; 4];
        for state in &mut states[1..] {
            *state = self.state()?;
        }
        Some(states)
    }

    /// A state of the box, if there are any.
    fn state(&mut self) -> Option<Asked<E::Obs>> {
        let mut fields = vec![0.0; self.settings.ranges.len()];
        for _ in 0..TRIES {
            for (x, &[low, high]) in fields.iter_mut().zip(&self.settings.ranges) {
                *x = low + (high - low) * self.stream.uniform();
            }
            if let Some(obs) = self.env.set_state(&fields) {
                let action = self.stream.below(self.env.n_actions());
                let reward = self.env.step(action, &mut self.rng).reward;
                return Some(Asked { obs, action, reward });
            }
        }
        None
    }

    fn way(&mut self, pairs: &[Pair<'_, E::Obs>]) -> Result<Vec<Leg>, Fault> {
        pairs.iter().map(|pair| self.leg(pair)).collect()
    }

    fn leg(&mut self, &(from, to, terminated): &Pair<'_, E::Obs>) -> Result<Leg, Fault> {
        let t = Transition {
            state: &from.obs,
            action: from.action,
            reward: from.reward,
            next_state: &to.obs,
            terminated,
            truncated: false,
            step: 0,
        };
        let f = finite((self.f)(&self.env, &t)?)?;
        let fields = |obs: &E::Obs| {
            let mut fields = [0.0; MAX_FIELDS];
            self.env.fields(obs, &mut fields);
            fields[..self.settings.ranges.len()].to_vec()
        };
        let (action, from, to) = (from.action, fields(&from.obs), fields(&to.obs));
        Ok(Leg { from, action, to, terminated, f })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::env::lunar_lander::{LunarLander, Mission};
    use crate::env::mountain_car::MountainCar;
    use crate::env::pendulum::Pendulum;
    use crate::shaping::potential_term;

    type CarStep<'a> = Transition<'a, [f32; 2]>;

    fn settings(gamma: f64) -> QuerySettings {
        let ranges = vec![[-1.2, 0.6], [-0.07, 0.07]];
        QuerySettings { gamma, quadruples: 2_000, ranges, terminates: true, seed: 0 }
    }

    fn car(settings: &QuerySettings, f: impl Fn(&CarStep<'_>) -> f64) -> Query {
        query(&MountainCar::new(0.0), settings, |_, t| Ok(f(t))).unwrap().unwrap()
    }

    fn phi([position, velocity]: [f32; 2]) -> f64 {
        40.0 * f64::from(velocity).abs() + f64::from(position)
    }

    fn proper(gamma: f64, t: &CarStep<'_>) -> f64 {
        potential_term(gamma, phi(*t.state), if t.terminated { 0.0 } else { phi(*t.next_state) })
    }

    #[test]
    fn a_potential_passes_and_the_claim_is_a_bound() {
        for gamma in [0.0, 0.99, 1.0] {
            for size in [1e-9, 1.0, 1e9] {
                let result = car(&settings(gamma), |t| size * proper(gamma, t));
                assert_eq!((result.violations, result.witness.as_ref()), (0, None), "{gamma}");
                assert!(result.difference <= 1e-13 * result.scale);
                assert_eq!(result.bound(), Some(0.0015));
            }
        }
    }

    #[test]
    fn what_is_no_potential_fails_and_the_witness_holds() {
        let terms: [&dyn Fn(&CarStep<'_>) -> f64; 6] = [
            &|t| proper(1.0, t),
            &|t| potential_term(0.99, phi(*t.state), phi(*t.next_state)),
            &|t| if t.action == 1 { 0.0 } else { -0.001 },
            &|t| if t.terminated { 250.0 } else { 0.0 },
            &|_| -0.01,
            // Twice the native reward.
            &|t| t.reward,
        ];
        for (i, f) in terms.iter().enumerate() {
            let result = car(&settings(0.99), f);
            assert!(result.violations > 500 && result.bound().is_none(), "{i}: {result:?}");
            let witness = result.witness.unwrap();
            for (way, sum) in witness.ways.iter().zip(witness.sums) {
                assert_eq!(way.iter().rev().fold(0.0, |sum, leg| leg.f + 0.99 * sum), sum);
            }
            // Both ways lead from the same state to the same one.
            let ends = witness.ways.each_ref().map(|way| {
                let last = way.last().unwrap();
                let to = if last.terminated { None } else { Some(last.to.clone()) };
                (way[0].from.clone(), to)
            });
            assert_eq!(ends[0], ends[1], "{i}");
            assert!((witness.sums[0] - witness.sums[1]).abs() > result.tolerance, "{i}");
        }
    }

    #[test]
    fn a_constant_is_a_potential_unless_episodes_end_or_gamma_is_one() {
        let endless = |gamma| QuerySettings { terminates: false, ..settings(gamma) };
        assert_eq!(car(&endless(0.99), |_| 0.5).violations, 0);
        assert_eq!(car(&endless(1.0), |_| 0.5).violations, 2_000);
        assert_eq!(car(&endless(1.0), |t| proper(1.0, t)).violations, 0);
    }

    #[test]
    fn a_bonus_for_entering_a_region_is_found_as_often_as_one_of_two_states_is_in_it() {
        // A share p of the box: 2 p (1 - p) of the quadruples.
        let settings = QuerySettings { terminates: false, quadruples: 20_000, ..settings(0.99) };
        let result =
            car(&settings, |t| if t.next_state[1] > 0.07 - 0.08 * 0.14 { 0.1 } else { 0.0 });
        let share = result.violations as f64 / 20_000.0;
        // Standard deviation 0.0025; the goal's states, which are not drawn, lower p a little.
        assert!((share - 0.147).abs() < 0.012, "{share}");
    }

    #[test]
    fn right_on_every_real_transition_is_not_right_as_a_function() {
        // |v| as a potential, but the new velocity read off the positions.
        let speed = |x: f32| 100.0 * f64::from(x).abs();
        let result = car(&settings(0.99), |t| {
            let [next, velocity] = [t.next_state[0] - t.state[0], t.state[1]];
            potential_term(0.99, speed(velocity), if t.terminated { 0.0 } else { speed(next) })
        });
        assert!(result.violations > 1_000);
    }

    #[test]
    fn only_states_to_be_in_are_asked_about() {
        let settings = QuerySettings {
            ranges: vec![[-1.0, 1.0], [-1.0, 1.0], [-8.0, 8.0]],
            terminates: false,
            quadruples: 200,
            ..settings(0.9)
        };
        let height = |obs: &[f32; 3]| f64::from(obs[0]);
        let swing = query(&Pendulum::new(10.0), &settings, |_, t| {
            let [cos, sin, _] = t.state.map(f64::from);
            assert!((cos * cos + sin * sin - 1.0).abs() < 1e-6);
            Ok(potential_term(0.9, height(t.state), height(t.next_state)))
        });
        assert_eq!(swing.unwrap().unwrap().violations, 0);
        let lander = LunarLander::new(Mission::default()).unwrap();
        let settings = QuerySettings { ranges: vec![[-1.0, 1.0]; 8], ..settings };
        assert_eq!(query(&lander, &settings, |_, _| Ok(0.0)).unwrap(), None);
    }
}
