//! The car in its valley, the flag at the goal, and the push of the engine.

use super::{GOAL_POSITION, MAX_POSITION, MIN_POSITION, MountainCar};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{BLUE, EARTH, GREEN, ICE, INK, ORANGE, PAPER, SLATE, YELLOW};
use crate::env::scene::{Draw, Point, Scene, Shape, placed};
use crate::mdp::math;

/// The edges of the picture.
const LOW: Point = [MIN_POSITION - 0.06, -0.08];
const HIGH: Point = [MAX_POSITION + 0.06, 1.22];

impl Draw for MountainCar {
    const FPS: u32 = 30;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let push = match last {
            Some(PlayedAction::Index(action)) => *action as f64 - 1.0,
            _ => 0.0,
        };
        valley(self.position, GOAL_POSITION, push)
    }
}

/// The scene of a car at `position` whose engine pushes with `push` (-1 to 1), with the flag at
/// `goal`.
pub(in crate::env) fn valley(position: f64, goal: f64, push: f64) -> Scene {
    let mut scene = Scene::new(LOW, HIGH, PAPER.mixed(ICE, 0.5));
    let ridge: Vec<Point> = (0..=96)
        .map(|i| LOW[0] + (HIGH[0] - LOW[0]) * f64::from(i) / 96.0)
        .map(|x| [x, height(x)])
        .collect();
    let mut hill = ridge.clone();
    hill.extend([[HIGH[0], LOW[1]], LOW]);
    scene.add(Shape::polygon(hill, EARTH));
    scene.add(Shape::line(ridge, 0.022, GREEN));
    let (foot, top) = (height(goal), height(goal) + 0.19);
    let flag = [[goal, top], [goal + 0.1, top - 0.04], [goal, top - 0.08]];
    scene.add(Shape::polygon(flag, YELLOW));
    scene.add(Shape::line([[goal, foot], [goal, top]], 0.011, INK));
    // The slope of the ground is 1.35 cos(3x): the car stands along it.
    let slope = 1.35 * math::cos(3.0 * position);
    let length = (1.0 + slope * slope).sqrt();
    let turn = (slope / length, 1.0 / length);
    let ground = [position, height(position)];
    for shape in car(push) {
        scene.add(shape.placed(turn, placed([0.0, 0.011], turn, ground)));
    }
    scene
}

/// The car on flat ground around the origin.
fn car(push: f64) -> Vec<Shape> {
    let body = [
        [-0.085, 0.026],
        [0.085, 0.026],
        [0.085, 0.062],
        [0.05, 0.068],
        [0.026, 0.1],
        [-0.042, 0.1],
        [-0.07, 0.068],
        [-0.085, 0.064],
    ];
    let window = [[-0.052, 0.069], [0.032, 0.069], [0.016, 0.09], [-0.036, 0.09]];
    let mut shapes = vec![Shape::polygon(body, BLUE), Shape::polygon(window, ICE)];
    for x in [-0.048, 0.048] {
        shapes.push(Shape::disc([x, 0.026], 0.026, INK));
        shapes.push(Shape::disc([x, 0.026], 0.01, SLATE));
    }
    let from = [0.0, 0.15];
    let to = [0.17 * push, 0.15];
    shapes.extend(Shape::arrow(from, to, 0.018, ORANGE));
    shapes
}

/// The height of the ground.
fn height(x: f64) -> f64 {
    0.45 * math::sin(3.0 * x) + 0.55
}
