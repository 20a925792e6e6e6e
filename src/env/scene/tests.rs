use super::*;
use palette::{BLUE, RED};

fn scene(at: Point) -> Scene {
    let mut scene = Scene::grid(2, 3, RED);
    scene.sprite("elf", at, vec![Shape::disc([0.0, 0.0], 0.2, BLUE)]);
    scene
}

#[test]
fn cells_lie_inside_their_grid() {
    let grid = Scene::grid(2, 3, RED);
    assert_eq!((cell(0, 0), cell(1, 2)), ([0.5, -0.5], [2.5, -1.5]));
    assert_eq!((grid.origin, grid.size), ([-0.15, -2.15], [3.3, 2.3]));
}

#[test]
fn sprites_glide_to_neighbours_and_jump_farther() {
    let (before, after) = (scene(cell(0, 0)), scene(cell(0, 1)));
    assert!(after.moves(&before) && !after.moves(&after));
    let half = after.between(&before, 0.5);
    assert_eq!(half.find("elf", 0).unwrap().at, [1.0, -0.5]);
    assert_eq!(half.shapes().next(), Some(Shape::disc([1.0, -0.5], 0.2, BLUE)));
    assert_eq!(after.between(&before, 1.0), after);
    // Over the edge of a cliff and back to the start.
    let far = scene(cell(1, 2));
    assert!(!far.moves(&before));
    assert_eq!(far.between(&before, 0.5), far);
}

#[test]
fn new_sprites_come_from_where_they_say() {
    let before = Scene::grid(2, 3, RED);
    let mut after = scene([2.0, -1.0]);
    assert!(!after.moves(&before));
    let Item::Sprite(sprite) = &mut after.items[0] else { panic!("a sprite") };
    sprite.from = Some([4.0, -3.0]);
    assert_eq!(after.between(&before, 0.25).find("elf", 0).unwrap().at, [3.5, -2.5]);
}

#[test]
fn shapes_turn_counterclockwise() {
    let quarter = (1.0, 0.0);
    let line = Shape::line([[0.0, 0.0], [2.0, 0.0]], 0.1, RED).placed(quarter, [5.0, 5.0]);
    assert_eq!(line, Shape::line([[5.0, 5.0], [5.0, 7.0]], 0.1, RED));
    let up = Shape::chevron([0.0, 1.0], 1.0, 0.1, RED);
    let Shape::Line { points, .. } = up else { panic!("a line") };
    assert_eq!(points, [[-1.0, -0.5], [0.0, 0.5], [1.0, -0.5]]);
    let circle = arc([1.0, 1.0], 2.0, 0.0, 90.0, 2);
    assert_eq!(circle[0], [3.0, 1.0]);
    assert!((circle[2][0] - 1.0).abs() < 1e-12 && circle[2][1] == 3.0);
}

#[test]
fn arrows_end_where_they_point() {
    let shapes = Shape::arrow([0.0, 0.0], [3.0, 0.0], 0.5, RED);
    let [Shape::Line { points: shaft, .. }, Shape::Polygon { points: head, .. }] = &shapes[..]
    else {
        panic!("a shaft and a head")
    };
    assert_eq!((shaft[0], head[0]), ([0.0, 0.0], [3.0, 0.0]));
    assert!(Shape::arrow([1.0, 1.0], [1.0, 1.0], 0.5, RED).is_empty());
    assert!(Shape::turn([0.0, 0.0], 1.0, [90.0, 0.0], 0.1, RED).is_empty());
}
