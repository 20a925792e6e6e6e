//! An edge and a body that may touch, over time.

use super::manifold::Manifold;

/// A pair whose boxes overlap.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contact {
    /// The edge's index.
    pub(super) edge: usize,
    /// The body's index.
    pub(super) body: usize,
    pub(super) manifold: Manifold,
    pub(super) touching: bool,
    /// Cleared where a sub-step found nothing; such a pair waits for the next full update.
    pub(super) enabled: bool,
    /// When the two meet in this step, as a fraction of it, if that is known.
    pub(super) impact: Option<f32>,
    /// How many impacts of this step it has had.
    pub(super) impacts: u32,
    /// The coefficient of the pair.
    pub(super) friction: f32,
}

/// What an update of a contact has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Change {
    None,
    Begin,
    End,
}

impl Contact {
    /// A pair that is not known to touch. Coefficients of friction mix by their geometric mean.
    pub(super) fn new(edge: usize, body: usize, frictions: (f32, f32)) -> Self {
        Self {
            edge,
            body,
            manifold: Manifold::NONE,
            touching: false,
            enabled: true,
            impact: None,
            impacts: 0,
            friction: (frictions.0 * frictions.1).sqrt(),
        }
    }

    /// Takes a new manifold, with the impulses of the points that it shares with the old one.
    pub(super) fn update(&mut self, mut manifold: Manifold) -> Change {
        manifold.inherit(&self.manifold);
        self.manifold = manifold;
        self.enabled = true;
        let touched = self.touching;
        self.touching = manifold.n > 0;
        match (touched, self.touching) {
            (false, true) => Change::Begin,
            (true, false) => Change::End,
            _ => Change::None,
        }
    }
}
