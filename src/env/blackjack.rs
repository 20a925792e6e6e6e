//! `Blackjack-v1`: draw cards to come closer to 21 than the dealer, without going over (Sutton &
//! Barto 2018, example 5.1). The rules and the draws are Gymnasium 1.4.0's, so that a seed gives the
//! same cards; the exact model is computed here.
//!
//! Cards are drawn with replacement: an ace counts 1, or 11 while that does not exceed 21 (then it
//! is *usable*); picture cards count 10.
//!
//! # Action Space
//! `Discrete(2)`: 0 stick, 1 hit (draw a card).
//!
//! # Observation Space
//! `Tuple(Discrete(32), Discrete(11), Discrete(2))`: the player's sum, the dealer's open card (1 to
//! 10), whether the player has a usable ace. Scripts see the fields `player`, `dealer`, `ace`,
//! `index` (the state index) and `natural` (1 if the player holds an ace and a ten and no more).
//!
//! # Rewards
//! At the end 1 for a win, -1 for a loss, 0 for a draw; 0 before. A win with a natural pays 1.5
//! under `natural`; under `sab` a natural wins against everything but a natural.
//!
//! # Starting State
//! Two cards each, one of the dealer's open.
//!
//! # Episode End
//! Terminated when the player sticks or exceeds 21. The dealer then draws up to a sum of 17 or more.
//! There is no time limit.
//!
//! # Arguments
//! - `natural` (false): whether a win with a natural pays 1.5; without effect under `sab`
//! - `sab` (true): the rules of Sutton & Barto, under which a natural wins at once unless the dealer
//!   has one too
//!
//! # Exactness
//! Exact: cards, sums, rewards, and the draws for the suit and the face of the open card, which
//! only a picture would show but which advance the stream.
//!
//! Deviations:
//! 1. There is a finite model ([`Env::finite`]), which Gymnasium does not have; it steps the cards,
//!    not the model. State `(player * 11 + dealer) * 2 + ace` is Gymnasium's tuple, but a natural
//!    has a state of its own, `703 + dealer`: sticking on one can pay otherwise than sticking on
//!    three cards of the same sum, so that the reward is no function of the tuple. Observations do
//!    show the tuple.
//! 2. Stepping on after the end of an episode goes on drawing as in Gymnasium, but of a hand only
//!    the first 22 cards are remembered (no hand that is still played has more).

mod draw;
mod model;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use super::error::EnvError;
use super::kwargs::{KwargKind, KwargSpec, Kwargs};
use super::registered::{Example, Observation, Registered};
use crate::mdp::numpy::NumpyRng;
use crate::mdp::{Action, Env, Field, FiniteMdp, Schema, Step};

const STICK: usize = 0;
const N_ACTIONS: usize = 2;
/// Sums that Gymnasium's space holds: 0 to 31.
const MAX_SUM: u32 = 31;
/// Twenty-one aces and one more card.
const MAX_CARDS: usize = 22;
/// The largest card, and the value of picture cards.
const TEN: u8 = 10;

/// What a natural is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rules {
    /// As much as any other 21.
    Plain,
    /// A win with it pays 1.5.
    Natural,
    /// It wins against everything but another natural.
    SuttonBarto,
}

/// Cards in the order in which they were drawn.
#[derive(Debug, Clone, Copy)]
struct Hand {
    cards: [u8; MAX_CARDS],
    len: usize,
    /// The sum with every ace as 1.
    hard: u32,
    has_ace: bool,
}

impl Hand {
    const EMPTY: Self = Self { cards: [0; MAX_CARDS], len: 0, hard: 0, has_ace: false };

    /// Two cards.
    #[inline]
    fn deal(rng: &mut NumpyRng) -> Self {
        let mut hand = Self::EMPTY;
        hand.draw(rng);
        hand.draw(rng);
        hand
    }

    fn of_cards(cards: &[u8]) -> Self {
        let mut hand = Self::EMPTY;
        for &card in cards {
            hand.add(card);
        }
        hand
    }

    /// A hand that counts `sum` (4 to 21, or 12 to 21 with a usable ace): of two cards if it may
    /// be, and only then a natural.
    fn of_sum(sum: u8, ace: bool, natural: bool) -> Self {
        match (sum, ace) {
            (21, true) if !natural => Self::of_cards(&[1, TEN - 1, 1]),
            (_, true) => Self::of_cards(&[1, sum - 11]),
            (21, false) => Self::of_cards(&[TEN, TEN - 1, 2]),
            (_, false) => Self::of_cards(&[sum - TEN.min(sum - 2), TEN.min(sum - 2)]),
        }
    }

    /// Draws a card and returns it.
    #[inline]
    fn draw(&mut self, rng: &mut NumpyRng) -> u8 {
        // Thirteen ranks, of which four count ten.
        let card = (rng.choice_index(13) as u8 + 1).min(TEN);
        self.add(card);
        card
    }

    #[inline]
    fn add(&mut self, card: u8) {
        if let Some(slot) = self.cards.get_mut(self.len) {
            *slot = card;
        }
        self.len = self.len.saturating_add(1);
        self.hard = self.hard.saturating_add(u32::from(card));
        self.has_ace |= card == 1;
    }

    fn cards(&self) -> &[u8] {
        &self.cards[..self.len.min(MAX_CARDS)]
    }

    #[inline]
    fn has_usable_ace(&self) -> bool {
        self.has_ace && self.hard + 10 <= 21
    }

    #[inline]
    fn sum(&self) -> u32 {
        if self.has_usable_ace() { self.hard + 10 } else { self.hard }
    }

    #[inline]
    fn is_natural(&self) -> bool {
        self.len == 2 && self.sum() == 21
    }

    /// What counts against the other hand: nothing if it is over 21.
    #[inline]
    fn score(&self) -> u32 {
        let sum = self.sum();
        if sum > 21 { 0 } else { sum }
    }
}

/// An observation: Gymnasium's tuple, and what it leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlackjackObs {
    /// The player's sum.
    pub player: u32,
    /// The dealer's open card, 1 to 10.
    pub dealer: u8,
    /// Whether the player has a usable ace.
    pub ace: bool,
    /// Whether the player has a natural.
    pub natural: bool,
    /// Index into the model's outcomes of the transition just taken, if it is one of the model's.
    outcome: Option<u32>,
}

impl From<BlackjackObs> for Observation {
    fn from(obs: BlackjackObs) -> Self {
        Self::Tuple(vec![obs.player.into(), obs.dealer.into(), obs.ace.into()])
    }
}

impl BlackjackObs {
    /// Its state index, unless the sum is beyond what the space holds (after stepping on).
    #[inline]
    fn index(&self) -> Option<usize> {
        if self.natural {
            return Some(model::natural(usize::from(self.dealer)));
        }
        let player = (self.player <= MAX_SUM).then_some(self.player as usize)?;
        Some(model::index(player, usize::from(self.dealer), self.ace))
    }
}

/// The table with both hands. Clones share the model.
#[derive(Debug, Clone)]
pub struct Blackjack {
    rules: Rules,
    mdp: Arc<FiniteMdp>,
    player: Hand,
    dealer: Hand,
    suit: u8,
    face: Option<u8>,
}

impl Blackjack {
    /// A table without cards, to be reset first.
    ///
    /// # Panics
    /// Never: the model is sound.
    pub fn new(rules: Rules) -> Self {
        let mdp = Arc::new(model::model(rules).expect("the model is sound"));
        Self { rules, mdp, player: Hand::EMPTY, dealer: Hand::EMPTY, suit: 0, face: None }
    }

    /// The player's cards in the order in which they came: 1 an ace, 10 a ten or a picture card.
    pub fn player_cards(&self) -> &[u8] {
        self.player.cards()
    }

    /// The dealer's cards, the open one first; the second is hidden while the player plays.
    pub fn dealer_cards(&self) -> &[u8] {
        self.dealer.cards()
    }

    /// The suit of the dealer's open card: `C`, `D`, `H` or `S`.
    pub fn dealer_suit(&self) -> char {
        char::from(b"CDHS"[usize::from(self.suit)])
    }

    /// The face of the dealer's open card if it counts ten: `J`, `Q` or `K`.
    pub fn dealer_face(&self) -> Option<char> {
        self.face.map(|face| char::from(b"JQK"[usize::from(face)]))
    }

    #[inline]
    fn obs(&self, outcome: Option<u32>) -> BlackjackObs {
        BlackjackObs {
            player: self.player.sum(),
            dealer: self.dealer.cards[0],
            ace: self.player.has_usable_ace(),
            natural: self.player.is_natural(),
            outcome,
        }
    }

    /// The reward of comparing the hands.
    #[inline]
    fn compare(&self) -> f64 {
        let (player, dealer) = (self.player.score(), self.dealer.score());
        let reward = f64::from(i8::from(player > dealer) - i8::from(player < dealer));
        match self.rules {
            Rules::SuttonBarto if self.player.is_natural() && !self.dealer.is_natural() => 1.0,
            Rules::Natural if self.player.is_natural() && reward == 1.0 => 1.5,
            _ => reward,
        }
    }
}

impl Env for Blackjack {
    type Obs = BlackjackObs;

    const INDEXED: bool = true;

    fn n_actions(&self) -> usize {
        N_ACTIONS
    }

    #[inline]
    fn reset(&mut self, rng: &mut NumpyRng) -> BlackjackObs {
        self.dealer = Hand::deal(rng);
        self.player = Hand::deal(rng);
        self.suit = rng.choice_index(4) as u8;
        self.face = (self.dealer.cards[0] == TEN).then(|| rng.choice_index(3) as u8);
        self.obs(None)
    }

    #[inline]
    fn step(&mut self, action: Action, rng: &mut NumpyRng) -> Step<BlackjackObs> {
        let before = self.obs(None);
        let (reward, terminated, outcome) = if action == STICK {
            while self.dealer.sum() < 17 {
                self.dealer.draw(rng);
            }
            let reward = self.compare();
            (reward, true, model::stick_outcome(reward))
        } else {
            let card = self.player.draw(rng);
            let bust = self.player.sum() > 21;
            (if bust { -1.0 } else { 0.0 }, bust, model::hit_outcome(card))
        };
        // A hand above 21 is not played on: the model knows nothing of it.
        let state = before.index().filter(|_| before.player <= 21);
        let outcome = state.map(|s| (self.mdp.range(s, action).start + outcome) as u32);
        Step { obs: self.obs(outcome), reward, terminated }
    }

    fn finite(&self) -> Option<&Arc<FiniteMdp>> {
        Some(&self.mdp)
    }

    #[inline]
    fn state_index(&self, obs: &BlackjackObs) -> Option<usize> {
        obs.index()
    }

    fn state(&self, index: usize) -> Option<BlackjackObs> {
        let (player, dealer, ace, natural) = model::decode(index);
        let (player, dealer) = (player as u32, dealer as u8);
        Some(BlackjackObs { player, dealer, ace, natural, outcome: None })
    }

    fn set_index(&mut self, index: usize) -> Option<BlackjackObs> {
        if index >= model::N_STATES {
            return None;
        }
        let (player, dealer, ace, natural) = model::decode(index);
        if !model::is_played(player, dealer, ace) {
            return None;
        }
        self.player = Hand::of_sum(player as u8, ace, natural);
        // The second card is drawn when the player sticks, as it may: with replacement.
        self.dealer = Hand::of_cards(&[dealer as u8]);
        self.face = (dealer as u8 == TEN).then(|| self.face.unwrap_or(0));
        Some(self.obs(None))
    }

    fn outcome_index(&self, obs: &BlackjackObs) -> Option<usize> {
        obs.outcome.map(|i| i as usize)
    }

    fn schema(&self) -> Schema {
        Schema {
            fields: vec![
                Field::int("player", "the player's sum", 0, MAX_SUM as usize),
                Field::int("dealer", "the dealer's open card, 1 an ace", 0, TEN.into()),
                Field::int("ace", "1 if the player has a usable ace, else 0", 0, 1),
                Field::int(
                    "index",
                    "state index: (player * 11 + dealer) * 2 + ace, or 703 + dealer for a natural",
                    0,
                    model::N_STATES - 1,
                ),
                Field::int("natural", "1 if the player has an ace and a ten only, else 0", 0, 1),
            ],
            facts: Vec::new(),
            actions: ["stick", "hit"].map(Into::into).into(),
            grid: None,
        }
    }

    #[inline]
    fn fields(&self, obs: &BlackjackObs, out: &mut [f64]) {
        let index = obs.index().map_or(f64::NAN, |index| index as f64);
        let flag = |flag: bool| f64::from(u8::from(flag));
        let dealer = f64::from(obs.dealer);
        let values = [f64::from(obs.player), dealer, flag(obs.ace), index, flag(obs.natural)];
        for (out, value) in out.iter_mut().zip(values) {
            *out = value;
        }
    }
}

impl Registered for Blackjack {
    const SUMMARY: &'static str = "come closer to 21 than the dealer without going over";

    const EXAMPLE: Example = Example {
        // About what a hand wins: 18.5 is even, and a stiff hand is worse than a low one.
        potential: "if s.player < 12 || s.ace == 1 && s.player < 18 { 0.1 } else { \
                    max(-0.4, 0.25 * (s.player - 18.5)) }",
        bins: "",
    };

    const KWARGS: &'static [KwargSpec] = &[
        KwargSpec {
            name: "natural",
            kind: KwargKind::Bool,
            default: "false",
            doc: "whether a win with an ace and a ten pays 1.5 (without effect under sab)",
        },
        KwargSpec {
            name: "sab",
            kind: KwargKind::Bool,
            default: "true",
            doc: "Sutton & Barto's rules: an ace and a ten win against all but the same",
        },
    ];

    fn from_kwargs(kwargs: &Kwargs) -> Result<Self, EnvError> {
        Ok(Self::new(match (kwargs.bool("sab"), kwargs.bool("natural")) {
            (true, _) => Rules::SuttonBarto,
            (false, true) => Rules::Natural,
            (false, false) => Rules::Plain,
        }))
    }
}
