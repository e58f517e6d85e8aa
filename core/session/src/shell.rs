//! Commands to paste into a shell.

use serde_json::Value;

use sightline_track::settings::Changes;
use sightline_track::target::Designation;

/// Quotes a word for a POSIX shell if necessary.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Changed settings as arguments of `sightline track` and `sightline export`, each preceded by a space.
pub(crate) fn settings_arguments(changes: &Changes) -> String {
    let argument = |(key, value): (&String, &Value)| {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        format!(" --set {}", quoted(&format!("{key}={value}")))
    };
    changes.iter().map(argument).collect()
}

/// The command that designates a target and tracks it; `drive` is the argument that names the drive.
pub fn track(drive: &str, designation: Designation, changes: &Changes) -> String {
    let Designation { step, pixel, camera } = designation;
    let camera = camera.map_or_else(String::new, |camera| format!(" --camera {camera}"));
    let from = if step == 0 { String::new() } else { format!(" --from-step {step}") };
    let settings = settings_arguments(changes);
    format!("sightline track {} --target {},{}{camera}{from}{settings}", quoted(drive), pixel.x, pixel.y)
}

/// Writes the header with the access token; `printf` is a shell built-in, so the token is not visible to other users.
pub const WITH_TOKEN: &str = "printf 'Authorization: Bearer %s' \"$SIGHTLINE_TOKEN\"";

/// An HTTP request, as a `curl` command.
#[derive(Clone, Copy, Debug)]
pub struct Curl<'a> {
    /// Its method.
    pub method: &'a str,
    /// Its complete URL.
    pub url: &'a str,
    /// Its JSON body; `None` without one.
    pub body: Option<&'a str>,
    /// The revision for `If-Match`; `None` without the header.
    pub revision: Option<u64>,
    /// The output file; `None` for standard output.
    pub file: Option<&'a str>,
}

impl Curl<'_> {
    /// The command; it prints errors only, and fails on HTTP errors. The page does not have the access token: the shell
    /// reads it from `SIGHTLINE_TOKEN` and passes it by standard input, because all users can see a program's arguments.
    pub fn text(&self) -> String {
        let mut text = format!("{WITH_TOKEN} | curl -fsS -H @-");
        if self.method != "GET" {
            text.push_str(&format!(" -X {}", self.method));
        }
        if let Some(file) = self.file {
            text.push_str(&format!(" -o {}", quoted(file)));
        }
        text.push_str(&format!(" {}", quoted(self.url)));
        if let Some(revision) = self.revision {
            text.push_str(&format!(" -H {}", quoted(&format!("If-Match: \"{revision}\""))));
        }
        if let Some(body) = self.body {
            // Raw, because `--data` reads a file if the body begins with @.
            text.push_str(&format!(" -H 'Content-Type: application/json' --data-raw {}", quoted(body)));
        }
        text
    }
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
