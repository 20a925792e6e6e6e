//! Gradients against central differences.

use super::{Learner, Minibatch, shape};
use crate::mdp::streams::Stream;
use crate::nn::{Kernels, Loss, Mlp};

/// Half the distance between the two points.
const H: f64 = 1e-7;

/// Compares the partial derivatives of some of the parameters.
fn check(layers: &[usize], dueling: bool, rows: usize, loss: Loss) {
    let shape = shape(layers, dueling);
    let mut stream = Stream::new(rows as u64, "differences");
    let mlp = Mlp::<f64>::new(shape.clone(), &mut stream);
    let batch = Minibatch::random(&mut stream, rows, &shape);
    let mut learner = Learner::new(Kernels::detect(), mlp, rows);
    learner.learn(loss, &batch);
    let gradient = learner.gradient.values().to_vec();
    assert!(gradient.iter().any(|g| g.abs() > 1e-3), "{shape:?}: nothing to compare");
    let mut at = |i: usize, by: f64| {
        learner.mlp.params_mut()[i] += by;
        let loss = learner.learn(loss, &batch);
        learner.mlp.params_mut()[i] -= by;
        loss
    };
    // Every parameter of a small network, of a large one as many from everywhere. Padding, which is
    // 0 and has a gradient of 0, is among them.
    let stride = (gradient.len() / 400).max(1);
    for i in (0..gradient.len()).step_by(stride) {
        let difference = (at(i, H) - at(i, -H)) / (2.0 * H);
        let error = (gradient[i] - difference).abs();
        assert!(error < 1e-7, "{shape:?}, {rows} rows, {loss:?}: {i} {} {difference}", gradient[i]);
    }
}

#[test]
fn gradients_are_those_of_the_loss() {
    for loss in [Loss::SquaredError, Loss::Huber] {
        for rows in [1, 3, 8, 64] {
            for dueling in [false, true] {
                check(&[4, 5, 2], dueling, rows, loss);
                check(&[3, 17, 33, 5, 4], dueling, rows, loss);
            }
        }
        check(&[1, 1, 1], false, 3, loss);
        check(&[16, 8, 8, 8], true, 3, loss);
        check(&[33, 17, 17], false, 8, loss);
    }
}

/// What the rows of a minibatch add up to is the mean of what each gives alone.
#[test]
fn the_gradient_of_a_minibatch_is_the_mean_over_its_rows() {
    let shape = shape(&[5, 17, 9, 3], true);
    let mut stream = Stream::new(1, "rows");
    let mlp = Mlp::<f64>::new(shape.clone(), &mut stream);
    let batch = Minibatch::random(&mut stream, 7, &shape);
    let mut together = Learner::new(Kernels::detect(), mlp.clone(), 7);
    together.learn(Loss::Huber, &batch);
    let mut alone = Learner::new(Kernels::detect(), mlp, 1);
    let mut sum = vec![0.0; together.gradient.values().len()];
    for row in 0..7 {
        let one = Minibatch {
            x: batch.x[row * 5..][..5].to_vec(),
            actions: vec![batch.actions[row]],
            targets: vec![batch.targets[row]],
        };
        alone.learn(Loss::Huber, &one);
        for (sum, g) in sum.iter_mut().zip(alone.gradient.values()) {
            *sum += g / 7.0;
        }
    }
    for (g, sum) in together.gradient.values().iter().zip(&sum) {
        assert!((g - sum).abs() < 1e-15, "{g} {sum}");
    }
}
