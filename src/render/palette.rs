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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_stay_as_they_are() {
        let colours = [(Colour(1, 2, 3), 5), (Colour(1, 2, 4), 9), (Colour(200, 0, 0), 1)];
        let (chosen, stand_ins) = choose(&colours, 3);
        assert_eq!(chosen, [Colour(1, 2, 4), Colour(1, 2, 3), Colour(200, 0, 0)]);
        assert_eq!(stand_ins, [1, 0, 2]);
        assert_eq!(choose(&[], 3), (vec![], vec![]));
    }

    #[test]
    fn of_many_colours_the_frequent_ones_stay_and_the_rest_finds_a_neighbour() {
        // Two planes, and all blends between them.
        let [a, b] = [Colour(250, 249, 246), Colour(38, 50, 70)];
        let mut colours: Vec<_> =
            (0..=1000).map(|i| (a.mixed(b, f64::from(i) / 1000.0), 1)).collect();
        colours.sort_unstable();
        colours.dedup();
        for (colour, count) in &mut colours {
            *count = if *colour == a {
                10_000
            } else if *colour == b {
                5_000
            } else {
                1
            };
        }
        let (chosen, stand_ins) = choose(&colours, 16);
        assert!(chosen.len() <= 16 && chosen.len() > 8, "{}", chosen.len());
        assert_eq!(chosen[..2], [a, b]);
        for (&(colour, _), &i) in colours.iter().zip(&stand_ins) {
            // 16 steps between the planes are about 14 apart in each channel.
            assert!(colour.0.abs_diff(chosen[i].0) <= 14, "{colour:?} became {:?}", chosen[i]);
            assert!(i != 0 || colour.0 > 230, "{colour:?} became the background");
        }
        assert_eq!(choose(&colours, 1).0, [a]);
    }
}
