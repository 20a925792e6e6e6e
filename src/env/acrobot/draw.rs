//! Two links that hang from a bar, the line that the free end must cross, and the torque between
//! the links as an arrow around their joint.

use super::Acrobot;
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{BLUE, GREEN, INK, ORANGE, PAPER, RED, SLATE, WHITE};
use crate::env::scene::{Draw, Scene, Shape, of_action, placed};
use crate::mdp::math;

impl Draw for Acrobot {
    const FPS: u32 = 15;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let mut scene = Scene::new([-2.9, -2.2], [2.9, 2.2], PAPER);
        scene.add(Shape::line([[-2.6, 1.0], [2.6, 1.0]], 0.03, GREEN));
        scene.add(Shape::line([[-0.35, 0.0], [0.35, 0.0]], 0.06, SLATE));
        let (first, second) = self.angles();
        let bar = [0.0, 0.0];
        let joint = placed([0.0, -1.0], math::sin_cos(first), bar);
        let end = placed([0.0, -1.0], math::sin_cos(first + second), joint);
        scene.add(Shape::line([bar, joint], 0.2, INK));
        scene.add(Shape::line([joint, end], 0.2, ORANGE));
        for point in [bar, joint] {
            scene.add(Shape::disc(point, 0.07, WHITE));
        }
        scene.add(Shape::disc(end, 0.09, RED));
        let torque = of_action(last, &[-1.0, 0.0, 1.0]).unwrap_or(0.0);
        for shape in Shape::turn(joint, 0.3, [90.0, 120.0 * torque], 0.06, BLUE) {
            scene.add(shape);
        }
        scene
    }
}
