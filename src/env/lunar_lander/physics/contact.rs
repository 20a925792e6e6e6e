//! An edge and a body that may touch, over time.

use super::manifold::Manifold;

/// A pair whose boxes overlap.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Contact {
    /// The edge's index.
    pub(crate) edge: usize,
    /// The body's index.
    pub(crate) body: usize,
    pub(crate) manifold: Manifold,
    pub(crate) touching: bool,
    /// Cleared where a sub-step found nothing; such a pair waits for the next full update.
    pub(crate) enabled: bool,
    /// When the two meet in this step, as a fraction of it, if that is known.
    pub(crate) impact: Option<f32>,
    /// How many impacts of this step it has had.
    pub(crate) impacts: u32,
    /// The coefficient of the pair.
    pub(crate) friction: f32,
}

/// What an update of a contact has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    None,
    Begin,
    End,
}

impl Contact {
    /// A pair that is not known to touch. Coefficients of friction mix by their geometric mean.
    pub(crate) fn new(edge: usize, body: usize, frictions: (f32, f32)) -> Self {
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
    pub(crate) fn update(&mut self, mut manifold: Manifold) -> Change {
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
