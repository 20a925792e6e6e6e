//! The pendulum, the way up, and the torque as an arrow around the axle.

use super::{LENGTH, MAX_TORQUE, Pendulum};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{BLUE, GREEN, INK, MIST, ORANGE, PAPER, WHITE};
use crate::env::scene::{Draw, Scene, Shape, arc, force, placed};
use crate::mdp::math;

impl Draw for Pendulum {
    const FPS: u32 = 30;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let mut scene = Scene::new([-1.7, -1.25], [1.7, 1.25], PAPER);
        let axle = [0.0, 0.0];
        scene.add(Shape::line(arc(axle, LENGTH, 0.0, 360.0, 96), 0.012, MIST));
        scene.add(Shape::line([[0.0, LENGTH + 0.06], [0.0, LENGTH + 0.16]], 0.04, GREEN));
        let tip = placed([0.0, LENGTH], math::sin_cos(self.theta), axle);
        scene.add(Shape::line([axle, tip], 0.13, ORANGE));
        scene.add(Shape::disc(tip, 0.11, INK));
        scene.add(Shape::disc(axle, 0.09, INK));
        scene.add(Shape::disc(axle, 0.04, WHITE));
        // A full torque is a quarter and a half turn.
        let limit = f64::from(MAX_TORQUE);
        let torque = force(last, &self.actions).clamp(-limit, limit) / limit;
        for shape in Shape::turn(axle, 0.32, [90.0, 135.0 * torque], 0.045, BLUE) {
            scene.add(shape);
        }
        scene
    }
}
