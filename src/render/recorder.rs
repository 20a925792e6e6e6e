//! An episode as an animation, step by step.

use super::font::Face;
use super::gif::Animation;
use super::raster::{Image, height};
use crate::env::PlayedAction;
use crate::env::scene::Scene;
use crate::env::scene::palette::{INK, MIST, WHITE};
use crate::mdp::Ending;

/// How long the first and the last image of an episode stand, in seconds.
const FIRST: f64 = 0.4;
const LAST: f64 = 1.2;
/// Movements between cells: the time of an image, in seconds, and the share of a step that they
/// take.
const GLIDE_FRAME: f64 = 0.04;
const GLIDE_SHARE: f64 = 0.64;
/// The least width that a caption fits into, in pixels.
pub const MIN_WIDTH: u32 = 200;
/// The greatest width, in pixels.
pub const MAX_WIDTH: u32 = 2000;

/// Records episodes: a scene after each reset and each step, with a caption below it.
#[derive(Debug, Clone)]
pub struct Recorder {
    animation: Animation,
    title: String,
    /// None before the first picture, if nobody has said.
    width: Option<u32>,
    /// Seconds per step.
    step: f64,
    before: Option<Scene>,
    steps: u64,
    total: f64,
    /// Whether the last image is the end of an episode, which has stood long enough.
    ended: bool,
}

impl Recorder {
    /// A recorder of pictures `width` pixels wide ([`MIN_WIDTH`] to [`MAX_WIDTH`]; by default what
    /// fits on a slide) at `fps` steps per second. The title stands in the captions.
    pub fn new(title: &str, width: Option<u32>, fps: f64) -> Self {
        Self {
            animation: Animation::new(),
            title: title.into(),
            width: width.map(|width| width.clamp(MIN_WIDTH, MAX_WIDTH)),
            step: 1.0 / fps,
            before: None,
            steps: 0,
            total: 0.0,
            ended: false,
        }
    }

    /// An episode starts.
    pub fn reset(&mut self, scene: Scene) {
        (self.steps, self.total, self.ended) = (0, 0.0, false);
        let image = self.image(&scene, ["", ""]);
        self.animation.frame(image, self.step.max(FIRST));
        self.before = Some(scene);
    }

    /// An action, described in a word or two, led to `scene` and was paid `reward`.
    pub fn step(&mut self, scene: Scene, action: &str, reward: f64, ending: Option<Ending>) {
        self.steps += 1;
        self.total += reward;
        let mut right = format!("step {}  return {}", self.steps, number(self.total));
        if let Some(ending) = ending {
            right = format!("{}  {right}", ending.as_str());
        }
        let mut rest = self.step;
        if let Some(before) = self.before.take().filter(|before| scene.moves(before)) {
            let images = (self.step * GLIDE_SHARE / GLIDE_FRAME).floor();
            for i in 1..images as u32 {
                let share = f64::from(i) / images;
                // Slow at both ends.
                let share = share * share * (3.0 - 2.0 * share);
                let image = self.image(&scene.between(&before, share), [action, &right]);
                self.animation.frame(image, GLIDE_FRAME);
                rest -= GLIDE_FRAME;
            }
        }
        let image = self.image(&scene, [action, &right]);
        self.animation.frame(image, rest);
        self.ended = ending.is_some();
        if self.ended {
            self.animation.hold(LAST);
        }
        self.before = Some(scene);
    }

    /// The animation as it stands.
    pub fn animation(&self) -> &Animation {
        &self.animation
    }

    /// The file. The last image stands for a while.
    pub fn finish(mut self) -> Vec<u8> {
        if !self.ended {
            self.animation.hold(LAST);
        }
        self.animation.finish()
    }

    fn image(&mut self, scene: &Scene, [action, right]: [&str; 2]) -> Image {
        let width = *self.width.get_or_insert_with(|| slide_width(scene));
        let face = Face::fitting(if width >= 560 { 20.0 } else { 16.0 });
        let strip = face.height() + 8;
        // Even, for those who turn the file into a video.
        let high = (height(scene, width) + strip as u32 + 1) & !1;
        let mut image = Image::new(width, high, WHITE);
        let top = high as i32 - strip;
        image.paint(scene);
        image.bar(top, MIST.mixed(WHITE, 0.4));
        let (margin, gap) = (8, face.width("  "));
        let end = width as i32 - margin - face.width(right);
        image.text(end, top + 4, face, INK, right);
        // What happens matters more than where.
        let room = end - margin - gap;
        let full = format!("{}  {action}", self.title);
        let text = [full.trim_end(), action].into_iter().find(|text| face.width(text) <= room);
        image.text(margin, top + 4, face, INK, text.unwrap_or_default());
        image
    }
}

/// The width of pictures of `scene` that fit on a slide, in pixels.
fn slide_width(scene: &Scene) -> u32 {
    const FIT: [f64; 2] = [600.0, 440.0];
    let wide = FIT[1] * scene.size[0] / scene.size[1];
    // Even, as the height.
    ((wide.min(FIT[0]).round() as u32) & !1).clamp(MIN_WIDTH, MAX_WIDTH)
}

/// An action in a word or two: its name, or its numbers.
pub fn describe(action: &PlayedAction, names: &[String]) -> String {
    match action {
        PlayedAction::Index(index) => {
            let name = usize::try_from(*index).ok().and_then(|i| names.get(i));
            name.map_or_else(|| index.to_string(), String::clone)
        }
        PlayedAction::Box(numbers) => {
            numbers.iter().map(|&x| format!("{x:.2}")).collect::<Vec<_>>().join(" ")
        }
    }
}

/// A return: without decimals if it has none, else with two.
pub fn number(x: f64) -> String {
    let text = format!("{x:.2}");
    let short = text.strip_suffix(".00").unwrap_or(&text);
    if short == "-0" { "0".into() } else { short.into() }
}
