//! What there is to see: for drawing.
//!
//! Lengths are metres in the world, whose lower left corner is the origin, and which is
//! [`super::WIDTH`] by [`super::HEIGHT`].

use super::LunarLander;
use super::engines::Jets;
use super::physics::{Body, HULL, LEGS};
use super::terrain::{PAD_Y, POINTS};

impl LunarLander {
    /// The outline of the hills, `[x, y]` from left to right.
    pub fn terrain(&self) -> [[f64; 2]; POINTS] {
        self.terrain.points
    }

    /// Where the landing pad begins and ends, and its height. (The ground under it is one percent
    /// lower: hills are smoothed with a factor of 0.33.)
    pub fn helipad(&self) -> ([f64; 2], f64) {
        (self.terrain.pad_x(), PAD_Y)
    }

    /// The middle of the hull.
    pub fn position(&self) -> [f32; 2] {
        let position = self.world.bodies[HULL].frame.position;
        [position.x, position.y]
    }

    /// The hull's angle from upright, positive to the left, rad.
    pub fn angle(&self) -> f32 {
        self.world.bodies[HULL].angle()
    }

    /// The corners of the hull, counter-clockwise.
    pub fn hull(&self) -> [[f32; 2]; 6] {
        corners(&self.world.bodies[HULL])
    }

    /// The corners of each leg, counter-clockwise; the first leg is the one on the right.
    pub fn legs(&self) -> [[[f32; 2]; 4]; 2] {
        LEGS.map(|leg| corners(&self.world.bodies[leg]))
    }

    /// Whether each leg counts as touching the ground, in the order of [`Self::legs`].
    pub fn leg_contacts(&self) -> [bool; 2] {
        self.world.leg_contact
    }

    /// What the engines did in the last step.
    pub fn jets(&self) -> Jets {
        self.jets
    }

    /// Whether there is wind in this instance.
    pub fn has_wind(&self) -> bool {
        self.mission.enable_wind
    }

    /// The wind in the last step: the force to the right (N) and the torque to the left (N·m).
    pub fn wind(&self) -> [f64; 2] {
        self.gust
    }
}

fn corners<const N: usize>(body: &Body) -> [[f32; 2]; N] {
    let mut out = [[0.0; 2]; N];
    for (out, &corner) in out.iter_mut().zip(body.shape.corners()) {
        let corner = body.frame.apply(corner);
        *out = [corner.x, corner.y];
    }
    out
}
