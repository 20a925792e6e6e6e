//! The moon at night: hills, the pad between its flags, the lander with its legs, and the flames of
//! the engines that ran.

use super::{HEIGHT, Jet, LunarLander, SCALE, WIDTH};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{
    BLUE, Colour, ICE, INK, MIST, NIGHT, ORANGE, RED, SLATE, WHITE, YELLOW,
};
use crate::env::scene::{Draw, Point, Scene, Shape, placed};
use crate::mdp::math;

/// How far the picture goes on beside and above the world, m.
const MARGIN: f64 = 0.7;
const MOON: Colour = SLATE;
const STARS: u32 = 40;

impl Draw for LunarLander {
    const FPS: u32 = 50;

    fn scene(&self, _last: Option<&PlayedAction>) -> Scene {
        let (low, high) = ([-MARGIN, 0.0], [WIDTH + MARGIN, HEIGHT + MARGIN]);
        let mut scene = Scene::new(low, high, NIGHT);
        scene.items.reserve(STARS as usize + 24);
        stars(&mut scene);
        let mut ridge = vec![[low[0], self.terrain()[0][1]]];
        ridge.extend(self.terrain());
        ridge.push([high[0], self.terrain()[self.terrain().len() - 1][1]]);
        let mut hills = ridge.clone();
        hills.extend([[high[0], 0.0], [low[0], 0.0]]);
        scene.add(Shape::polygon(hills, MOON));
        scene.add(Shape::line(ridge, 0.08, MIST));
        self.pad(&mut scene);
        let jets = self.jets();
        for (jet, length) in [(jets.main, 1.7), (jets.side, 0.9)] {
            if let Some(jet) = jet {
                flame(&mut scene, &jet, length);
            }
        }
        self.craft(&mut scene);
        self.beyond(&mut scene, high);
        scene
    }
}

impl LunarLander {
    fn craft(&self, scene: &mut Scene) {
        let (turn, middle) = (math::sin_cos(self.angle().into()), self.position().map(f64::from));
        // Pixels of the hull's own frame.
        let at = |[x, y]: Point| placed([x / SCALE, y / SCALE], turn, middle);
        for (leg, touches) in self.legs().iter().zip(self.leg_contacts()) {
            let leg = leg.map(wide);
            let colour = if touches { YELLOW } else { ICE };
            // A strut to the nearer corner of the hull.
            let knee = centre(&leg);
            let [left, right] = [at([-15.0, -9.0]), at([15.0, -9.0])];
            let hip = if square(left, knee) < square(right, knee) { left } else { right };
            scene.add(Shape::line([hip, knee], 0.07, SLATE));
            scene.add(Shape::polygon(leg, colour));
        }
        scene.add(Shape::polygon(self.hull().map(wide), WHITE));
        let tank = [[-15.0, -1.0], [-15.0, -8.0], [15.0, -8.0], [15.0, -1.0]];
        scene.add(Shape::polygon(tank.map(at), BLUE));
        scene.add(Shape::disc(at([0.0, 8.0]), 0.17, INK));
    }

    fn pad(&self, scene: &mut Scene) {
        let (ends, y) = self.helipad();
        scene.add(Shape::line(ends.map(|x| [x, y]), 0.12, YELLOW));
        for x in ends {
            scene.add(Shape::line([[x, y], [x, y + 1.5]], 0.07, WHITE));
            let flag = [[x, y + 1.55], [x + 0.75, y + 1.27], [x, y + 1.0]];
            scene.add(Shape::polygon(flag, YELLOW));
        }
    }

    /// A wind sock's arrow, and a mark below a lander that has left at the top.
    fn beyond(&self, scene: &mut Scene, high: Point) {
        let [x, y] = self.position().map(f64::from);
        if y > high[1] {
            let x = x.clamp(0.0, WIDTH);
            let mark = [[x, high[1] - 0.1], [x + 0.3, high[1] - 0.6], [x - 0.3, high[1] - 0.6]];
            scene.add(Shape::polygon(mark, RED));
        }
        if self.has_wind() {
            let [force, _] = self.wind();
            let start = [WIDTH / 2.0, HEIGHT];
            for shape in Shape::arrow(start, [start[0] + force / 8.0, start[1]], 0.1, ICE) {
                scene.add(shape);
            }
        }
    }
}

/// Points of the sky, the same in every picture.
fn stars(scene: &mut Scene) {
    for i in 0..STARS {
        // Multiples of irrational numbers spread evenly.
        let x = (f64::from(i) * 0.618_033_988_749_895).fract() * (WIDTH - 0.4) + 0.2;
        let y = (f64::from(i) * 0.754_877_666_246_693).fract() * (HEIGHT - 0.4) + 0.4;
        let radius = 0.025 + 0.02 * f64::from(i % 3);
        scene.add(Shape::disc([x, y], radius, NIGHT.mixed(WHITE, 0.55)));
    }
}

/// A flame along the exhaust, `length` long at full power.
fn flame(scene: &mut Scene, jet: &Jet, length: f64) {
    let [x, y] = jet.impulse;
    let norm = (x * x + y * y).sqrt();
    if norm == 0.0 {
        return;
    }
    let (along, reach) = ([x / norm, y / norm], length * jet.power);
    for (share, half, colour) in [(1.0, 0.22, ORANGE), (0.65, 0.12, YELLOW)] {
        let end = |across: f64, ahead: f64| {
            let [dx, dy] =
                [along[0] * ahead - along[1] * across, along[1] * ahead + along[0] * across];
            [jet.at[0] + dx, jet.at[1] + dy]
        };
        let reach = reach * share;
        let half = half * length / 1.7;
        let points = [
            end(-half, 0.0),
            end(-half, 0.55 * reach),
            end(0.0, reach),
            end(half, 0.55 * reach),
            end(half, 0.0),
        ];
        scene.add(Shape::polygon(points, colour));
    }
}

fn wide(point: [f32; 2]) -> Point {
    point.map(f64::from)
}

fn centre<const N: usize>(points: &[Point; N]) -> Point {
    let sum = points.iter().fold([0.0, 0.0], |s, p| [s[0] + p[0], s[1] + p[1]]);
    sum.map(|x| x / N as f64)
}

fn square(a: Point, b: Point) -> f64 {
    let (x, y) = (b[0] - a[0], b[1] - a[1]);
    x * x + y * y
}
