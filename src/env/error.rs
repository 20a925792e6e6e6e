//! What can be wrong with an environment's id, arguments, options, attributes or actions.

use std::fmt;

use crate::mdp::FiniteMdpError;

/// A mistake in what was asked of an environment, in parts, so that a script host can point its
/// caret at the offending key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnvError {
    /// What is wrong: which argument, what was given, what is allowed.
    pub message: String,
    /// The argument, option or attribute it is about, if it is about one.
    pub key: Option<String>,
    /// What to do instead, if that can be guessed.
    pub hint: Option<String>,
}

impl EnvError {
    /// An error about no key in particular.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), key: None, hint: None }
    }

    /// An error about the argument `key`.
    pub fn about(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { message: message.into(), key: Some(key.into()), hint: None }
    }

    /// Adds advice.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// An error about `key`, which is not among `known`, the `what` (plural) of `owner`.
    pub(super) fn unknown_key(owner: &str, what: &str, key: &str, known: &[&str]) -> Self {
        let message = if known.is_empty() {
            format!("{owner} has no {what}, so no `{key}`")
        } else {
            format!("`{key}` is not among the {what} of {owner}: {}", list(known))
        };
        let error = Self::about(key, message);
        match did_you_mean(key, known.iter().copied()) {
            Some(name) => error.hint(format!("did you mean `{name}`?")),
            None => error,
        }
    }
}

impl fmt::Display for EnvError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        match &self.hint {
            Some(hint) => write!(f, " ({hint})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for EnvError {}

impl From<FiniteMdpError> for EnvError {
    fn from(error: FiniteMdpError) -> Self {
        Self::new(error.0)
    }
}

/// The names, quoted and separated by commas.
pub(super) fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The candidate that `word` is most likely a misspelling of: within a third of its length in
/// edits, upper and lower case being the same. The first one wins a tie.
pub(super) fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let word = word.to_lowercase();
    let distance = |c: &str| strsim::damerau_levenshtein(&word, &c.to_lowercase());
    candidates
        .into_iter()
        .map(|candidate| (distance(candidate), candidate))
        .filter(|&(distance, candidate)| distance <= (candidate.len() / 3).max(1))
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_are_near_and_the_nearest_wins() {
        let names = ["is_slippery", "success_rate", "desc"];
        assert_eq!(did_you_mean("slippery", names), Some("is_slippery"));
        assert_eq!(did_you_mean("sucess_rate", names), Some("success_rate"));
        assert_eq!(did_you_mean("DESC", names), Some("desc"));
        assert_eq!(did_you_mean("gravity", names), None);
    }

    #[test]
    fn unknown_keys_say_what_there_is() {
        let error = EnvError::unknown_key("X-v0", "arguments", "dsc", &["desc", "map_name"]);
        assert_eq!(error.key.as_deref(), Some("dsc"));
        assert_eq!(
            error.to_string(),
            "`dsc` is not among the arguments of X-v0: `desc`, `map_name` (did you mean `desc`?)"
        );
        let error = EnvError::unknown_key("X-v0", "reset options", "low", &[]);
        assert_eq!(error.to_string(), "X-v0 has no reset options, so no `low`");
    }
}
