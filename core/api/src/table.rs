//! Text cells of CSV tables (RFC 4180), by one rule for exports, studies and the page's tables.
//!
//! A spreadsheet interprets a text that begins with `=`, `+`, `-`, `@`, a tab or a carriage return as a formula. Such a text
//! gets an apostrophe in front, unless it is a number.

use std::borrow::Cow;

/// A text as a cell: never a formula; quoted if the format requires it.
pub fn cell(text: &str) -> String {
    let text = harmless(text);
    if text.is_empty() {
        return String::new();
    }
    let mut line = csv::WriterBuilder::new().from_writer(Vec::new());
    // Writing to memory does not fail; if it did, the cell would be empty.
    let written = line.write_record([text.as_bytes()]).ok().and_then(|()| line.into_inner().ok());
    let written = written.and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default();
    written.trim_end_matches('\n').to_owned()
}

/// The text, with an apostrophe in front if a spreadsheet would interpret it as a formula.
fn harmless(text: &str) -> Cow<'_, str> {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    if is_formula { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) }
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn a_formula_becomes_text_and_a_number_stays() {
        assert_eq!(cell("=1+1"), "'=1+1");
        assert_eq!(cell("-x"), "'-x");
        assert_eq!(cell("@a"), "'@a");
        assert_eq!((cell("-0.5").as_str(), cell("+3").as_str()), ("-0.5", "+3"));
    }

    #[test]
    fn separators_and_quotes_stay_in_one_cell() {
        assert_eq!(cell("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(cell("two\nlines"), "\"two\nlines\"");
        assert_eq!((cell("lost").as_str(), cell("").as_str()), ("lost", ""));
    }
}
