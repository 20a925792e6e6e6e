//! Linear equations `x = b + W x` of one strongly connected component.

use nalgebra::{DMatrix, DVector};

/// Up to this many unknowns a dense decomposition is as fast as anything.
const DENSE: usize = 64;
/// Up to this many a dense decomposition is possible, should nothing else work.
const DENSE_AT_WORST: usize = 2_000;
/// Iterations of the Krylov method before it starts anew: as many as there are unknowns, within
/// these limits.
const ITERATIONS: [usize; 2] = [200, 5_000];
/// Times that it starts anew, and Gauss–Seidel sweeps where it fails.
const RESTARTS: usize = 100;

/// How well to solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Precision {
    /// Until the residual is what rounding makes of it.
    Rounding,
    /// To about 9 digits.
    Rough,
}

/// The equations, split as `(D − L − U) x = b`: the diagonal, what is before it and behind it.
pub(super) struct System {
    b: Vec<f64>,
    diagonal: Vec<f64>,
    lower: Triangle,
    upper: Triangle,
}

/// The entries of a triangle of W, row by row.
struct Triangle {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<f64>,
}

impl Triangle {
    fn new(n: usize) -> Self {
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0);
        Self { offsets, columns: Vec::new(), weights: Vec::new() }
    }

    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        let columns = self.columns[range.clone()].iter().map(|&j| j as usize);
        columns.zip(self.weights[range].iter().copied())
    }

    /// Σ w x over row `i`.
    #[inline]
    fn dot(&self, i: usize, x: &[f64]) -> f64 {
        self.row(i).map(|(j, w)| w * x[j]).sum()
    }
}

impl System {
    /// For `n` unknowns; then come `n` rows.
    pub(super) fn new(n: usize) -> Self {
        Self {
            b: Vec::with_capacity(n),
            diagonal: vec![1.0; n],
            lower: Triangle::new(n),
            upper: Triangle::new(n),
        }
    }

    /// Adds an entry of W to the present row.
    pub(super) fn push(&mut self, column: usize, weight: f64) {
        let row = self.b.len();
        if column == row {
            self.diagonal[row] -= weight;
        } else {
            let side = if column < row { &mut self.lower } else { &mut self.upper };
            side.columns.push(column as u32);
            side.weights.push(weight);
        }
    }

    /// Ends the present row.
    pub(super) fn end_row(&mut self, b: f64) {
        self.b.push(b);
        for side in [&mut self.lower, &mut self.upper] {
            side.offsets.push(side.columns.len() as u32);
        }
    }

    /// Solves; `x` holds a guess. Says whether the equations hold now as well as they were to.
    pub(super) fn solve(&self, x: &mut [f64], precision: Precision) -> bool {
        if x.len() > DENSE && self.iterate(x, precision) {
            return true;
        }
        if x.len() <= DENSE_AT_WORST {
            self.decompose(x);
            return true;
        }
        precision == Precision::Rough
    }

    fn decompose(&self, x: &mut [f64]) {
        let n = x.len();
        let mut matrix = DMatrix::<f64>::zeros(n, n);
        for i in 0..n {
            matrix[(i, i)] = self.diagonal[i];
            for (j, w) in self.lower.row(i).chain(self.upper.row(i)) {
                matrix[(i, j)] = -w;
            }
        }
        match matrix.lu().solve(&DVector::from_column_slice(&self.b)) {
            Some(solution) => x.copy_from_slice(solution.as_slice()),
            None => x.fill(f64::NAN),
        }
    }

    /// Writes `b + W x − x` into `residual`; returns its largest entry, and how large the numbers
    /// are of which it is the sum.
    fn residual(&self, x: &[f64], residual: &mut [f64]) -> (f64, f64) {
        let (mut largest, mut size) = (0.0f64, 0.0f64);
        for (i, r) in residual.iter_mut().enumerate() {
            let known = self.b[i] + self.lower.dot(i, x) + self.upper.dot(i, x);
            let own = self.diagonal[i] * x[i];
            *r = known - own;
            // `max` would overlook what is not a number.
            largest = if r.abs() > largest || r.is_nan() { r.abs() } else { largest };
            size = size.max(self.b[i].abs()).max(own.abs());
        }
        (largest, size)
    }

    /// `y = (D − L)⁻¹ z`: what a Gauss–Seidel sweep does to a residual.
    fn sweep(&self, z: &[f64], y: &mut [f64]) {
        for i in 0..z.len() {
            y[i] = (z[i] + self.lower.dot(i, y)) / self.diagonal[i];
        }
    }

    /// Iterative refinement: each round solves for the error, whose equations have the residual on
    /// the right. Says whether it reached what `precision` asks for.
    fn iterate(&self, x: &mut [f64], precision: Precision) -> bool {
        let tolerance = match precision {
            Precision::Rounding => 4.0 * f64::EPSILON,
            Precision::Rough => 1e-9,
        };
        let n = x.len();
        let (mut residual, mut error) = (vec![0.0; n], vec![0.0; n]);
        let (mut best, mut failures) = (f64::INFINITY, 0);
        let mut krylov = Krylov::new(n);
        for _ in 0..RESTARTS {
            let (norm, size) = self.residual(x, &mut residual);
            if norm <= tolerance * size {
                return true;
            }
            // Beyond this, rounding may be all that is left; another try will tell.
            failures = if norm > 0.5 * best { failures + 1 } else { 0 };
            if failures > 3 {
                return norm <= 64.0 * tolerance * size;
            }
            best = best.min(norm);
            if failures == 0 && krylov.run(self, &residual, 1e-2 * tolerance * size / norm) {
                self.sweep(&krylov.solution, &mut error);
                x.iter_mut().zip(&error).for_each(|(x, e)| *x += e);
            } else {
                for _ in 0..RESTARTS {
                    self.residual(x, &mut residual);
                    self.sweep(&residual, &mut error);
                    x.iter_mut().zip(&error).for_each(|(x, e)| *x += e);
                }
            }
        }
        false
    }
}

/// `BiCGSTAB` (van der Vorst 1992), preconditioned from the right by a Gauss–Seidel sweep: solves
/// `z − U (D − L)⁻¹ z = r`, which goes through the entries once per product (Eisenstat 1981).
struct Krylov {
    solution: Vec<f64>,
    r: Vec<f64>,
    shadow: Vec<f64>,
    p: Vec<f64>,
    v: Vec<f64>,
    t: Vec<f64>,
    swept: Vec<f64>,
}

impl Krylov {
    fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            solution: zeros(),
            r: zeros(),
            shadow: zeros(),
            p: zeros(),
            v: zeros(),
            t: zeros(),
            swept: zeros(),
        }
    }

    /// Runs until the residual has fallen by `factor` (but 1e-10 at most: the next round goes on
    /// from there). Returns whether it fell to a half at least.
    fn run(&mut self, system: &System, right: &[f64], factor: f64) -> bool {
        self.solution.fill(0.0);
        self.r.copy_from_slice(right);
        self.shadow.copy_from_slice(right);
        self.p.copy_from_slice(right);
        let start = dot(right, right);
        let target = start * factor.max(1e-10) * factor.max(1e-10);
        let mut rho = start;
        let mut squared = start;
        for _ in 0..right.len().clamp(ITERATIONS[0], ITERATIONS[1]) {
            if squared <= target {
                break;
            }
            apply(system, &self.p, &mut self.swept, &mut self.v);
            let alpha = rho / dot(&self.shadow, &self.v);
            for (r, v) in self.r.iter_mut().zip(&self.v) {
                *r -= alpha * v;
            }
            apply(system, &self.r, &mut self.swept, &mut self.t);
            let tt = dot(&self.t, &self.t);
            let omega = if tt > 0.0 { dot(&self.t, &self.r) / tt } else { 0.0 };
            if !(alpha.is_finite() && omega.is_finite()) {
                return false;
            }
            for (i, x) in self.solution.iter_mut().enumerate() {
                *x += alpha * self.p[i] + omega * self.r[i];
            }
            for (r, t) in self.r.iter_mut().zip(&self.t) {
                *r -= omega * t;
            }
            squared = dot(&self.r, &self.r);
            let next = dot(&self.shadow, &self.r);
            let beta = next / rho * (alpha / omega);
            if squared <= target || !beta.is_finite() {
                break;
            }
            rho = next;
            for ((p, r), v) in self.p.iter_mut().zip(&self.r).zip(&self.v) {
                *p = r + beta * (*p - omega * v);
            }
        }
        squared <= 0.25 * start
    }
}

/// `out = z − U (D − L)⁻¹ z`.
fn apply(system: &System, z: &[f64], swept: &mut [f64], out: &mut [f64]) {
    system.sweep(z, swept);
    for (i, out) in out.iter_mut().enumerate() {
        *out = z[i] - system.upper.dot(i, swept);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
