//! The exact model: what a hand becomes by a card, and what the dealer's becomes in the end.
//!
//! The player's hand is known by its sum and whether it has a usable ace: without a usable one an
//! ace can only matter in a sum of at most 10, which no hand with an ace has. The dealer's hidden
//! card is drawn with replacement like the others, so it may as well be drawn after the player has
//! stuck.

use super::{MAX_SUM, Rules, STICK, TEN};
use crate::mdp::{FiniteMdp, FiniteMdpError, Outcome};

/// Values of Gymnasium's second space: 0 (which no card has) to 10.
const DEALERS: usize = TEN as usize + 1;
/// States that are Gymnasium's tuples.
const N_TUPLES: usize = (MAX_SUM as usize + 1) * DEALERS * 2;
/// With a natural for each card of the dealer's.
pub(super) const N_STATES: usize = N_TUPLES + TEN as usize;

/// The index of a sum, the dealer's card and whether there is a usable ace.
#[inline]
pub(super) fn index(player: usize, dealer: usize, ace: bool) -> usize {
    (player * DEALERS + dealer) * 2 + usize::from(ace)
}

/// The index of a natural against the dealer's card.
#[inline]
pub(super) fn natural(dealer: usize) -> usize {
    N_TUPLES + dealer - 1
}

/// The player's sum, the dealer's card, the usable ace, whether it is a natural.
pub(super) fn decode(index: usize) -> (usize, usize, bool, bool) {
    match index.checked_sub(N_TUPLES) {
        Some(i) => (21, i + 1, true, true),
        None => (index / 2 / DEALERS, index / 2 % DEALERS, index % 2 == 1, false),
    }
}

/// Whether a hand can be this and be played: two cards make 4 or more, or 12 or more with a usable
/// ace.
pub(super) fn is_played(player: usize, dealer: usize, ace: bool) -> bool {
    dealer > 0 && (if ace { 12 } else { 4 }..=21).contains(&player)
}

/// Which of a hit's outcomes it is, by the card.
#[inline]
pub(super) fn hit_outcome(card: u8) -> usize {
    usize::from(card) - 1
}

/// Which of sticking's outcomes it is, by the reward: loss, draw, win.
#[inline]
pub(super) fn stick_outcome(reward: f64) -> usize {
    usize::from(reward >= 0.0) + usize::from(reward > 0.0)
}

/// The cards and their probabilities.
fn cards() -> impl Iterator<Item = (usize, f64)> {
    let ten = usize::from(TEN);
    (1..=ten).map(move |card| (card, if card == ten { 4.0 } else { 1.0 } / 13.0))
}

/// The model under `rules`.
///
/// # Errors
/// Never: it is sound.
pub(super) fn model(rules: Rules) -> Result<FiniteMdp, FiniteMdpError> {
    let ends: Vec<Ends> = (0..DEALERS).map(Ends::of).collect();
    let table: Vec<Vec<Vec<Outcome>>> = (0..N_STATES)
        .map(|s| {
            let (player, dealer, ace, natural) = decode(s);
            if !is_played(player, dealer, ace) {
                return vec![vec![outcome(1.0, s, 0.0, true)]; 2];
            }
            let stick = ends[dealer].stick(s, player, natural, rules);
            let mut row = vec![hit(player, dealer, ace); 2];
            row[STICK] = stick;
            row
        })
        .collect();
    FiniteMdp::new(&table, initial())
}

fn outcome(probability: f64, next: usize, reward: f64, terminated: bool) -> Outcome {
    Outcome { probability, next_state: next as u32, reward, terminated }
}

/// One outcome per card.
fn hit(player: usize, dealer: usize, ace: bool) -> Vec<Outcome> {
    cards()
        .map(|(card, probability)| {
            let (next, ace) = with(player, ace, card);
            let bust = next > 21;
            let reward = if bust { -1.0 } else { 0.0 };
            outcome(probability, index(next, dealer, ace), reward, bust)
        })
        .collect()
}

/// A hand with one more card: its sum, and whether there is a usable ace.
fn with(sum: usize, ace: bool, card: usize) -> (usize, bool) {
    let hard = if ace { sum - 10 } else { sum } + card;
    let usable = (ace || card == 1) && hard + 10 <= 21;
    (if usable { hard + 10 } else { hard }, usable)
}

/// How the dealer's hand may end.
struct Ends {
    /// The probability of each sum; 0 stands for every one above 21.
    scores: [f64; 22],
    /// The probability of a natural.
    natural: f64,
}

impl Ends {
    /// From an open card. (From 0, which is none, the result means nothing and is not used.)
    fn of(open: usize) -> Self {
        // The probability that the hand has this hard sum, without and with an ace, at some time:
        // every card raises it, so that in this order each one is complete when it is passed on.
        let mut hands = [[0.0; 2]; 17];
        hands[open][usize::from(open == 1)] = 1.0;
        let mut scores = [0.0; 22];
        for hard in 1..hands.len() {
            for has_ace in [false, true] {
                let reached = hands[hard][usize::from(has_ace)];
                let soft = hard + 10;
                if has_ace && (17..=21).contains(&soft) {
                    scores[soft] += reached;
                    continue;
                }
                for (card, probability) in cards() {
                    let (next, with_ace) = (hard + card, has_ace || card == 1);
                    let p = reached * probability;
                    match next {
                        22.. => scores[0] += p,
                        17.. => scores[next] += p,
                        _ => hands[next][usize::from(with_ace)] += p,
                    }
                }
            }
        }
        let natural = match open {
            1 => 4.0 / 13.0,
            10 => 1.0 / 13.0,
            _ => 0.0,
        };
        Self { scores, natural }
    }

    /// Loss, draw and win of sticking on a sum of `player` in state `s`, impossible ones included.
    fn stick(&self, s: usize, player: usize, natural: bool, rules: Rules) -> Vec<Outcome> {
        let between = |scores: &[f64]| scores.iter().sum::<f64>();
        let (loss, draw, win) = if natural && rules == Rules::SuttonBarto {
            (0.0, self.natural, 1.0 - self.natural)
        } else {
            let draw = self.scores[player];
            (between(&self.scores[player + 1..]), draw, between(&self.scores[..player]))
        };
        let prize = if natural && rules == Rules::Natural { 1.5 } else { 1.0 };
        vec![
            outcome(loss, s, -1.0, true),
            outcome(draw, s, 0.0, true),
            outcome(win, s, prize, true),
        ]
    }
}

/// The probability of each state after two cards each.
fn initial() -> Vec<f64> {
    let mut initial = vec![0.0; N_STATES];
    for (dealer, p) in cards() {
        for (first, q) in cards() {
            for (second, r) in cards() {
                // An ace, if there is one, comes as the second card.
                let (sum, ace) = with(first.max(second), false, first.min(second));
                let state = if sum == 21 { natural(dealer) } else { index(sum, dealer, ace) };
                initial[state] += p * q * r;
            }
        }
    }
    initial
}
