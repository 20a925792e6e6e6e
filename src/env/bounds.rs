//! The reset options of the classic-control environments: `low` and `high`, or one that is the end
//! of a symmetric range.
//!
//! Deviations from Gymnasium:
//! 1. An unknown option is an error; Gymnasium ignores it.
//! 2. The checks come before the seed takes effect: a failed reset changes nothing.

use serde_json::{Map, Value};

use super::error::EnvError;

/// The options that [`parse`] reads.
pub(super) const OPTIONS: &[&str] = &["low", "high"];

/// The bounds between which the initial state is drawn: those in `options`, else `defaults`
/// (low, high).
///
/// As with Gymnasium, a value is whatever Python's `float()` takes (`"0.2"` and `true` included),
/// and equal bounds are allowed.
///
/// # Errors
/// If a value is no number, `low` exceeds `high`, or their difference is not finite.
pub(super) fn parse(
    options: &Map<String, Value>,
    defaults: (f64, f64),
) -> Result<(f64, f64), EnvError> {
    let value = |key: &str, default: f64| match options.get(key) {
        None => Ok(default),
        Some(value) => number(value).ok_or_else(|| {
            EnvError::about(key, format!("the reset option `{key}` must be a number, not {value}"))
        }),
    };
    let (low, high) = (value("low", defaults.0)?, value("high", defaults.1)?);
    let key = if options.contains_key("low") { "low" } else { "high" };
    if low > high {
        let message = format!("the reset option `low` ({low}) must not exceed `high` ({high})");
        return Err(EnvError::about(key, message));
    }
    if !(high - low).is_finite() {
        let message =
            format!("the reset options `low` ({low}) and `high` ({high}) must span a finite range");
        return Err(EnvError::about(key, message));
    }
    Ok((low, high))
}

/// The end x of the symmetric range [-x, x] that the option `key` gives, else `default`.
///
/// # Errors
/// If the value is no number, or not in 0 to half the largest finite one.
pub(super) fn symmetric(
    options: &Map<String, Value>,
    key: &str,
    default: f64,
) -> Result<f64, EnvError> {
    let Some(value) = options.get(key) else { return Ok(default) };
    let refuse = |what: &str| {
        let message = format!("the reset option `{key}` must be a number{what}, not {value}");
        EnvError::about(key, message)
    };
    let end = number(value).ok_or_else(|| refuse(""))?;
    if end >= 0.0 && (end + end).is_finite() {
        Ok(end)
    } else {
        Err(refuse(" of 0 or more that spans a finite range"))
    }
}

/// What Python's `float()` makes of a JSON value.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Bool(flag) => Some(f64::from(u8::from(*flag))),
        Value::Number(number) => number.as_f64(),
        Value::String(text) => text.trim().parse().ok(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn parse_json(options: &Value) -> Result<(f64, f64), String> {
        parse(options.as_object().unwrap(), (-0.05, 0.05)).map_err(|error| error.message)
    }

    #[test]
    fn missing_options_are_defaults() {
        assert_eq!(parse_json(&json!({})), Ok((-0.05, 0.05)));
        assert_eq!(parse_json(&json!({"high": 0.2})), Ok((-0.05, 0.2)));
        assert_eq!(parse_json(&json!({"low": "-0.2"})), Ok((-0.2, 0.05)));
        assert_eq!(parse_json(&json!({"low": 0.0, "high": 0})), Ok((0.0, 0.0)));
        assert_eq!(parse_json(&json!({"high": true})), Ok((-0.05, 1.0)));
    }

    #[test]
    fn symmetric_ranges_are_checked() {
        let parse = |value: Value| {
            let options = json!({"x_init": value});
            symmetric(options.as_object().unwrap(), "x_init", 3.0).map_err(|e| e.message)
        };
        assert_eq!(parse(json!(0)), Ok(0.0));
        assert_eq!(parse(json!("0.5")), Ok(0.5));
        assert_eq!(symmetric(&Map::new(), "x_init", 3.0).unwrap(), 3.0);
        let message = |rest: &str| Err(format!("the reset option `x_init` must be a number{rest}"));
        assert_eq!(parse(json!([])), message(", not []"));
        let range = " of 0 or more that spans a finite range, not ";
        for value in [json!(-1), json!("inf"), json!("nan"), json!(1e308)] {
            assert_eq!(parse(value.clone()), message(&format!("{range}{value}")));
        }
    }

    #[test]
    fn bad_options_say_why() {
        for (options, message) in [
            (json!({"low": "x"}), "the reset option `low` must be a number, not \"x\""),
            (json!({"high": null}), "the reset option `high` must be a number, not null"),
            (json!({"low": 0.2}), "the reset option `low` (0.2) must not exceed `high` (0.05)"),
            (
                json!({"high": "inf"}),
                "the reset options `low` (-0.05) and `high` (inf) must span a finite range",
            ),
            (
                json!({"low": "nan"}),
                "the reset options `low` (NaN) and `high` (0.05) must span a finite range",
            ),
        ] {
            assert_eq!(parse_json(&options), Err(message.into()));
        }
    }
}
