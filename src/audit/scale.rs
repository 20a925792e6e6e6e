//! Is the learned reward the native one, rescaled, plus a potential?
//!
//! `R′ = kR + γΦ(s′) − Φ(s)` in expectation if and only if `A_{R′} = k A_R` for the advantages of any
//! one policy. With k > 0 this keeps the order of all policies; such rewards are equivalent (Skalse et
//! al. 2023).

use serde::Serialize;

use super::expected::Advantages;
use super::strict::Finding;

/// The learned reward as a multiple of the native one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scaling {
    /// Holds if the learned reward is a positive multiple of the native one plus a potential, in
    /// expectation.
    pub finding: Finding,
    /// k, by least squares: `⟨A_R, A_R′⟩ / ⟨A_R, A_R⟩`. `None` if the native reward prefers nothing
    /// (`A_R = 0`); then the learned one must not either.
    pub factor: Option<f64>,
    /// `max |A_R′ − k A_R|`.
    pub residual: f64,
    /// S: the largest number that the residual comes from.
    pub scale: f64,
}

impl Advantages<'_> {
    /// Compares the learned reward with a multiple of the native one.
    pub fn scaling(&self) -> Scaling {
        let learned = || self.native.iter().zip(&self.shaping).map(|(r, f)| (r, r + f));
        let prefers = self.native.iter().any(|a| a.abs() > 1e-9 * self.native_scale);
        let (mut product, mut square) = (0.0, 0.0);
        for (native, learned) in learned() {
            product += native * learned;
            square += native * native;
        }
        let factor = prefers.then(|| product / square);
        let k = factor.unwrap_or(0.0);
        let residual = learned().fold(0.0f64, |m, (r, l)| m.max((l - k * r).abs()));
        let scale = self.shaping_scale.max(self.native_scale).max(k.abs() * self.native_scale);
        let finding = match Finding::of(residual, scale) {
            // A k that rounding could have made is 0: nothing of the native reward is left.
            Finding::Holds if prefers && k * self.native_scale <= 1e-8 * scale => Finding::Fails,
            finding => finding,
        };
        Scaling { finding, factor, residual, scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::specimens::{lake, potential_rewards, random_model, rewards, symmetric};
    use crate::learn::planning::{Dynamics, Over};
    use crate::mdp::FiniteMdp;
    use crate::mdp::streams::Stream;

    fn run(mdp: &FiniteMdp, f: &[f64], gamma: f64) -> Scaling {
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        Advantages::new(mdp, &dynamics, f, gamma).unwrap().scaling()
    }

    #[test]
    fn a_positive_factor_is_recovered_under_any_potential() {
        let mut stream = Stream::new(1, "scale");
        for factor in [3.7, 1.0, 1e-3, 1e3] {
            for _ in 0..30 {
                let mdp = random_model(&mut stream, 12, 0.1);
                if mdp.n_actions() == 1 {
                    continue;
                }
                let phi: Vec<f64> = (0..12).map(|_| symmetric(&mut stream)).collect();
                let mut f = potential_rewards(&mdp, 0.9, &phi);
                for (f, o) in f.iter_mut().zip(mdp.outcomes()) {
                    *f += (factor - 1.0) * o.reward;
                }
                let found = run(&mdp, &f, 0.9);
                assert_eq!(found.finding, Finding::Holds, "{found:?}");
                let error = (found.factor.unwrap() / factor - 1.0).abs();
                assert!(error < if factor < 1.0 { 1e-10 } else { 1e-13 }, "{error} of {factor}");
            }
        }
    }

    #[test]
    fn the_factor_of_the_lake_is_exact() {
        let mdp = lake(true);
        let phi: Vec<f64> = (0..64).map(|s| f64::from(s as u8 % 7)).collect();
        let mut f = potential_rewards(&mdp, 0.99, &phi);
        for (f, o) in f.iter_mut().zip(mdp.outcomes()) {
            *f += 2.7 * o.reward;
        }
        let found = run(&mdp, &f, 0.99);
        assert_eq!(found.finding, Finding::Holds);
        assert!((found.factor.unwrap() - 3.7).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn what_is_no_positive_multiple_fails() {
        let mdp = lake(true);
        for (f, factor) in [
            (rewards(&mdp, |_, _, o| -2.0 * o.reward), Some(-1.0)),
            (rewards(&mdp, |_, _, o| -o.reward), Some(0.0)),
            (rewards(&mdp, |_, _, _| -0.01), None),
        ] {
            let found = run(&mdp, &f, 0.99);
            assert_eq!(found.finding, Finding::Fails, "{found:?}");
            if let Some(factor) = factor {
                assert!((found.factor.unwrap() - factor).abs() < 1e-12, "{found:?}");
            }
        }
    }

    #[test]
    fn a_reward_that_prefers_nothing_has_no_factor() {
        let nothing = lake(true).with_rewards(|_, _, _| 0.0);
        let phi: Vec<f64> = (0..64).map(f64::from).collect();
        let found = run(&nothing, &potential_rewards(&nothing, 0.99, &phi), 0.99);
        assert_eq!((found.finding, found.factor), (Finding::Holds, None));
        let found = run(&nothing, &rewards(&nothing, |_, a, _| a as f64), 0.99);
        assert_eq!((found.finding, found.factor), (Finding::Fails, None));
    }
}
