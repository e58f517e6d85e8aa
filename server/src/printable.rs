//! Text from outside, made fit for the log.

/// `text` without control characters, so that what comes from outside cannot write lines of its own into the log.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
