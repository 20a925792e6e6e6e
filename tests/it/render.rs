//! What environments look like: scenes, text pictures, animations.

use gif::{ColorOutput, DecodeOptions};
use runner::env::rollout::{Event, Length, drive, random_policy};
use runner::env::scene::palette::{INK, ORANGE};
use runner::env::scene::{Colour, Scene, Shape};
use runner::env::{Observation, PlayedAction, Session, specs};
use runner::mdp::Ending;
use runner::mdp::numpy::Seed;
use runner::mdp::streams::Stream;
use runner::render::recorder::{describe, number};
use runner::render::{Palette, Recorder, lines};
use serde_json::{Map, json};

use crate::support::{expect_code, folder, run, stderr, stdout};

fn session(id: &str, kwargs: &serde_json::Value) -> Session {
    Session::new(id, kwargs.as_object().unwrap()).unwrap()
}

/// A random rollout's scenes.
fn scenes(id: &str, seed: u64, steps: usize) -> Vec<Scene> {
    let mut session = Session::new(id, &Map::new()).unwrap();
    let mut policy = random_policy(&session, Stream::new(seed, "policy"));
    let mut scenes = Vec::new();
    let length = Length { steps, episodes: usize::MAX };
    let each = |session: &Session, event: Event<'_>| {
        scenes.push(match event {
            Event::Reset { .. } => session.scene(None),
            Event::Step { action, .. } => session.scene(Some(action)),
        });
        Ok(())
    };
    drive(&mut session, &Seed::from(seed), length, |_, _| Ok(policy()), each).unwrap();
    scenes
}

fn points(shape: &Shape) -> Vec<[f64; 2]> {
    match shape {
        Shape::Polygon { points, .. } | Shape::Line { points, .. } => points.clone(),
        Shape::Disc { centre, .. } | Shape::Text { centre, .. } => vec![*centre],
    }
}

#[test]
fn every_environment_draws_itself_inside_its_picture() {
    for spec in specs() {
        assert!((1..=50).contains(&spec.fps), "{}", spec.id);
        for seed in 0..3 {
            let scenes = scenes(spec.id, seed, 150);
            let (origin, size) = (scenes[0].origin, scenes[0].size);
            assert!(scenes.iter().any(|scene| *scene != scenes[0]), "{} never changes", spec.id);
            for scene in &scenes {
                assert_eq!((scene.origin, scene.size), (origin, size), "{}", spec.id);
                assert!(scene.shapes().count() >= 5, "{} shows hardly anything", spec.id);
                for [x, y] in scene.shapes().flat_map(|shape| points(&shape)) {
                    let share = [(x - origin[0]) / size[0], (y - origin[1]) / size[1]];
                    // The lander may leave the world, half of it before the episode ends.
                    let around = if spec.id.starts_with("LunarLander") { 0.2 } else { 0.001 };
                    assert!(
                        share.iter().all(|share| (-around..=1.0 + around).contains(share)),
                        "{}: a point at {share:?} of the picture",
                        spec.id
                    );
                }
            }
        }
    }
}

/// Every picture in the terminal fits into 80 × 24 with a caption.
#[test]
fn every_environment_fits_into_a_terminal() {
    for spec in specs() {
        let mut session = Session::new(spec.id, &Map::new()).unwrap();
        session.reset(Some(&Seed::from(0)), None).unwrap();
        let text = session.text(None);
        for palette in [Palette::Plain, Palette::Indexed, Palette::Full] {
            let shown = lines(&session.scene(None), text.as_ref(), palette, [79, 22]);
            assert!((3..=22).contains(&shown.len()), "{}: {} lines", spec.id, shown.len());
            for line in shown {
                // Escape sequences take no room.
                let parts = line.split('\x1b').enumerate();
                let width: usize = parts
                    .map(|(i, part)| if i == 0 { part } else { part.split_once('m').unwrap().1 })
                    .map(|text| text.chars().count())
                    .sum();
                assert!(width <= 79, "{}: {width} columns", spec.id);
                assert!(palette != Palette::Plain || !line.contains('\x1b'), "{}", spec.id);
            }
        }
    }
}

/// What the environment looks like in characters after `actions`.
fn text(id: &str, kwargs: &serde_json::Value, actions: &[i64]) -> String {
    let mut session = session(id, kwargs);
    session.reset(Some(&Seed::from(0)), None).unwrap();
    let mut last = None;
    for &action in actions {
        let action = PlayedAction::Index(action);
        session.step(&action).unwrap();
        last = Some(action);
    }
    session.text(last.as_ref()).unwrap().characters()
}

#[test]
fn grids_in_characters() {
    assert_eq!(
        text("FrozenLake-v1", &json!({"is_slippery": false}), &[1, 1, 2]),
        "\
┌────────────┐
│ S  ·  ·  · │
│ ·  O  ·  O │
│ · [·] ·  O │
│ O  ·  ·  G │
└────────────┘
"
    );
    let lake = json!({"desc": ["SHG", "FFF"], "is_slippery": false});
    let row = |actions: &[i64], row: usize| {
        text("FrozenLake-v1", &lake, actions).lines().nth(row).unwrap().to_owned()
    };
    assert_eq!(row(&[], 1), "│[S] O  G │");
    assert_eq!(row(&[2], 1), "│ S [O] G │");
    assert_eq!(row(&[1, 2, 2, 3], 1), "│ S  O [G]│");
    assert_eq!(
        text("CliffWalking-v1", &json!({}), &[0, 1]),
        "\
┌────────────────────────────────────┐
│ ·  ·  ·  ·  ·  ·  ·  ·  ·  ·  ·  · │
│ ·  ·  ·  ·  ·  ·  ·  ·  ·  ·  ·  · │
│ · [·] ·  ·  ·  ·  ·  ·  ·  ·  ·  · │
│ S  x  x  x  x  x  x  x  x  x  x  G │
└────────────────────────────────────┘
"
    );
}

/// Seed 0 starts in state 314, as Gymnasium does: the taxi at row 3, column 0, the passenger at B
/// (3), the destination Y (2).
#[test]
fn a_taxi_in_characters() {
    let map = |row3: &str, row4: &str, caption: &str| {
        format!(
            "\
┌───────────────────┐
│ R   · │ ·   ·   G │
│ ·   · │ ·   ·   · │
│ ·   ·   ·   ·   · │
│{row3}│
│{row4}│
└───────────────────┘
{caption}
"
        )
    };
    assert_eq!(
        text("Taxi-v4", &json!({}), &[]),
        map("[·]│ ·   · │ ·   · ", " Y │ ·   · │ B   · ", "passenger at B, destination Y")
    );
    // North, three times east, twice south, and in.
    assert_eq!(
        text("Taxi-v4", &json!({}), &[1, 2, 2, 2, 0, 0, 4]),
        map(" · │ ·   · │ ·   · ", " Y │ ·   · │[B]  · ", "passenger in the taxi, destination Y")
    );
}

/// Seed 0, as in Gymnasium: the player has 11, the dealer shows a card that counts 10.
#[test]
fn a_hand_of_blackjack_in_characters() {
    let dealt = text("Blackjack-v1", &json!({}), &[]);
    let rows: Vec<&str> = dealt.lines().collect();
    assert_eq!(rows.len(), 6);
    assert!(rows[1].starts_with("dealer  │") && rows[1].ends_with("│░░░│  10 + ?"), "{dealt}");
    assert!(rows[4].starts_with("player  │") && rows[4].ends_with("│  11"), "{dealt}");
    let hit = text("Blackjack-v1", &json!({}), &[1]);
    assert!(hit.lines().nth(4).unwrap().ends_with("│ A │  12"), "{hit}");
    // Nothing is hidden any more.
    let stuck = text("Blackjack-v1", &json!({}), &[0]);
    assert!(!stuck.contains('░') && !stuck.contains('?'), "{stuck}");
}

/// The whole pictures of an animation, one per frame, with their delays.
struct Film {
    width: usize,
    height: usize,
    pictures: Vec<Vec<u8>>,
    delays: Vec<u16>,
}

impl Film {
    fn decode(bytes: &[u8]) -> Self {
        let mut options = DecodeOptions::new();
        options.set_color_output(ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        let (width, height) = (decoder.width().into(), decoder.height().into());
        let mut film = Self { width, height, pictures: Vec::new(), delays: Vec::new() };
        let mut canvas = vec![0; width * height * 4];
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            let wide = usize::from(frame.width);
            for (i, pixel) in frame.buffer.chunks_exact(4).enumerate() {
                if pixel[3] == 255 {
                    let (x, y) =
                        (i % wide + usize::from(frame.left), i / wide + usize::from(frame.top));
                    canvas[4 * (y * width + x)..][..4].copy_from_slice(pixel);
                }
            }
            film.pictures.push(canvas.clone());
            film.delays.push(frame.delay);
        }
        film
    }

    /// The pixels of exactly this colour above the caption: x, y.
    fn of(&self, i: usize, colour: Colour) -> Vec<[f64; 2]> {
        let Colour(r, g, b) = colour;
        let found = self.pictures[i].chunks_exact(4).enumerate();
        found
            .filter(|(i, pixel)| **pixel == [r, g, b, 255] && i / self.width < self.height - 30)
            .map(|(i, _)| [(i % self.width) as f64, (i / self.width) as f64])
            .collect()
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    assert!(!values.is_empty(), "there are such pixels");
    values.iter().sum::<f64>() / values.len() as f64
}

/// Plays `actions` and records them; also returns the observations.
fn record(id: &str, kwargs: &serde_json::Value, actions: &[i64]) -> (Vec<u8>, Vec<Observation>) {
    let mut session = session(id, kwargs);
    let mut recorder = Recorder::new(id, Some(580), session.spec().fps.into());
    let mut seen = vec![session.reset(Some(&Seed::from(0)), None).unwrap()];
    recorder.reset(session.scene(None));
    for &action in actions {
        let played = PlayedAction::Index(action);
        let step = session.step(&played).unwrap();
        let ending = step.terminated.then_some(Ending::Terminated);
        let name = describe(&played, &session.schema().actions);
        recorder.step(session.scene(Some(&played)), &name, step.reward, ending);
        seen.push(step.obs);
    }
    (recorder.finish(), seen)
}

#[test]
fn the_cart_is_where_it_is_and_the_pole_leans_as_it_does() {
    // Pushed to the right until the pole falls to the left.
    let (bytes, seen) = record("CartPole-v1", &json!({}), &[1; 8]);
    let film = Film::decode(&bytes);
    assert_eq!((film.width, film.height), (580, 224));
    // A start of 0.4 s, 50 pictures a second, and an end of 1.2 s.
    assert_eq!(film.delays, [40, 2, 2, 2, 2, 2, 2, 2, 122]);
    let mut before = 0.0;
    for (i, obs) in seen.iter().enumerate() {
        let Observation::Box(obs) = obs else { panic!("CartPole has arrays") };
        // 5.8 m are 580 pixels; the cart's body is as wide on both sides of its middle.
        let cart = mean(film.of(i, INK).iter().map(|p| p[0] + 0.5));
        let expected = 290.0 + 100.0 * f64::from(obs[0]);
        assert!((cart - expected).abs() < 2.0, "picture {i}: {cart}, not {expected}");
        assert!(cart >= before - 0.6, "picture {i}: to the left of the one before");
        before = cart;
        // The pole's middle is half a metre from the axle.
        let pole = film.of(i, ORANGE);
        let middle = mean(pole.iter().map(|p| p[0] + 0.5));
        let expected = expected + 50.0 * runner::mdp::math::sin(obs[2].into());
        assert!((middle - expected).abs() < 2.0, "picture {i}: pole at {middle}, not {expected}");
        let height = pole.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max)
            - pole.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
        assert!(height > 80.0, "picture {i}: the pole is {height} pixels high");
    }
    assert!(before > 300.0, "it has moved");
}

#[test]
fn walkers_glide_from_cell_to_cell() {
    let lake = json!({"is_slippery": false});
    let (bytes, _) = record("FrozenLake-v1", &lake, &[2, 0, 0]);
    let film = Film::decode(&bytes);
    let elf: Vec<f64> = (0..film.pictures.len())
        .map(|i| mean(film.of(i, ORANGE).iter().map(|p| p[0])).round())
        .collect();
    // 4.3 cells are 580 pixels wide; the margin is 0.15 cells.
    let cell = |col: f64| ((col + 0.65) / 4.3 * 580.0).round();
    assert!((elf[0] - cell(0.0)).abs() <= 3.0 && elf[0] == elf[elf.len() - 1], "{elf:?}");
    let right = elf.iter().position(|x| (x - cell(1.0)).abs() <= 3.0).expect("it arrives");
    assert!(right >= 4 && elf[..=right].is_sorted(), "it glides to the right: {elf:?}");
    assert!(elf[right..].iter().rev().is_sorted(), "and back: {elf:?}");
    // Three steps take three quarters of a second, the pushes against the border included.
    let total: u16 = film.delays.iter().sum();
    assert_eq!(total, 40 + 75 + 120);
}

/// Every colour of the picture is a colour of the file: nothing is lost to the palette.
#[test]
fn an_animation_shows_what_the_scene_paints() {
    let (bytes, _) = record("CartPole-v1", &json!({}), &[]);
    let film = Film::decode(&bytes);
    let scene = {
        let mut session = session("CartPole-v1", &json!({}));
        session.reset(Some(&Seed::from(0)), None).unwrap();
        session.scene(None)
    };
    let mut image = runner::render::Image::new(580, 224, Colour(0, 0, 0));
    image.paint(&scene);
    let above = 580 * 195 * 4;
    let worst = image.bytes()[..above]
        .iter()
        .zip(&film.pictures[0][..above])
        .map(|(a, b)| a.abs_diff(*b))
        .max();
    assert!(worst <= Some(12), "off by {worst:?}");
}

/// Printed on x86-64 Linux. The same scenes give the same bytes on every machine; a new version of
/// the rasteriser, the font or the compressor, and every change of the drawing, may change them.
#[test]
fn animations_are_the_same_bytes_everywhere() {
    use sha2::{Digest, Sha256};
    let hash = |id: &str, actions: &[i64]| {
        let digest = Sha256::digest(record(id, &json!({}), actions).0);
        u32::from_be_bytes([digest[0], digest[1], digest[2], digest[3]])
    };
    let hashes =
        [hash("CartPole-v1", &[1, 0, 1]), hash("Blackjack-v1", &[1]), hash("Taxi-v4", &[1])];
    assert_eq!(hashes, [0x7883_8618, 0xb233_22fc, 0x2855_e9c0]);
}

#[test]
fn captions_are_short() {
    let names = ["left".to_owned(), "right".to_owned()];
    assert_eq!(describe(&PlayedAction::Index(1), &names), "right");
    assert_eq!(describe(&PlayedAction::Index(2), &names), "2");
    assert_eq!(describe(&PlayedAction::Box(vec![0.123_456, -1.0]), &names), "0.12 -1.00");
    assert_eq!([number(3.0), number(-0.0), number(-12.345)], ["3", "0", "-12.35"]);
}

#[test]
fn rollouts_are_recorded() {
    let dir = folder();
    let path = dir.path().join("lake.gif");
    let gif = path.to_str().unwrap();
    let args = ["rollout", "FrozenLake-v1", "--actions", "2,2", "--width", "300", "--fps", "10"];
    let output = run(&[&args[..], &["--gif", gif]].concat());
    expect_code(&output, 0);
    assert_eq!(stdout(&output), "", "the picture is enough");
    assert!(stderr(&output).starts_with(&format!("{gif} (")), "{}", stderr(&output));
    let film = Film::decode(&std::fs::read(&path).unwrap());
    assert_eq!(film.width, 300);
    assert_eq!(film.delays.iter().sum::<u16>(), 40 + 20 + 120);
    // Both on request.
    let both = run(&[&args[..], &["--gif", gif, "--format", "jsonl"]].concat());
    assert_eq!(stdout(&both).lines().count(), 3);
}

#[test]
fn a_gif_that_cannot_be_written_is_known_before_anything_is_played() {
    let dir = folder();
    let there = dir.path().to_str().unwrap();
    let nowhere = format!("{there}/no/where.gif");
    for (path, why) in [(there, "it is a folder"), (&nowhere, "there is no folder")] {
        // Playing for so long would take hours.
        let args = ["rollout", "CartPole-v1", "--steps", "4000000000", "--gif", path];
        let output = run(&args);
        expect_code(&output, 2);
        let text = stderr(&output);
        assert!(text.contains(&format!("--gif: `{path}` cannot be written: {why}")), "{text}");
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "nothing is left behind");
    for args in [&["--fps", "51"][..], &["--fps", "0"], &["--fps", "x"], &["--width", "300"]] {
        let output = run(&[&["rollout", "CartPole-v1"], args].concat());
        expect_code(&output, 2);
    }
}

#[test]
fn rollouts_are_drawn_one_below_the_other_where_there_is_no_terminal() {
    let args = ["rollout", "FrozenLake-v1", "--kwargs", "{\"is_slippery\": false}"];
    let output = run(&[&args[..], &["--actions", "2,1", "--format", "ansi"]].concat());
    expect_code(&output, 0);
    assert_eq!(
        stdout(&output),
        "\
reset
┌────────────┐
│[S] ·  ·  · │
│ ·  O  ·  O │
│ ·  ·  ·  O │
│ O  ·  ·  G │
└────────────┘

step 1  right  reward 0  return 0
┌────────────┐
│ S [·] ·  · │
│ ·  O  ·  O │
│ ·  ·  ·  O │
│ O  ·  ·  G │
└────────────┘

step 2  down  reward 0  return 0  terminated
┌────────────┐
│ S  ·  ·  · │
│ · [O] ·  O │
│ ·  ·  ·  O │
│ O  ·  ·  G │
└────────────┘
"
    );
}
