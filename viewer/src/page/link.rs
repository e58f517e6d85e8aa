//! The page's address: what is looked at, in the fragment, so that a link opens the same again.
//!
//! `#v=1&session=s1&tg=0&run=1&step=12&stage=judge&lay=match&L=512.5,300.2,8&off=truth`
//!
//! | key | meaning |
//! |---|---|
//! | `v` | version of this form |
//! | `session` | the session |
//! | `tg`, `run`, `step` | the cursor: target, run, stop |
//! | `stage` | the stage that is looked at |
//! | `lay` | the arrangement of the panels |
//! | `cam` | the camera of the stops whose images are shown, `-` for the main pair; left out: that of the target |
//! | `vs` | the runs it is compared with, `target.run` each, commas between |
//! | `cmp` | how the left image shows them |
//! | `sort`, `show` | the metric by which the table of runs is sorted (`-` first: the largest comes first), and the words
//! that the runs in it must have |
//! | `L`, `R` | centre (px) and magnification of the left and right image; left out where the whole image is shown |
//!
//! Keys that this version does not know are kept as they are. A key whose value cannot be read is left out, and a
//! sentence says so; nothing else of the link is lost by it.

use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_session::compare::{RUNS_MAX, RunName};

use crate::command::Stage;
use crate::compare;
use crate::drawing::view2d::View2d;
use crate::layout::presets::Preset;

/// The version of the form.
const VERSION: &str = "1";

/// The main pair of cameras; no camera has this name.
const MAIN: &str = "-";

/// Longer fragments are cut: nobody's link is that long.
const LONGEST: usize = 4_096;

/// The longest words by which the runs of the table are chosen, letters.
const WORDS_MAX: usize = 120;

/// What a link says.
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
    /// The camera whose images are shown, where it is not that of the target.
    pub camera: Option<Option<CameraName>>,
    /// The runs it is compared with.
    pub others: Vec<RunName>,
    /// How the left image shows them; none shows their marks.
    pub compared: Option<compare::View>,
    /// How the table of runs is sorted; none leaves the runs in their own order.
    pub sort: Option<compare::Sort>,
    /// The words that the runs of the table must have; none shows all.
    pub filter: Option<String>,
    /// The view of the left image.
    pub left: Option<View2d>,
    /// The view of the right image.
    pub right: Option<View2d>,
    /// What this version does not know, as it came.
    pub unknown: Vec<String>,
    /// Parts that cannot be read.
    pub damaged: Vec<String>,
}

impl Fragment {
    /// What an address says after its `#`.
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

    /// Takes one part; whether its value could be read.
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

    /// The fragment without its `#`; empty where nothing is open.
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

    /// Whether going from `before` to here is a place of its own in the browser's history: another session, target
    /// or run. Steps, stages and views replace what is there, so that Back does not undo a drive stop by stop.
    #[cfg(any(test, target_arch = "wasm32"))]
    pub(crate) fn is_another_place(&self, before: &Self) -> bool {
        let place = |link: &Self| (link.session.clone(), link.target, link.run);
        before.session.is_some() && place(self) != place(before)
    }
}

/// Puts a value where it belongs; whether there was one.
fn put<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    *place = value;
    place.is_some()
}

/// A camera: a name, or the word of the main pair.
fn camera(value: &str) -> Option<Option<CameraName>> {
    if value == MAIN { Some(None) } else { value.parse().ok().map(Some) }
}

/// Compared runs: `0.1,0.2`.
fn runs(value: &str) -> Option<Vec<RunName>> {
    let name = |text: &str| {
        let (target, run) = text.split_once('.')?;
        Some(RunName { target: target.parse().ok()?, run: run.parse().ok()? })
    };
    let names: Vec<RunName> = value.split(',').map(name).collect::<Option<_>>()?;
    (names.len() < RUNS_MAX).then_some(names)
}

/// How the table of runs is sorted: `-ade_px`.
fn sort(value: &str) -> Option<compare::Sort> {
    let (metric, is_descending) = value.strip_prefix('-').map_or((value, false), |metric| (metric, true));
    let is_known = compare::METRICS.iter().any(|(name, ..)| *name == metric);
    is_known.then(|| compare::Sort { metric: Some(metric.to_owned()), is_descending })
}

/// Words as a part of an address: all but letters, digits, `.`, `_` and `-` of ASCII as percent signs and digits.
fn escaped(words: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-');
    let escape =
        |byte: u8| if is_plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    words.chars().take(WORDS_MAX).collect::<String>().bytes().map(escape).collect()
}

/// Such a part as words; none where it is no text, or a long one.
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

/// `x,y,scale`, px and points per px.
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
    fn what_cannot_be_read_is_named_and_takes_nothing_else_with_it() {
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
