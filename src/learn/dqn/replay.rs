//! Experience replay (Lin 1992; Mnih et al. 2015).

use crate::mdp::Action;
use crate::mdp::streams::Stream;
use crate::nn::Buffer;
use crate::shaping::ActionSet;

/// Actions whose flags fit into one float32 exactly.
const FLAGS: usize = 24;

/// The last transitions, in one allocation of float32: a row each, the oldest overwritten first.
///
/// ```text
/// kept of S [n_kept] | kept of S′ [n_kept] | R | discount of Q(S′, ·) | A | draw | allowed in S′
/// ```
///
/// `draw` is the number of the last minibatch that the row was drawn for, which tells whether it is
/// in the present one already. What a shield allows in S′ is kept only where there is one.
#[derive(Debug, Clone)]
pub struct Replay {
    data: Buffer<f32>,
    n_kept: usize,
    /// Numbers in a row.
    width: usize,
    /// Words of flags at the end of a row.
    n_words: usize,
    capacity: usize,
    len: usize,
    /// Where the next transition goes.
    next: usize,
    /// Minibatches drawn without replacement.
    draws: u32,
}

/// One transition, over one step or several.
#[derive(Debug, Clone, Copy)]
pub struct Experience<'a> {
    /// What is kept of S.
    pub s: &'a [f32],
    /// What was played there.
    pub a: Action,
    /// The discounted sum of the rewards on the way.
    pub reward: f32,
    /// What the value of S′ is multiplied by; 0 if S′ is terminal.
    pub discount: f32,
    /// What is kept of S′; anything if it is terminal.
    pub next: &'a [f32],
    /// What is allowed in S′.
    pub allowed: ActionSet,
}

impl Replay {
    /// Room for `capacity` transitions between states of which `n_kept` numbers are kept, with
    /// the flags of `n_shielded` actions: 0 without a shield.
    ///
    /// # Panics
    /// If there is no room.
    pub fn new(capacity: usize, n_kept: usize, n_shielded: usize) -> Self {
        assert!(capacity > 0, "a buffer holds something");
        let n_words = n_shielded.div_ceil(FLAGS);
        let width = 2 * n_kept + 4 + n_words;
        let data = Buffer::zeros(capacity * width);
        Self { data, n_kept, width, n_words, capacity, len: 0, next: 0, draws: 0 }
    }

    /// Transitions held.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Puts a transition in; returns its place.
    #[inline]
    pub fn push(&mut self, e: &Experience<'_>) -> usize {
        let at = self.next;
        let n = self.n_kept;
        let row = &mut self.data[at * self.width..][..self.width];
        row[..n].copy_from_slice(e.s);
        row[n..2 * n].copy_from_slice(e.next);
        row[2 * n] = e.reward;
        row[2 * n + 1] = e.discount;
        row[2 * n + 2] = e.a as f32;
        row[2 * n + 3] = 0.0;
        for (word, flags) in row[2 * n + 4..].iter_mut().enumerate() {
            *flags = (e.allowed.0 >> (word * FLAGS) & ((1 << FLAGS) - 1)) as f32;
        }
        self.next = if at + 1 == self.capacity { 0 } else { at + 1 };
        self.len = self.len.max(at + 1);
        at
    }

    /// The transition at `place`.
    #[inline]
    pub fn get(&self, place: usize) -> Experience<'_> {
        let n = self.n_kept;
        let row = &self.data[place * self.width..][..self.width];
        let mut allowed = ActionSet::ALL;
        if self.n_words > 0 {
            allowed.0 = 0;
            for (word, flags) in row[2 * n + 4..].iter().enumerate() {
                allowed.0 |= (*flags as u64) << (word * FLAGS);
            }
        }
        Experience {
            s: &row[..n],
            next: &row[n..2 * n],
            reward: row[2 * n],
            discount: row[2 * n + 1],
            a: row[2 * n + 2] as usize,
            allowed,
        }
    }

    /// Draws as many places as `to` has, each transition being as likely as any other.
    pub fn draw(&mut self, stream: &mut Stream, to: &mut [usize]) {
        to.fill_with(|| stream.below(self.len));
    }

    /// The same without drawing any twice.
    ///
    /// # Panics
    /// If there are fewer transitions than are to be drawn.
    pub fn draw_distinct(&mut self, stream: &mut Stream, to: &mut [usize]) {
        assert!(to.len() <= self.len, "{} of {} transitions", to.len(), self.len);
        self.draws += 1;
        for place in to {
            *place = loop {
                let place = stream.below(self.len);
                let draw = &mut self.data[place * self.width + 2 * self.n_kept + 3];
                // The number's bits, which no arithmetic touches.
                if draw.to_bits() != self.draws {
                    *draw = f32::from_bits(self.draws);
                    break place;
                }
            };
        }
    }

    /// The rows held, `[len, width]`, where the next one goes, and how many minibatches were drawn.
    pub fn state(&self) -> (&[f32], [u64; 2]) {
        (&self.data[..self.len * self.width], [self.next as u64, u64::from(self.draws)])
    }

    /// As it was in [`Self::state`]; `None` if that was another buffer's.
    pub fn restore(&mut self, rows: &[f32], [next, draws]: [u64; 2]) -> Option<()> {
        let fits = rows.len().is_multiple_of(self.width) && rows.len() <= self.data.len();
        let len = rows.len() / self.width;
        let next = usize::try_from(next).ok().filter(|next| *next <= len && *next < self.capacity);
        if !fits {
            return None;
        }
        self.data[..rows.len()].copy_from_slice(rows);
        (self.len, self.next, self.draws) = (len, next?, u32::try_from(draws).ok()?);
        Some(())
    }
}
