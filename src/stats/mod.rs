//! Statistics over seeds: what a handful of training runs lets one claim, and how surely.
//!
//! Pure functions on slices; nothing here knows what an experiment is.
//!
//! - [`mean`], [`variance`], [`standard_error`], [`quantile`], [`median`], [`iqm`]: descriptions
//! - [`rolling_mean`], [`rolling_mean_at`], [`auc`], [`is_solved`], [`first_solved`]: one learning
//!   curve in numbers
//! - [`interval`], [`interval_with`]: confidence intervals ([`Interval`], [`Method`]) for the mean
//!   and the IQM ([`Estimator`])
//! - [`curve_band`]: learning curves across seeds with a pointwise band ([`CurveBand`])
//! - [`few_seeds_warning`]: what to tell someone who runs too few seeds
//! - [`bootstrap`]: resamples and the limits read from them
//! - [`distributions`]: Student's t and the normal, with their inverses
//!
//! **Non-finite numbers.** A NaN among the values makes a description NaN, as in NumPy; infinities
//! are ordered like any other number. Intervals of values that are not all finite are `None`.

pub mod bootstrap;
mod curve;
mod describe;
pub mod distributions;
mod interval;

pub(crate) use curve::spread;
pub use curve::{
    CurveBand, auc, curve_band, first_solved, is_solved, rolling_mean, rolling_mean_at,
};
pub use describe::{iqm, mean, median, quantile, standard_error, variance};
pub use interval::{
    Estimator, Interval, LEVEL, Method, RESAMPLES, few_seeds_warning, interval, interval_with,
};
