//! What is kept of experience and how it is drawn.

use crate::learn::dqn::{Arrival, Experience, NSteps, Replay, SumTree};
use crate::mdp::streams::Stream;
use crate::shaping::ActionSet;

/// The transition whose numbers are all `i`.
fn push(replay: &mut Replay, i: usize) -> usize {
    let number = i as f32;
    let (reward, discount) = (number + 0.25, 1.0 / (number + 1.0));
    let (s, next) = (&[number, -number][..], &[number + 0.5, 0.0][..]);
    replay.push(&Experience { s, a: i, reward, discount, next, allowed: ActionSet(1 + i as u64) })
}

fn fill(replay: &mut Replay, n: usize) {
    for i in 0..n {
        push(replay, i);
    }
}

fn is(replay: &Replay, place: usize, i: usize) -> bool {
    let (e, number) = (replay.get(place), i as f32);
    e.s == [number, -number]
        && e.next == [number + 0.5, 0.0]
        && (e.a, e.reward, e.discount) == (i, number + 0.25, 1.0 / (number + 1.0))
}

#[test]
fn the_oldest_is_overwritten() {
    let mut replay = Replay::new(3, 2, 0);
    assert!(replay.is_empty());
    for (i, place) in [0, 1, 2, 0, 1, 2, 0].into_iter().enumerate() {
        assert_eq!(push(&mut replay, i), place);
        assert_eq!(replay.len(), (i + 1).min(3));
        for before in i.saturating_sub(2)..=i {
            assert!(is(&replay, before % 3, before), "{before} after {i}");
        }
    }
    assert_eq!(replay.get(0).allowed, ActionSet::ALL, "without a shield nothing is refused");
}

/// Σ (n − e)² / e over the counts `n`, which is about their number with a standard deviation of
/// the root of twice that.
fn chi_square(counts: &[u32], expected: &[f64]) -> f64 {
    let parts = counts.iter().zip(expected);
    parts.map(|(n, e)| (f64::from(*n) - e) * (f64::from(*n) - e) / e).sum()
}

#[test]
fn each_transition_is_as_likely_as_any_other() {
    let mut stream = Stream::new(1, "replay");
    let mut replay = Replay::new(50, 2, 0);
    fill(&mut replay, 37);
    for distinct in [false, true] {
        let (mut counts, mut firsts) = ([0u32; 37], [0u32; 37]);
        let mut places = [0; 10];
        let mut repeated = 0;
        for _ in 0..10_000 {
            if distinct {
                replay.draw_distinct(&mut stream, &mut places);
            } else {
                replay.draw(&mut stream, &mut places);
            }
            firsts[places[0]] += 1;
            for place in places {
                counts[place] += 1;
            }
            let mut sorted = places;
            sorted.sort_unstable();
            repeated += u32::from(sorted.windows(2).any(|pair| pair[0] == pair[1]));
        }
        // 36 degrees of freedom: mean 36, standard deviation 8.5. Without replacement it is less.
        let square = chi_square(&counts, &[100_000.0 / 37.0; 37]);
        assert!(square < 90.0, "distinct: {distinct}: {square}");
        let square = chi_square(&firsts, &[10_000.0 / 37.0; 37]);
        assert!((5.0..90.0).contains(&square), "distinct: {distinct}: {square}");
        // With replacement 1 − 37!/27!/37¹⁰ = 74 % of minibatches hold one twice.
        if distinct {
            assert_eq!(repeated, 0);
        } else {
            assert!((7_200..7_700).contains(&repeated), "{repeated}");
        }
    }
    let mut all = [0; 37];
    replay.draw_distinct(&mut stream, &mut all);
    all.sort_unstable();
    assert!(all.iter().enumerate().all(|(i, place)| i == *place), "{all:?}");
}

#[test]
fn what_a_shield_allows_is_kept_for_any_number_of_actions() {
    let mut stream = Stream::new(2, "flags");
    for n in 1..=ActionSet::CAPACITY {
        let mut replay = Replay::new(2, 1, n);
        for i in 0..20 {
            let bits = match i {
                0 => u64::MAX,
                1 => 0,
                2 => 1 << (n - 1),
                _ => stream.next_u64(),
            };
            let allowed = ActionSet(bits);
            let (s, next) = (&[0.0][..], &[1.0][..]);
            let e = Experience { s, a: n - 1, reward: 0.0, discount: 0.0, next, allowed };
            let place = replay.push(&e);
            let kept = replay.get(place);
            assert!(
                (0..n).all(|a| kept.allowed.contains(a) == allowed.contains(a)),
                "{n} {bits:#x}"
            );
            assert_eq!((kept.a, kept.s, kept.next), (n - 1, s, next));
        }
    }
}

#[test]
fn a_buffer_goes_on_where_it_was() {
    let mut stream = Stream::new(3, "replay");
    for held in [0, 4, 7, 19] {
        let mut replay = Replay::new(7, 2, 30);
        fill(&mut replay, held);
        let mut places = [0; 3];
        if held > 3 {
            replay.draw_distinct(&mut stream, &mut places);
        }
        let (rows, state) = replay.state();
        let mut again = Replay::new(7, 2, 30);
        again.restore(rows, state).unwrap();
        let (mut ours, mut theirs) = (stream.clone(), stream.clone());
        for i in held..held + 10 {
            assert_eq!(push(&mut replay, i), push(&mut again, i));
            if replay.len() >= 3 {
                let mut others = [0; 3];
                replay.draw_distinct(&mut ours, &mut places);
                again.draw_distinct(&mut theirs, &mut others);
                assert_eq!(places, others);
            }
        }
        assert_eq!(replay.state(), again.state());
        let bits = |r: &Replay| r.state().0.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&replay), bits(&again));
    }
    let mut other = Replay::new(7, 2, 0);
    let row = [0.0; 8];
    assert!(other.restore(&row, [1, 0]).is_some(), "one row of 2 + 2 + 4 numbers");
    assert!(other.restore(&row[1..], [1, 0]).is_none(), "no whole row");
    assert!(other.restore(&row.repeat(8), [0, 0]).is_none(), "more than there is room for");
    assert!(other.restore(&row, [2, 0]).is_none(), "beyond what is held");
    assert!(other.restore(&row.repeat(7), [7, 0]).is_none(), "beyond the buffer");
}

/// What comes of an episode of rewards 1, 10, 100 in states 0, 1, 2 and then 3: state, reward, and
/// discount.
fn looked_ahead(n: usize, terminated: bool) -> Vec<(f32, f32, f32, f32)> {
    let mut window = NSteps::new(n, 0.5, 1);
    let mut all = Vec::new();
    // Twice: nothing is left of the first.
    for _ in 0..2 {
        all.clear();
        for (i, reward) in [1.0, 10.0, 100.0].into_iter().enumerate() {
            let (kept, last) = ([i as f32 + 1.0], i == 2);
            let allowed = ActionSet(1 << i);
            let arrival = Arrival { kept: &kept, allowed, terminated: last && terminated };
            window.step(&[i as f32], i, reward, arrival, last, |e| {
                assert_eq!(e.a as f32, e.s[0]);
                assert_eq!(e.allowed.0, 1 << (e.next[0] as u64 - 1));
                all.push((e.s[0], e.reward, e.discount, e.next[0]));
            });
        }
    }
    all
}

#[test]
fn several_rewards_by_hand() {
    let one = [(0.0, 1.0, 0.5, 1.0), (1.0, 10.0, 0.5, 2.0), (2.0, 100.0, 0.5, 3.0)];
    assert_eq!(looked_ahead(1, false), one);
    let mut ends = one;
    ends[2].2 = 0.0;
    assert_eq!(looked_ahead(1, true), ends);
    let two = [(0.0, 6.0, 0.25, 2.0), (1.0, 60.0, 0.25, 3.0), (2.0, 100.0, 0.5, 3.0)];
    assert_eq!(looked_ahead(2, false), two);
    // The whole episode, and longer than it is: γ³, γ², γ of what follows its last state.
    for n in [3, 4, 9] {
        let whole = [(0.0, 31.0, 0.125, 3.0), (1.0, 60.0, 0.25, 3.0), (2.0, 100.0, 0.5, 3.0)];
        assert_eq!(looked_ahead(n, false), whole);
        assert_eq!(looked_ahead(n, true), whole.map(|(s, r, _, next)| (s, r, 0.0, next)));
    }
}

#[test]
fn transitions_are_drawn_in_proportion_to_their_priorities() {
    let priorities = [0.5, 3.0, 0.0, 1.0, 0.01, 2.5, 1.99];
    let mut tree = SumTree::new(priorities.len());
    for (place, priority) in priorities.into_iter().enumerate() {
        // What was there before is forgotten.
        tree.set(place, 7.0);
        tree.set(place, priority);
    }
    assert!((tree.total() - 9.0).abs() < 1e-15);
    let mut stream = Stream::new(4, "tree");
    let mut counts = [0u32; 7];
    for _ in 0..90_000 {
        counts[tree.find(stream.uniform() * tree.total(), 7)] += 1;
    }
    assert_eq!(counts[2], 0);
    let expected: Vec<f64> = priorities.iter().map(|p| p * 10_000.0).collect();
    let drawn = |i: &usize| *i != 2;
    let counts: Vec<u32> = (0..7).filter(drawn).map(|i| counts[i]).collect();
    let expected: Vec<f64> = (0..7).filter(drawn).map(|i| expected[i]).collect();
    // 5 degrees of freedom: mean 5, standard deviation 3.2.
    let square = chi_square(&counts, &expected);
    assert!(square < 30.0, "{square}: {counts:?}");
}
