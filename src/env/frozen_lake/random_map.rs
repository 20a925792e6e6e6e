//! Random maps that have a way from the start to the goal.

use crate::env::EnvError;
use crate::mdp::numpy::{NumpyRng, Seed};

/// Sides of maps: a map of one tile has no room for a start and a goal.
const SIZES: std::ops::RangeInclusive<usize> = 2..=100;

/// Tiles that may be drawn before the search for a map is given up: a tenth of a second.
pub const MAX_TILES: u64 = 10_000_000;

/// Draws square maps of `size` rows, each tile ice with the probability `p` and a hole otherwise,
/// until one has a way over ice from the start in the upper left corner to the goal in the lower
/// right one. The same map as Gymnasium's `generate_random_map(size, p, seed)`.
///
/// Deviations from Gymnasium:
/// 1. A `size` of 1, for which it searches for ever, is refused, and so is one above 100.
/// 2. `p` must be above 0 and at most 1; Gymnasium takes a larger one for 1, a NaN for 1, and
///    searches for ever with 0.
/// 3. The search is given up after [`MAX_TILES`].
///
/// # Errors
/// If `size` or `p` is out of its range, or no map with a way is found.
pub fn generate_random_map(size: usize, p: f64, seed: &Seed) -> Result<Vec<String>, EnvError> {
    random_map_within(size, p, seed, &mut { MAX_TILES })
}

/// [`generate_random_map`] with a limit of its own: no more than `tiles` are drawn, and those that
/// were are taken off.
///
/// # Errors
/// As [`generate_random_map`].
pub fn random_map_within(
    size: usize,
    p: f64,
    seed: &Seed,
    tiles: &mut u64,
) -> Result<Vec<String>, EnvError> {
    if !SIZES.contains(&size) {
        let (low, high) = (SIZES.start(), SIZES.end());
        let message =
            format!("the `size` of a random map must be between {low} and {high}, not {size}");
        return Err(EnvError::about("size", message));
    }
    if !(p > 0.0 && p <= 1.0) {
        let message = format!("the `p` of a random map must be above 0 and at most 1, not {p}");
        return Err(EnvError::about("p", message));
    }
    let mut rng = NumpyRng::from_seed(seed);
    let mut map = vec![b'F'; size * size];
    let mut maps = 0u64;
    while let Some(left) = tiles.checked_sub(map.len() as u64) {
        *tiles = left;
        maps += 1;
        for tile in &mut map {
            *tile = b"FH"[rng.choice_weighted(&[p, 1.0 - p])];
        }
        map[0] = b'S';
        map[size * size - 1] = b'G';
        if has_a_way(&map, size) {
            let row = |row: &[u8]| row.iter().map(|&tile| char::from(tile)).collect();
            return Ok(map.chunks(size).map(row).collect());
        }
    }
    let message = format!(
        "none of {maps} maps of size {size} drawn with p = {p} has a way from the start to the goal"
    );
    Err(EnvError::about("p", message).hint("use a larger p"))
}

/// Whether the last tile can be reached from the first without a hole.
fn has_a_way(tiles: &[u8], size: usize) -> bool {
    let mut seen = vec![false; tiles.len()];
    let mut stack = vec![0];
    seen[0] = true;
    while let Some(at) = stack.pop() {
        let (row, col) = (at / size, at % size);
        let neighbours = [
            (row > 0).then(|| at - size),
            (row + 1 < size).then(|| at + size),
            (col > 0).then(|| at - 1),
            (col + 1 < size).then(|| at + 1),
        ];
        for next in neighbours.into_iter().flatten() {
            if tiles[next] == b'G' {
                return true;
            }
            if tiles[next] != b'H' && !seen[next] {
                seen[next] = true;
                stack.push(next);
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(size: usize, p: f64) -> Result<Vec<String>, EnvError> {
        generate_random_map(size, p, &Seed::from(0))
    }

    #[test]
    fn a_way_goes_along_edges_not_corners() {
        assert!(has_a_way(b"SFHG", 2));
        assert!(!has_a_way(b"SHHG", 2));
        assert!(has_a_way(b"SHFFFFHHFFFFHFHG", 4));
        assert!(!has_a_way(b"SHFFFFHHFFFHHFHG", 4));
    }

    #[test]
    fn bad_arguments_are_named() {
        for (size, p, key, message) in [
            (1, 0.8, "size", "the `size` of a random map must be between 2 and 100, not 1"),
            (101, 0.8, "size", "the `size` of a random map must be between 2 and 100, not 101"),
            (8, 0.0, "p", "the `p` of a random map must be above 0 and at most 1, not 0"),
            (8, 1.5, "p", "the `p` of a random map must be above 0 and at most 1, not 1.5"),
            (8, f64::NAN, "p", "the `p` of a random map must be above 0 and at most 1, not NaN"),
        ] {
            let error = map(size, p).unwrap_err();
            assert_eq!((error.message.as_str(), error.key.as_deref()), (message, Some(key)));
        }
    }

    #[test]
    fn a_hopeless_search_ends() {
        let error = map(30, 0.05).unwrap_err();
        assert_eq!(
            error.to_string(),
            "none of 11111 maps of size 30 drawn with p = 0.05 has a way from the start to the \
             goal (use a larger p)"
        );
        // A small map has a chance: two tiles of ice in one of two places.
        assert_eq!(map(2, 1e-4).unwrap().concat().matches('F').count(), 1);
    }
}
