//! How far the learned reward is from the native one: a STARC metric (Skalse et al. 2024).
//!
//! `½ ‖A_R / ‖A_R‖ − A_R′ / ‖A_R′‖‖` with the advantages of the uniform policy and the Euclidean norm
//! over all (s, a) that an episode can be in: 0 for rewards that differ by potentials and a positive
//! factor, 1 for opposite ones. Advantages that are 0 stay 0, so that a reward without any
//! preference is ½ away from every other.

use super::expected::Advantages;

impl Advantages<'_> {
    /// The distance of the learned from the native reward, between 0 and 1.
    pub fn starc(&self) -> f64 {
        let norm = |values: &mut dyn Iterator<Item = f64>, scale: f64| {
            let largest = values.fold((0.0f64, 0.0), |(m, sum), x| (m.max(x.abs()), sum + x * x));
            // What rounding has left of nothing is nothing.
            if largest.0 <= 1e-9 * scale { f64::INFINITY } else { largest.1.sqrt() }
        };
        let learned = || self.native.iter().zip(&self.shaping).map(|(r, f)| r + f);
        let native_norm = norm(&mut self.native.iter().copied(), self.native_scale);
        let learned_norm = norm(&mut learned(), self.native_scale.max(self.shaping_scale));
        let gaps = self.native.iter().zip(learned());
        let squares = gaps.map(|(r, l)| {
            let gap = r / native_norm - l / learned_norm;
            gap * gap
        });
        0.5 * squares.sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::specimens::{lake, lake_distance, potential_rewards, rewards};
    use crate::learn::planning::{Dynamics, Over};
    use crate::mdp::FiniteMdp;

    fn run(mdp: &FiniteMdp, f: &[f64]) -> f64 {
        let dynamics = Dynamics::new(mdp, Over::Reachable);
        Advantages::new(mdp, &dynamics, f, 0.99).unwrap().starc()
    }

    #[test]
    fn potentials_are_at_no_distance_and_a_cost_per_step_is() {
        let mdp = lake(true);
        let phi: Vec<f64> = (0..64).map(|s| -0.05 * lake_distance(s)).collect();
        assert!(run(&mdp, &potential_rewards(&mdp, 0.99, &phi)) < 1e-12);
        let cost = run(&mdp, &rewards(&mdp, |_, _, _| -0.01));
        assert_eq!(format!("{cost:.2}"), "0.21");
    }

    #[test]
    fn the_ends_of_the_scale() {
        let mdp = lake(true);
        let times = |k: f64| rewards(&mdp, |_, _, o| (k - 1.0) * o.reward);
        assert!(run(&mdp, &times(17.0)) < 1e-12);
        assert!((run(&mdp, &times(-0.1)) - 1.0).abs() < 1e-12);
        assert!((run(&mdp, &times(0.0)) - 0.5).abs() < 1e-15);
        let nothing = mdp.with_rewards(|_, _, _| 0.0);
        let phi: Vec<f64> = (0..64).map(lake_distance).collect();
        assert_eq!(run(&nothing, &potential_rewards(&nothing, 0.99, &phi)), 0.0);
        assert!((run(&nothing, &rewards(&nothing, |_, a, _| a as f64)) - 0.5).abs() < 1e-15);
    }
}
