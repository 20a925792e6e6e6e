//! The cart on its track between the limits, the pole, and the push just given.

use super::{CartPole, HALF_LENGTH, THETA_LIMIT, X_LIMIT};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{BLUE, INK, MIST, ORANGE, PAPER, RED, SLATE};
use crate::env::scene::{Draw, Point, Scene, Shape, placed};
use crate::mdp::math;

/// The height of the pole's axle above the track, m.
const AXLE: f64 = 0.3;
/// Half the width of the cart, m.
const HALF_CART: f64 = 0.28;

impl Draw for CartPole {
    const FPS: u32 = 50;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let mut scene = Scene::new([-2.9, -0.35], [2.9, 1.6], PAPER);
        for x in [-X_LIMIT, X_LIMIT] {
            scene.add(Shape::line([[x, -0.1], [x, 0.34]], 0.035, RED));
        }
        scene.add(Shape::line([[-2.8, 0.0], [2.8, 0.0]], 0.03, SLATE));
        let axle = [self.x, AXLE];
        for theta in [-THETA_LIMIT, THETA_LIMIT] {
            let limit = [tip(axle, theta, 0.55), tip(axle, theta, 2.2 * HALF_LENGTH)];
            scene.add(Shape::line(limit, 0.012, MIST));
        }
        let cart = Shape::rect([-HALF_CART, -0.2], [HALF_CART, 0.06], INK);
        scene.add(cart.moved(axle));
        for side in [-0.16, 0.16] {
            scene.add(Shape::disc([self.x + side, 0.09], 0.09, SLATE));
            scene.add(Shape::disc([self.x + side, 0.09], 0.035, PAPER));
        }
        let pole = [axle, tip(axle, self.theta, 2.0 * HALF_LENGTH)];
        scene.add(Shape::line(pole, 0.075, ORANGE));
        scene.add(Shape::disc(axle, 0.055, PAPER));
        scene.add(Shape::disc(axle, 0.03, INK));
        if let Some(PlayedAction::Index(action)) = last {
            // The push comes from behind.
            let sign = if *action == 1 { 1.0 } else { -1.0 };
            let end = [self.x - sign * (HALF_CART + 0.04), 0.2];
            let start = [end[0] - sign * 0.3, 0.2];
            for shape in Shape::arrow(start, end, 0.05, BLUE) {
                scene.add(shape);
            }
        }
        scene
    }
}

/// The point at `length` along a pole that leans by `theta` from upright (to the right).
fn tip(axle: Point, theta: f64, length: f64) -> Point {
    let (sin, cos) = math::sin_cos(theta);
    placed([0.0, length], (-sin, cos), axle)
}
