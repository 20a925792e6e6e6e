//! Whether a potential makes dying attractive, and the constant that would mend it.
//!
//! A potential that is negative where an episode ends badly pays for the bad end: `F = 0 − Φ(s) > 0`.
//! Adding b to Φ (but not beyond the end) is adding b to the initial values (Wiewiora 2003), and
//! decides what is tried first (Müller & Kudenko 2025).

use serde::Serialize;

use super::{Scorer, TIE};
use crate::learn::planning::PlanError;

/// How many shifts are tried, besides none.
const GRID: usize = 21;

/// Bad ends, and those for which a potential pays. An end is bad if the native reward on the way is
/// less than the state it is left from is worth: `r < V*(s)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DeathAttraction {
    /// Transitions that end badly: outcomes of positive probability, those that differ in nothing but
    /// it counted once.
    pub bad_ends: usize,
    /// Those with F > 0.
    pub paid: usize,
}

/// A constant to be added to a potential, in units of reward.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shift {
    /// From here on every bad end looks worse than going on, which is worth 0 at first: the largest
    /// `r − Φ(s)` of bad ends. `None` if there are none.
    pub above: Option<f64>,
    /// Up to here every good end looks better: the smallest `r − Φ(s)` of good ends. `None` if there
    /// are none.
    pub below: Option<f64>,
    /// The shift with the best VI-AUC, of a grid over the interval and half its width to either side,
    /// and of none; the middle one of several that are equally good.
    pub suggested: f64,
    /// Its VI-AUC.
    pub vi_auc: Option<f64>,
    /// VI-AUC without a shift.
    pub vi_auc_unshifted: Option<f64>,
}

impl Scorer<'_> {
    /// Calls `visit(place, r, bad)` for each transition that ends an episode.
    fn ends(&self, mut visit: impl FnMut(usize, f64, bool)) {
        let mut seen = Vec::new();
        for place in 0..self.dynamics.len() {
            let s = self.dynamics.state(place);
            for a in 0..self.mdp.n_actions() {
                seen.clear();
                for o in self.mdp.of(s, a) {
                    let end = (o.next_state, o.reward.to_bits());
                    let happens = o.terminated && o.probability > 0.0;
                    if !happens || seen.contains(&end) {
                        continue;
                    }
                    seen.push(end);
                    visit(place, o.reward, o.reward < self.v[place] - TIE * self.scale);
                }
            }
        }
    }

    /// Of a potential given by place.
    pub(super) fn death(&self, phi: &[f64]) -> DeathAttraction {
        let mut found = DeathAttraction { bad_ends: 0, paid: 0 };
        self.ends(|place, _, bad| {
            found.bad_ends += usize::from(bad);
            found.paid += usize::from(bad && phi[place] < 0.0);
        });
        found
    }

    /// Looks for the constant that makes most of `phi`, one value per state of the model. Scores some
    /// twenty potentials.
    ///
    /// # Errors
    /// As [`Scorer::score`].
    pub fn shift(&self, phi: &[f64]) -> Result<Shift, PlanError> {
        let phi = self.pack(phi);
        let (mut above, mut below) = (None::<f64>, None::<f64>);
        self.ends(|place, reward, bad| {
            let b = reward - phi[place];
            if bad {
                above = Some(above.map_or(b, |other| other.max(b)));
            } else {
                below = Some(below.map_or(b, |other| other.min(b)));
            }
        });
        // Without ends of a kind: as far as the values of the states themselves would ask for.
        let gaps = || self.v.iter().zip(&phi).map(|(v, phi)| v - phi);
        let low = above.unwrap_or_else(|| gaps().fold(f64::INFINITY, f64::min));
        let high = below.unwrap_or_else(|| gaps().fold(f64::NEG_INFINITY, f64::max));
        let (low, high) = (low.min(high), low.max(high));
        let auc = |b: f64| -> Result<f64, PlanError> {
            let shifted: Vec<f64> = phi.iter().map(|phi| phi + b).collect();
            let returns = self.greedy_returns(&shifted)?;
            Ok(returns.iter().sum::<f64>() / returns.len() as f64)
        };
        let unshifted = auc(0.0)?;
        let mut tried = vec![(0.0, unshifted)];
        for k in 0..GRID {
            let at = 2.0 * k as f64 / (GRID - 1) as f64 - 0.5;
            let b = low + at * (high - low);
            tried.push((b, auc(b)?));
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = tried.iter().fold(f64::NEG_INFINITY, |m, (_, value)| m.max(*value));
        let tied = |value: f64| value >= best - TIE * self.scale;
        // Nothing is better than a shift that does not help.
        let suggested = if tied(unshifted) {
            (0.0, unshifted)
        } else {
            tried.retain(|(_, value)| tied(*value));
            tried[tried.len() / 2]
        };
        Ok(Shift {
            above,
            below,
            suggested: suggested.0,
            vi_auc: self.share(suggested.1),
            vi_auc_unshifted: self.share(unshifted),
        })
    }
}
