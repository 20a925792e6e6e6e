//! What a network's action values are moved towards.

use crate::mdp::Action;
use crate::nn::Real;
use crate::shaping::ActionSet;

/// The first of the actions with the largest value among those allowed.
#[inline]
pub fn best<T: Real>(q: &[T], allowed: ActionSet) -> Action {
    let mut best = None;
    for (a, value) in q.iter().enumerate() {
        if allowed.contains(a) && best.is_none_or(|b: Action| *value > q[b]) {
            best = Some(a);
        }
    }
    best.unwrap_or(0)
}

/// The value that a target bootstraps from: `max_a Q⁻(S′, a)` (Mnih et al. 2015), Q⁻ being the
/// target network's; with the action values Q of the network that learns,
/// `Q⁻(S′, argmax_a Q(S′, a))` (van Hasselt, Guez & Silver 2016).
#[inline]
pub fn bootstrap<T: Real>(target: &[T], online: Option<&[T]>, allowed: ActionSet) -> T {
    target[best(online.unwrap_or(target), allowed)]
}

/// The error of `q = Q(S, A)`: `q − (R + discount · value)`, the discount being 0 where S′ is
/// terminal, and whatever is said to be its value then plays no part.
#[inline]
pub fn td_error<T: Real>(q: T, reward: T, discount: T, value: T) -> T {
    let target = if discount == T::default() { reward } else { discount.mul_add(value, reward) };
    q - target
}
