//! As MountainCar, with an arrow as long as the force is large.

use super::{GOAL_POSITION, MountainCarContinuous};
use crate::env::actions::PlayedAction;
use crate::env::mountain_car::valley;
use crate::env::scene::{Draw, Scene, force};

impl Draw for MountainCarContinuous {
    const FPS: u32 = 30;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let push = force(last, &self.actions).clamp(-1.0, 1.0);
        valley(self.car().0, GOAL_POSITION, push)
    }
}
