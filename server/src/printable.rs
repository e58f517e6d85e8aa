//! Sanitises external text for the log and the terminal.

/// `text` with control characters replaced by spaces, so that external text cannot forge lines of the log.
pub(crate) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
