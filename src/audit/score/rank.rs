//! Rank correlation.

/// Spearman's rank correlation ρ of two samples: the correlation of their ranks, the tied taking the
/// mean of theirs. Neighbours within `tolerance` of each other are tied.
///
/// `None` if the ranks of a sample are all equal, or a value is not a number.
///
/// # Panics
/// If the samples differ in length.
pub fn spearman(a: &[f64], b: &[f64], tolerance: f64) -> Option<f64> {
    assert_eq!(a.len(), b.len(), "a rank correlation needs pairs");
    if a.iter().chain(b).any(|x| x.is_nan()) {
        return None;
    }
    let middle = f64::midpoint(1.0, a.len() as f64);
    let (a, b) = (ranks(a, tolerance), ranks(b, tolerance));
    let (mut product, mut squares_a, mut squares_b) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(&b) {
        product += (a - middle) * (b - middle);
        squares_a += (a - middle) * (a - middle);
        squares_b += (b - middle) * (b - middle);
    }
    (squares_a > 0.0 && squares_b > 0.0).then(|| product / (squares_a * squares_b).sqrt())
}

/// The rank of each value, from 1.
fn ranks(values: &[f64], tolerance: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut ranks = vec![0.0; values.len()];
    let mut before = 0;
    // Equal infinities differ by no number, and are tied all the same.
    let tied =
        |i: &usize, j: &usize| values[*i] == values[*j] || values[*j] - values[*i] <= tolerance;
    for group in order.chunk_by(tied) {
        let rank = before as f64 + f64::midpoint(1.0, group.len() as f64);
        for &i in group {
            ranks[i] = rank;
        }
        before += group.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let rho = |a: &[f64], b: &[f64]| spearman(a, b, 0.0);
        assert_eq!(rho(&[1.0, 2.0, 3.0], &[10.0, 20.0, 21.0]), Some(1.0));
        assert_eq!(rho(&[1.0, 2.0, 3.0], &[0.0, -1.0, -9.0]), Some(-1.0));
        // 1 − 6 Σd² / (n (n² − 1)) with d = (1, −1, 0, 0), without ties.
        assert_eq!(rho(&[1.0, 2.0, 3.0, 4.0], &[2.0, 1.0, 3.0, 4.0]), Some(0.8));
        // Ranks 1.5 1.5 3 against 1 2 3: 1.5 / √(1.5 · 2).
        let tied = rho(&[5.0, 5.0, 7.0], &[1.0, 2.0, 3.0]).unwrap();
        assert!((tied - 0.866_025_403_784_438_6).abs() < 1e-15);
        assert_eq!(rho(&[5.0, 5.0], &[1.0, 2.0]), None);
        assert_eq!(rho(&[f64::NAN, 5.0], &[1.0, 2.0]), None);
        assert_eq!(rho(&[], &[]), None);
    }

    #[test]
    fn rounding_makes_no_ranks() {
        assert_eq!(ranks(&[0.3, 0.1 + 0.2, 0.5], 1e-12), [1.5, 1.5, 3.0]);
        assert_eq!(ranks(&[f64::INFINITY, 1.0, f64::INFINITY], 1e-12), [2.5, 1.0, 2.5]);
    }
}
