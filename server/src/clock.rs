//! The clock for the time stamps of stored data.

/// The current time, to the millisecond: RFC 3339, UTC.
pub(crate) fn now() -> String {
    let now = jiff::Timestamp::now();
    jiff::Timestamp::from_millisecond(now.as_millisecond()).unwrap_or(now).to_string()
}
