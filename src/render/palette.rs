//! From all the colours of an animation to the few that a GIF can hold.

use crate::env::scene::Colour;

/// Chooses at most `most` (at least 1) of `colours` (each with the number of pixels that have it)
/// and says for each of them which of the chosen ones stands for it.
///
/// All of them if they are few. Otherwise from the most frequent one down, each that is far enough
/// from those chosen before; how far is enough is the smallest distance that leaves few enough. The
/// scenes' own colours fill whole planes and come first; blends on edges find a neighbour.
pub(super) fn choose(colours: &[(Colour, u64)], most: usize) -> (Vec<Colour>, Vec<usize>) {
    let mut order: Vec<usize> = (0..colours.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(colours[i].1), colours[i].0));
    let spread = |apart: u32| -> Option<Vec<Colour>> {
        let mut chosen: Vec<Colour> = Vec::new();
        for &i in &order {
            let colour = colours[i].0;
            if chosen.iter().all(|&other| distance(colour, other) >= apart) {
                if chosen.len() == most {
                    return None;
                }
                chosen.push(colour);
            }
        }
        Some(chosen)
    };
    let chosen = spread(1).unwrap_or_else(|| {
        // `low` leaves too many, `high` few enough: at that distance, only the first.
        let (mut low, mut high) = (1, distance(Colour(0, 0, 0), Colour(255, 255, 255)) + 1);
        let mut fitting = vec![colours[order[0]].0];
        while low + 1 < high {
            let middle = low.midpoint(high);
            match spread(middle) {
                Some(chosen) => (fitting, high) = (chosen, middle),
                None => low = middle,
            }
        }
        fitting
    });
    let stand_in = |colour: Colour| {
        let nearest = (0..chosen.len()).min_by_key(|&j| distance(colour, chosen[j]));
        nearest.unwrap_or(0)
    };
    let stand_ins = colours.iter().map(|&(colour, _)| stand_in(colour)).collect();
    (chosen, stand_ins)
}

/// A measure of how different two colours look: squared, with green weighing most.
fn distance(a: Colour, b: Colour) -> u32 {
    let square = |a: u8, b: u8| u32::from(a.abs_diff(b)) * u32::from(a.abs_diff(b));
    3 * square(a.0, b.0) + 4 * square(a.1, b.1) + 2 * square(a.2, b.2)
}
