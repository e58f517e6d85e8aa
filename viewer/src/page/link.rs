//! The page's address: the fragment describes the view, so that a link restores it.
//!
//! `#v=1&session=s1&tg=0&run=1&step=12&stage=judge&lay=match&L=512.5,300.2,8&off=truth`
//!
//! | key | meaning |
//! |---|---|
//! | `v` | version of the format |
//! | `session` | the session |
//! | `tg`, `run`, `step` | the cursor: target, run, stop |
//! | `stage` | the selected stage |
//! | `lay` | the arrangement of the panels |
//! | `cam` | the camera whose images are shown, `-` for the main pair; omitted: that of the target |
//! | `vs` | the runs compared with it, `target.run` each, separated by commas |
//! | `cmp` | how the left image shows them |
//! | `sort` | the metric by which the table of runs is sorted; with a leading `-` in descending order |
//! | `show` | the filter of the table of runs |
//! | `L`, `R` | centre (px) and magnification of the left and right image; omitted if the whole image is shown |
//!
//! Keys that this version does not know are preserved. A key with an invalid value is dropped and reported; the rest of
//! the link is used.

use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_session::compare::{RUNS_MAX, RunName};

use crate::command::Stage;
use crate::compare;
use crate::drawing::view2d::View2d;
use crate::layout::presets::Preset;

/// The version of the format.
const VERSION: &str = "1";

/// The main pair of cameras; no camera has this name.
const MAIN: &str = "-";

/// Longer fragments are truncated.
const LONGEST: usize = 4_096;

/// Maximum length of the filter of the table of runs, characters.
const WORDS_MAX: usize = 120;

/// The contents of a link.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fragment {
    /// The session.
    pub session: Option<String>,
    /// The target's number.
    pub target: Option<usize>,
    /// The run's number.
    pub run: Option<usize>,
    /// The stop.
    pub step: Option<usize>,
    /// The stage.
    pub stage: Option<Stage>,
    /// The arrangement of the panels.
    pub preset: Option<Preset>,
    /// The camera whose images are shown; `None`: that of the target; `Some(None)`: the main pair.
    pub camera: Option<Option<CameraName>>,
    /// The runs compared with it.
    pub others: Vec<RunName>,
    /// How the left image shows them; `None` shows their marks.
    pub compared: Option<compare::View>,
    /// The sort order of the table of runs; `None` keeps their order.
    pub sort: Option<compare::Sort>,
    /// The filter of the table of runs; `None` shows all.
    pub filter: Option<String>,
    /// The view of the left image.
    pub left: Option<View2d>,
    /// The view of the right image.
    pub right: Option<View2d>,
    /// Parts with unknown keys, unchanged.
    pub unknown: Vec<String>,
    /// Parts with invalid values.
    pub damaged: Vec<String>,
}

impl Fragment {
    /// Parses the part of an address after its `#`.
    pub fn parse(text: &str) -> Self {
        let mut link = Self::default();
        let text: String = text.trim_start_matches('#').chars().take(LONGEST).collect();
        for part in text.split('&').filter(|part| !part.is_empty()) {
            let (key, value) = part.split_once('=').unwrap_or((part, ""));
            if !link.take(key, value) {
                link.damaged.push(part.to_owned());
            }
        }
        link
    }

    /// Stores one part. Returns whether its value is valid.
    fn take(&mut self, key: &str, value: &str) -> bool {
        match key {
            "v" => value == VERSION,
            "session" => put(&mut self.session, Some(value.to_owned()).filter(|id| is_name(id))),
            "tg" => put(&mut self.target, value.parse().ok()),
            "run" => put(&mut self.run, value.parse().ok()),
            "step" => put(&mut self.step, value.parse().ok()),
            "stage" => put(&mut self.stage, Stage::named(value)),
            "lay" => put(&mut self.preset, Preset::ALL.into_iter().find(|preset| preset.word() == value)),
            "cam" => put(&mut self.camera, camera(value)),
            "vs" => runs(value).map(|others| self.others = others).is_some(),
            "cmp" => {
                put(&mut self.compared, compare::View::ALL.into_iter().find(|view| hyphened(*view) == value))
            }
            "sort" => put(&mut self.sort, sort(value)),
            "show" => put(&mut self.filter, unescaped(value)),
            "L" => put(&mut self.left, view(value)),
            "R" => put(&mut self.right, view(value)),
            _ => {
                self.unknown.push(format!("{key}={value}"));
                true
            }
        }
    }

    /// The fragment without its `#`; empty if no session is open.
    pub fn text(&self) -> String {
        let Some(session) = &self.session else { return String::new() };
        let mut parts = vec![format!("v={VERSION}"), format!("session={session}")];
        let number = |key: &str, value: Option<usize>| value.map(|value| format!("{key}={value}"));
        parts.extend(number("tg", self.target));
        parts.extend(number("run", self.run));
        parts.extend(number("step", self.step));
        parts.extend(self.stage.map(|stage| format!("stage={}", stage.word())));
        parts.extend(self.preset.map(|preset| format!("lay={}", preset.word())));
        let word = |camera: Option<CameraName>| camera.map_or(MAIN.to_owned(), |name| name.to_string());
        parts.extend(self.camera.map(|camera| format!("cam={}", word(camera))));
        if !self.others.is_empty() {
            let names: Vec<String> =
                self.others.iter().map(|name| format!("{}.{}", name.target, name.run)).collect();
            parts.push(format!("vs={}", names.join(",")));
        }
        parts.extend(self.compared.map(|view| format!("cmp={}", hyphened(view))));
        if let Some((sort, metric)) = self.sort.as_ref().and_then(|sort| Some((sort, sort.metric.as_ref()?)))
        {
            parts.push(format!("sort={}{metric}", if sort.is_descending { "-" } else { "" }));
        }
        parts.extend(self.filter.as_ref().map(|words| format!("show={}", escaped(words))));
        parts.extend(self.left.and_then(|view| view_text("L", view)));
        parts.extend(self.right.and_then(|view| view_text("R", view)));
        parts.extend(self.unknown.iter().cloned());
        parts.join("&")
    }

    /// Whether going from `before` to here adds an entry to the browser's history: another session, target or run. Steps,
    /// stages and views replace the current entry, so that Back does not undo a drive stop by stop.
    #[cfg(any(test, target_arch = "wasm32"))]
    pub(crate) fn is_another_place(&self, before: &Self) -> bool {
        let place = |link: &Self| (link.session.clone(), link.target, link.run);
        before.session.is_some() && place(self) != place(before)
    }
}

/// Stores a value. Returns whether there is one.
fn put<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    *place = value;
    place.is_some()
}

/// Parses a camera: a name, or `-` for the main pair.
fn camera(value: &str) -> Option<Option<CameraName>> {
    if value == MAIN { Some(None) } else { value.parse().ok().map(Some) }
}

/// Parses compared runs: `0.1,0.2`.
fn runs(value: &str) -> Option<Vec<RunName>> {
    let name = |text: &str| {
        let (target, run) = text.split_once('.')?;
        Some(RunName { target: target.parse().ok()?, run: run.parse().ok()? })
    };
    let names: Vec<RunName> = value.split(',').map(name).collect::<Option<_>>()?;
    (names.len() < RUNS_MAX).then_some(names)
}

/// Parses the sort order of the table of runs: `-ade_px`.
fn sort(value: &str) -> Option<compare::Sort> {
    let (metric, is_descending) = value.strip_prefix('-').map_or((value, false), |metric| (metric, true));
    let is_known = compare::METRICS.iter().any(|(name, ..)| *name == metric);
    is_known.then(|| compare::Sort { metric: Some(metric.to_owned()), is_descending })
}

/// Percent-encodes text, except ASCII letters, digits, `.`, `_` and `-`.
fn escaped(words: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-');
    let escape =
        |byte: u8| if is_plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    words.chars().take(WORDS_MAX).collect::<String>().bytes().map(escape).collect()
}

/// Decodes percent-encoded text; `None` if it is invalid, empty or too long.
fn unescaped(value: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = value.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let mut digit = || char::from(rest.next()?).to_digit(16);
        let (high, low) = (digit()?, digit()?);
        bytes.push((high * 16 + low) as u8);
    }
    let words = String::from_utf8(bytes).ok()?;
    let is_line = !words.is_empty() && !words.chars().any(char::is_control);
    (is_line && words.chars().count() <= WORDS_MAX).then_some(words)
}

fn hyphened(view: compare::View) -> String {
    view.word().replace(' ', "-")
}

fn is_name(id: &str) -> bool {
    !id.is_empty() && id.len() <= 64 && id.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}

/// Parses `x,y,scale`, px and points per px.
fn view(value: &str) -> Option<View2d> {
    let numbers: Vec<f64> = value.split(',').map(|number| number.parse().ok()).collect::<Option<_>>()?;
    match numbers[..] {
        [x, y, scale]
            if numbers.iter().all(|number| number.is_finite()) && (1e-3..=64.0).contains(&scale) =>
        {
            Some(View2d::At { centre: Pixel::new(x, y), scale })
        }
        _ => None,
    }
}

fn view_text(key: &str, view: View2d) -> Option<String> {
    match view {
        View2d::Fit => None,
        View2d::At { centre, scale } => Some(format!("{key}={:.1},{:.1},{scale:.3}", centre.x, centre.y)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_opens_what_it_was_made_of_and_keeps_what_it_does_not_know() {
        let text = "v=1&session=s7&tg=0&run=2&step=12&stage=judge&lay=match&cam=pancam&vs=0.1,1.0&cmp=side-by-side&sort=-ade_px&show=ridge%20ncc_min%3D0.6&L=512.5,300.2,8.000&later=x%20y";
        let link = Fragment::parse(&format!("#{text}"));
        assert_eq!(link.text(), text);
        assert_eq!((link.target, link.run, link.step), (Some(0), Some(2), Some(12)));
        assert_eq!(link.stage, Some(Stage::JUDGE));
        assert_eq!(link.camera, Some(Some("pancam".parse().unwrap())));
        assert_eq!(Fragment::parse("session=s7&cam=-").text(), "v=1&session=s7&cam=-");
        assert_eq!(link.left, Some(View2d::At { centre: Pixel::new(512.5, 300.2), scale: 8.0 }));
        let sort = compare::Sort { metric: Some("ade_px".to_owned()), is_descending: true };
        assert_eq!((link.sort.clone(), link.filter.as_deref()), (Some(sort), Some("ridge ncc_min=0.6")));
        assert_eq!(link.unknown, ["later=x%20y"]);
        assert!(link.damaged.is_empty());
    }

    #[test]
    fn damaged_parts_are_listed_and_the_rest_is_kept() {
        let link = Fragment::parse("#session=s1&step=-4&stage=dance&L=1,2&run=1&lay=&v=2");
        assert_eq!((link.session.as_deref(), link.run, link.step), (Some("s1"), Some(1), None));
        assert_eq!(link.damaged, ["step=-4", "stage=dance", "L=1,2", "lay=", "v=2"]);
        for hostile in [
            "session=../../etc",
            "session=<script>",
            "cam=../x",
            "L=nan,1,2",
            "L=1,2,1e9",
            "tg=1e3",
            "vs=1",
            "vs=0.0,0.1,0.2,0.3",
            "cmp=dance",
            "sort=-no_such_metric",
            "show=%zz",
            "show=%ff",
            "show=a%0Ab",
        ] {
            assert_eq!(Fragment::parse(hostile).damaged, [hostile]);
        }
        assert!(Fragment::parse(&"x=".repeat(1 << 20)).unknown.len() <= LONGEST);
    }

    #[test]
    fn another_run_is_a_place_of_its_own_and_another_step_is_not() {
        let link = |text: &str| Fragment::parse(text);
        let here = link("session=s1&tg=0&run=0&step=3");
        assert!(!link("session=s1&tg=0&run=0&step=4&stage=judge").is_another_place(&here));
        assert!(link("session=s1&tg=0&run=1&step=3").is_another_place(&here));
        assert!(!here.is_another_place(&Fragment::default()), "the first one replaces the bare address");
    }
}
