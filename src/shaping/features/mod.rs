//! From a state's numbers to features, for values that are linear in them: q(s, a) = Σᵢ wᵢₐ xᵢ(s).
//!
//! - [`Tiles`]: tile coding; every state has as many active features as there are tilings
//! - [`Fourier`]: the Fourier basis; every feature is active everywhere
//! - [`FeatureSpec`]: which of the two, over which fields; [`Features`]: one of them, ready for use
//! - [`Active`]: the features of one state

mod fourier;
mod tiles;

use serde::{Deserialize, Serialize};

pub use fourier::Fourier;
pub use tiles::Tiles;

use super::{BinsError, Dim};

/// The most weights that a learner may have, 2^24: that is 128 MB for every thread.
pub const MAX_WEIGHTS: usize = 1 << 24;

/// The kind of features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FeatureKind {
    /// Tile coding with so many tilings.
    Tiles(usize),
    /// The Fourier basis.
    Fourier,
}

/// What features there are.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureSpec {
    /// Their kind.
    pub kind: FeatureKind,
    /// The fields they depend on, with their ranges; `n` is the number of tiles that a tiling has
    /// along the field, or the order of the Fourier basis.
    pub dims: Vec<Dim>,
}

impl FeatureSpec {
    /// How many features there are; `None` if the number is too large for a `usize`.
    pub fn n_features(&self) -> Option<usize> {
        match self.kind {
            FeatureKind::Tiles(tilings) => tiles::n_features(&self.dims, tilings),
            FeatureKind::Fourier => fourier::n_features(&self.dims),
        }
    }
}

impl std::fmt::Display for FeatureSpec {
    /// `8 tilings of 8 × 8 tiles, 648 features`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sizes: Vec<String> = self.dims.iter().map(|d| d.n.to_string()).collect();
        match self.kind {
            FeatureKind::Tiles(tilings) => {
                let plural = if tilings == 1 { "" } else { "s" };
                write!(f, "{tilings} tiling{plural} of {} tiles", sizes.join(" × "))?;
            }
            // One order for all.
            FeatureKind::Fourier => {
                let (order, n) = (sizes.first().map_or("0", String::as_str), sizes.len());
                let plural = if n == 1 { "" } else { "s" };
                write!(f, "Fourier basis of order {order} over {n} field{plural}")?;
            }
        }
        write!(f, ", {} features", self.n_features().unwrap_or(usize::MAX))
    }
}

/// The features of one state that are not 0, in ascending order of nothing but their own: sums over
/// them are always taken in the order in which they stand.
#[derive(Debug, Clone)]
pub struct Active {
    /// Their numbers.
    pub index: Vec<u32>,
    /// Their values xᵢ.
    pub value: Vec<f64>,
    /// What each contributes to a step of size 1 along the gradient: its value times the share of
    /// the step size that the feature gets.
    pub step: Vec<f64>,
}

/// Features of either kind, ready for use.
#[derive(Debug, Clone)]
pub enum Features {
    /// Tile coding.
    Tiles(Tiles),
    /// The Fourier basis.
    Fourier(Fourier),
}

impl Features {
    /// The features that `spec` describes.
    ///
    /// # Errors
    /// If there is no field, one is given twice, has `lo >= hi`, a bound that is not finite or
    /// `n = 0` (tiles), if there is no tiling, or there are more features than [`MAX_WEIGHTS`].
    pub fn new(spec: &FeatureSpec) -> Result<Self, BinsError> {
        let fail = |dim, message: String| Err(BinsError { dim, message });
        if spec.dims.is_empty() {
            return fail(0, "features need at least one field".into());
        }
        for (i, d) in spec.dims.iter().enumerate() {
            if !(d.hi - d.lo).is_finite() {
                return fail(i, format!("a range is finite, not from {} to {}", d.lo, d.hi));
            }
            if d.lo >= d.hi {
                return fail(
                    i,
                    format!("the lower bound {} is not below the upper {}", d.lo, d.hi),
                );
            }
            if spec.dims[..i].iter().any(|before| before.field == d.field) {
                return fail(i, "this field is given twice".into());
            }
            if d.n == 0 && spec.kind != FeatureKind::Fourier {
                return fail(i, "the number of tiles is at least 1, got 0".into());
            }
        }
        if spec.kind == FeatureKind::Tiles(0) {
            return fail(0, "the number of tilings is at least 1, got 0".into());
        }
        if spec.n_features().is_none_or(|n| n > MAX_WEIGHTS) {
            return fail(spec.dims.len() - 1, format!("more than {MAX_WEIGHTS} features"));
        }
        Ok(match spec.kind {
            FeatureKind::Tiles(tilings) => Self::Tiles(Tiles::new(&spec.dims, tilings)),
            FeatureKind::Fourier => Self::Fourier(Fourier::new(&spec.dims)),
        })
    }

    /// Number of features.
    pub fn n_features(&self) -> usize {
        match self {
            Self::Tiles(tiles) => tiles.n_features(),
            Self::Fourier(fourier) => fourier.n_features(),
        }
    }

    /// Whether a feature is 1 or 0 and nothing else, which replacing traces need.
    pub fn is_binary(&self) -> bool {
        matches!(self, Self::Tiles(_))
    }

    /// Room for the features of a state, to be filled by [`Self::see`].
    pub fn active(&self) -> Active {
        match self {
            Self::Tiles(tiles) => tiles.active(),
            Self::Fourier(fourier) => fourier.active(),
        }
    }

    /// Fills `active` with the features of the state that has these fields. Numbers outside of a
    /// field's range count as its nearest end.
    #[inline]
    pub fn see(&self, fields: &[f64], active: &mut Active) {
        match self {
            Self::Tiles(tiles) => tiles.see(fields, active),
            Self::Fourier(fourier) => fourier.see(fields, active),
        }
    }

    /// The share of a step size that `feature` gets, above 0.
    #[inline]
    pub fn share(&self, feature: usize) -> f64 {
        match self {
            Self::Tiles(tiles) => tiles.share(),
            Self::Fourier(fourier) => fourier.share(feature),
        }
    }

    /// The weight of `feature` that gives every state the value `value`, if every feature has its
    /// own such weight.
    pub fn level(&self, feature: usize, value: f64) -> f64 {
        match self {
            Self::Tiles(tiles) => value / tiles.n_tilings() as f64,
            // cos 0 = 1 everywhere, all others waves about 0.
            Self::Fourier(_) if feature == 0 => value,
            Self::Fourier(_) => 0.0,
        }
    }
}
