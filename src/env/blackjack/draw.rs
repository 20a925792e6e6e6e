//! The table: the dealer's cards above, the player's below, and what they count.

use super::{Blackjack, STICK};
use crate::env::actions::PlayedAction;
use crate::env::scene::palette::{BLUE, FELT, INK, RED, SLATE, WHITE, YELLOW};
use crate::env::scene::{Draw, Item, Point, Scene, Shape, Span, Sprite, TextPicture};

/// The size of a card.
const CARD: [f64; 2] = [1.0, 1.4];
/// Where the first cards lie, and where the last ones may.
const FIRST: f64 = 2.3;
const LAST: f64 = 6.3;
/// The heights of the two hands.
const DEALER: f64 = 3.2;
const PLAYER: f64 = 1.1;
/// The pack from which cards come.
const PACK: Point = [7.4, 3.2];

impl Draw for Blackjack {
    const FPS: u32 = 2;

    fn scene(&self, last: Option<&PlayedAction>) -> Scene {
        let mut scene = Scene::new([0.0, 0.0], [8.2, 4.4], FELT);
        scene.stride = 1.5;
        for i in 0..3 {
            let shift = 0.05 * f64::from(i);
            scene.add_at([PACK[0] + shift, PACK[1] - shift], &card(None));
        }
        let open = shows(last);
        let (dealer, player) = self.labels(open);
        for (y, words) in [(DEALER, ["dealer".into(), dealer]), (PLAYER, ["player".into(), player])]
        {
            for (up, text) in [0.2, -0.2].into_iter().zip(words) {
                scene.add(Shape::text([0.9, y + up], 0.34, WHITE, text));
            }
        }
        let hands = [("dealer", DEALER, self.dealer_ranks(open)), ("player", PLAYER, self.ranks())];
        for (name, y, ranks) in hands {
            // Many cards overlap.
            let gap = (LAST - FIRST) / (ranks.len().max(2) - 1) as f64;
            for (number, rank) in ranks.iter().enumerate() {
                let at = [FIRST + number as f64 * gap.min(1.15), y];
                let shapes = card(rank.as_deref());
                let from = Some(PACK);
                scene.items.push(Item::Sprite(Sprite { name, number, at, from, shapes }));
            }
        }
        scene
    }

    fn text(&self, last: Option<&PlayedAction>) -> Option<TextPicture> {
        let open = shows(last);
        let (dealer, player) = self.labels(open);
        let mut lines = hand("dealer", &self.dealer_ranks(open), &dealer);
        lines.extend(hand("player", &self.ranks(), &player));
        Some(TextPicture { lines })
    }
}

impl Blackjack {
    /// What is written on the player's cards.
    fn ranks(&self) -> Vec<Option<String>> {
        self.player_cards().iter().map(|&card| Some(rank(card))).collect()
    }

    /// What is written on the dealer's cards; the second one is hidden unless they are open.
    fn dealer_ranks(&self, open: bool) -> Vec<Option<String>> {
        let face = |i: usize| self.dealer_face().filter(|_| i == 0).map(String::from);
        let cards = self.dealer_cards().iter().enumerate();
        cards
            .map(|(i, &card)| (open || i == 0).then(|| face(i).unwrap_or_else(|| rank(card))))
            .collect()
    }

    /// What the hands count.
    fn labels(&self, open: bool) -> (String, String) {
        let dealer = self.dealer_cards();
        let dealer = match dealer.first() {
            Some(1) if !open => "A + ?".into(),
            Some(first) if !open => format!("{first} + ?"),
            _ => count(dealer),
        };
        (dealer, count(self.player_cards()))
    }
}

/// Whether the dealer has turned the hidden card over.
fn shows(last: Option<&PlayedAction>) -> bool {
    last == Some(&PlayedAction::Index(STICK as i64))
}

fn rank(card: u8) -> String {
    if card == 1 { "A".into() } else { card.to_string() }
}

/// The value of a hand; `soft` if an ace counts 11 in it.
fn count(cards: &[u8]) -> String {
    let sum: u32 = cards.iter().map(|&card| u32::from(card)).sum();
    match sum {
        22.. => format!("{sum} bust"),
        ..=11 if cards.contains(&1) => format!("soft {}", sum + 10),
        _ => sum.to_string(),
    }
}

/// A card around the origin, with its back up if it has no rank to show.
fn card(rank: Option<&str>) -> Vec<Shape> {
    let [width, height] = CARD;
    let mut shapes = vec![Shape::card(width + 0.04, height + 0.04, 0.12, INK)];
    shapes.push(Shape::card(width, height, 0.1, WHITE));
    if let Some(rank) = rank {
        let colour = if rank == "A" { RED } else { INK };
        shapes.push(Shape::text([-0.3, 0.48], 0.3, colour, rank));
        shapes.push(Shape::text([0.0, -0.08], 0.76, colour, rank));
        return shapes;
    }
    shapes.push(Shape::card(width - 0.14, height - 0.14, 0.06, BLUE));
    for (x, y) in
        [-0.24, 0.0, 0.24].into_iter().flat_map(|x| [-0.42, -0.14, 0.14, 0.42].map(|y| (x, y)))
    {
        let d = 0.08;
        let diamond = [[x - d, y], [x, y + d], [x + d, y], [x, y - d]];
        shapes.push(Shape::polygon(diamond, BLUE.mixed(WHITE, 0.5)));
    }
    shapes
}

/// A hand as three lines.
fn hand(name: &str, ranks: &[Option<String>], count: &str) -> Vec<Vec<Span>> {
    let edge = |left: char, middle: &str, right: char| {
        let cards = vec!["───"; ranks.len()].join(middle);
        vec![Span::plain("        "), Span::of(format!("{left}{cards}{right}"), SLATE)]
    };
    let mut line = vec![Span::plain(format!("{name}  ")), Span::of("│", SLATE)];
    for rank in ranks {
        line.push(match rank {
            Some(rank) => {
                Span::of(format!("{rank:^3}"), if rank == "A" { RED } else { INK }).on(WHITE).bold()
            }
            None => Span::of("░░░", WHITE).on(BLUE),
        });
        line.push(Span::of("│", SLATE));
    }
    line.push(Span::of(format!("  {count}"), YELLOW));
    vec![edge('┌', "┬", '┐'), line, edge('└', "┴", '┘')]
}
