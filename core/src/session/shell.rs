//! Commands as a person can paste them into a shell.

use serde_json::Value;

use crate::settings::Changes;

/// A word as a POSIX shell reads it, in quotes where it must be.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Changed settings as arguments of `sightline track` and `sightline export`, each behind a space.
pub fn settings_arguments(changes: &Changes) -> String {
    let argument = |(key, value): (&String, &Value)| {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        format!(" --set {}", quoted(&format!("{key}={value}")))
    };
    changes.iter().map(argument).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_words_that_need_quotes_have_them() {
        assert_eq!(quoted("s1/rows.csv"), "s1/rows.csv");
        assert_eq!(quoted("it's $HOME"), "'it'\\''s $HOME'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn settings_are_given_as_a_person_writes_them() {
        let changes =
            [("ncc_min".to_owned(), Value::from(0.6)), ("tracker".to_owned(), Value::from("features"))];
        assert_eq!(settings_arguments(&changes.into()), " --set ncc_min=0.6 --set tracker=features");
    }
}
