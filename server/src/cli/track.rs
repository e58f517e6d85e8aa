//! `sightline track`: runs the tracker without a browser, with the functions of the server.
//!
//! Writes each step as one line of JSON to the standard output as soon as it is computed, and ends each run with a line
//! `{"summary": …}`. With several targets every line begins with the target's number.

use std::io::{BufWriter, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_recordings::Traverse;
use sightline_recordings::files::{remove_left_overs_of, write_atomically};
use sightline_rover::designate::Place;
use sightline_session::step::RunStep;
use sightline_session::summary::{Summary, summarise};
use sightline_session::track;
use sightline_track::locate::template::compare_searches::compare_searches;
use sightline_track::presets::{preset, validated};
use sightline_track::settings::{Changes, Settings, TrackerKind, parse_assignment};

use super::open;
use super::terminal::{self, Progress};
use crate::columns;
use crate::exports::rows::ExportRow;
use crate::rerun_log::{self, RunLog};
use crate::routes::photometry;

/// Track targets without a browser.
#[derive(Debug, Args)]
pub(super) struct Track {
    /// The traverse: a folder, an index or a scenario.
    traverse: PathBuf,
    /// The position of a target in the left image, px; can be given more than once.
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true,
        required_unless_present_any = ["target_in_rover", "target_in_site"])]
    target: Vec<Pixel>,
    /// The mast angles at which that image was taken, deg; a mismatch is an error.
    #[arg(long, value_name = "AZ,EL", value_parser = angles, allow_hyphen_values = true, requires = "target")]
    mast: Option<MastAngles>,
    /// A target by its point in the rover frame of that stop, m; can be given more than once.
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    target_in_rover: Vec<[f64; 3]>,
    /// A target by its point in the site frame, m; can be given more than once.
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    target_in_site: Vec<[f64; 3]>,
    /// The stop in whose left image the targets are designated.
    #[arg(long, value_name = "N", default_value_t = 0)]
    from_step: usize,
    /// The pair in which the targets are designated and tracked, by its name at that stop; by default the main pair.
    #[arg(long, value_name = "NAME")]
    camera: Option<CameraName>,
    /// The tracker, in its validated preset (sightline, features, shape or combined); with --preset it replaces only the
    /// tracker of that preset. By default the template tracker.
    #[arg(long, value_parser = trackers())]
    tracker: Option<TrackerKind>,
    /// A named configuration from `sightline presets`; --set changes it further.
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// A setting of the tracker, for example ncc_min=0.6; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Also run both searches at every step, and report where coarse-to-fine and exhaustive search differ.
    #[arg(long)]
    compare_searches: bool,
    /// Output format of the steps.
    #[arg(long, default_value = "jsonl")]
    format: Format,
    /// Also write a Rerun recording, a new file.
    #[arg(long, value_name = "FILE")]
    rrd: Option<PathBuf>,
    /// Also write a CSV table; several targets are written one after the other.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Also write a CSV table of the target's illumination: level, exposure, incidence, emission, phase; for one target.
    #[arg(long, value_name = "FILE")]
    photometry: Option<PathBuf>,
}

/// Output format of the steps.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    /// One JSON object per step, then one with the summary.
    Jsonl,
}

/// Parses the name of a tracker.
fn trackers() -> impl TypedValueParser<Value = TrackerKind> {
    let words = TrackerKind::ALL.map(|tracker| PossibleValue::new(tracker.word()).help(tracker.about()));
    let of_word = |word: String| TrackerKind::ALL.into_iter().find(|tracker| tracker.word() == word);
    PossibleValuesParser::new(words).try_map(move |word| of_word(word).ok_or("unknown tracker"))
}

/// The output line of a step.
#[derive(Serialize)]
struct StepLine {
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<usize>,
    #[serde(flatten)]
    row: ExportRow,
}

/// The output line of both searches of a step; only the step number if the step had no search.
#[derive(Serialize)]
struct SearchLine {
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<usize>,
    step: usize,
    searches: Option<Searches>,
}

/// Exhaustive and coarse-to-fine search with the same template.
#[derive(Serialize)]
struct Searches {
    /// Whether both found the same integer pixel.
    is_same: bool,
    /// Distance between the sub-pixel matches, px.
    distance_px: f64,
    exhaustive_score: f64,
    coarse_to_fine_score: f64,
    exhaustive_comparisons: u64,
    coarse_to_fine_comparisons: u64,
}

impl SearchLine {
    fn new(
        target: Option<usize>,
        traverse: &Traverse,
        last: &RunStep,
        next: &RunStep,
        settings: &Settings,
    ) -> Self {
        let pose = traverse.site_from_rover(next.step);
        let found = compare_searches(&last.update.target, next, &pose, &settings.template);
        let searches = found.map(|found| Searches {
            is_same: found.is_same,
            distance_px: found.exhaustive.pixel.distance(found.coarse_to_fine.pixel),
            exhaustive_score: found.exhaustive.score,
            coarse_to_fine_score: found.coarse_to_fine.score,
            exhaustive_comparisons: found.exhaustive_comparisons,
            coarse_to_fine_comparisons: found.search.comparisons,
        });
        Self { target, step: next.step, searches }
    }
}

/// The output line after the last step.
#[derive(Serialize)]
struct SummaryLine<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<usize>,
    summary: &'a Summary,
}

impl Track {
    /// Tracks every target to the last stop.
    ///
    /// # Errors
    /// A traverse, target or setting that does not exist, or a file that cannot be written.
    pub(super) fn run(self) -> Result<()> {
        let settings = self.settings()?;
        let traverse = open::open(&self.traverse, None)?;
        if let Some(path) =
            [&self.rrd, &self.csv, &self.photometry].into_iter().flatten().find(|path| path.exists())
        {
            return Err(Error::format(path, "exists already; choose another name"));
        }
        let mut runs = Vec::new();
        // Designate all targets first, so that a bad one is reported before any long work.
        for place in self.places() {
            runs.push(vec![Arc::new(designate(&traverse, self.from_step, &place, &settings)?)]);
        }
        if self.photometry.is_some() && runs.len() > 1 {
            return Err(Error::Request("--photometry is for one target at a time".to_owned()));
        }
        let several = runs.len() > 1;
        for (number, steps) in runs.iter_mut().enumerate() {
            let target = several.then_some(number);
            follow(&traverse, target, steps, &settings, self.compare_searches)?;
        }
        if let Some(path) = &self.csv {
            write_csv(path, &runs)?;
        }
        if let Some(path) = &self.photometry {
            let table = photometry::table(&traverse, &runs[0], &settings, &AtomicBool::new(false))?;
            remove_left_overs_of(path);
            write_atomically(path, table.as_bytes())?;
        }
        if let Some(path) = &self.rrd {
            write_rrd(path, &traverse, &runs)?;
        }
        Ok(())
    }

    /// The targets: pixels first, then points.
    fn places(&self) -> Vec<Place> {
        let camera = self.camera;
        let pixels = self.target.iter();
        let pixels = pixels.map(|pixel| Place { mast: self.mast, camera, ..Place::of_pixel(*pixel) });
        let in_rover = |point: &[f64; 3]| Place { point_in_rover: Some(*point), camera, ..Place::default() };
        let in_site = |point: &[f64; 3]| Place { point_in_site: Some(*point), camera, ..Place::default() };
        pixels
            .chain(self.target_in_rover.iter().map(in_rover))
            .chain(self.target_in_site.iter().map(in_site))
            .collect()
    }

    fn settings(&self) -> Result<Settings> {
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        let own = match (&self.preset, self.tracker) {
            (Some(name), None) => preset(name)?.settings()?,
            (Some(name), Some(tracker)) => Settings { tracker, ..preset(name)?.settings()? },
            (None, Some(tracker)) => validated(tracker)?.settings()?,
            (None, None) => Settings::default(),
        };
        let settings = own.with(&changes)?;
        terminal::settings_without_effect(&settings, &changes);
        Ok(settings)
    }
}

/// Computes the first step of a run; reports how far the surface is from a point that was given.
fn designate(traverse: &Traverse, step: usize, place: &Place, settings: &Settings) -> Result<RunStep> {
    let named = place.name(traverse, step)?;
    let first = track::designate(traverse, named.designation, settings)?;
    if let Some(gap_m) = named.gap_m(&first) {
        terminal::error(&format!("the surface by stereo is {:.1} cm from the given point", 100.0 * gap_m));
    }
    Ok(first)
}

/// Computes and writes the steps of one run.
fn follow(
    traverse: &Traverse,
    target: Option<usize>,
    steps: &mut Vec<Arc<RunStep>>,
    settings: &Settings,
    compares: bool,
) -> Result<()> {
    let what =
        target.map_or_else(|| "tracked step".to_owned(), |target| format!("target {target}: tracked step"));
    let mut progress = Progress::new(what);
    let first = Arc::clone(&steps[0]);
    let all = traverse.stop_count() - first.step;
    let mut last = Arc::clone(&first);
    loop {
        terminal::line(&json(&StepLine { target, row: last.as_ref().into() })?)?;
        progress.tell(steps.len(), all);
        if last.step + 1 >= traverse.stop_count() {
            break;
        }
        // If a stop cannot be rendered, the step itself reports the fault.
        let camera = first.update.target.designation.camera;
        let _ = traverse.render_camera(last.step + 1, camera, &AtomicBool::new(false));
        let next = Arc::new(track::advance(traverse, &first, &last, settings));
        if compares {
            terminal::line(&json(&SearchLine::new(target, traverse, &last, &next, settings))?)?;
        }
        steps.push(Arc::new(without_images(&next)));
        last = next;
    }
    let summary = summarise(steps.iter().map(AsRef::as_ref));
    terminal::line(&json(&SummaryLine { target, summary: &summary })?)
}

/// A copy without the stop's images, because those of a long drive do not fit into memory.
pub(super) fn without_images(trace: &RunStep) -> RunStep {
    let mut lighter = trace.clone();
    lighter.update.target.memory.set_image(Arc::default());
    if let Some(capture) = lighter.capture_mut() {
        capture.pair = Default::default();
    }
    lighter
}

fn json(line: &impl Serialize) -> Result<String> {
    serde_json::to_string(line).map_err(|error| Error::Request(error.to_string()))
}

fn write_csv(path: &Path, runs: &[Vec<Arc<RunStep>>]) -> Result<()> {
    let unwritable = |source| Error::Write { path: path.to_owned(), source };
    let mut file = BufWriter::new(terminal::new_file(path)?);
    for (number, steps) in runs.iter().enumerate() {
        let rows: Vec<_> = steps.iter().map(|trace| trace.row()).collect();
        let table = columns::csv(&rows);
        let lines = table.lines().enumerate().filter(|(line, _)| number == 0 || *line > 0);
        for (line, text) in lines {
            let named = match (runs.len(), line) {
                (1, _) => String::new(),
                (_, 0) => "target,".to_owned(),
                _ => format!("{number},"),
            };
            writeln!(file, "{named}{text}").map_err(unwritable)?;
        }
    }
    file.into_inner().map_err(|error| unwritable(error.into_error()))?.complete_new()
}

fn write_rrd(path: &Path, traverse: &Traverse, runs: &[Vec<Arc<RunStep>>]) -> Result<()> {
    let labels: Vec<_> = (1..=runs.len()).map(|number| format!("target {number}")).collect();
    let logs: Vec<_> = runs
        .iter()
        .enumerate()
        .map(|(target, steps)| RunLog { target, run: 0, label: &labels[target], steps })
        .collect();
    let mut progress = Progress::new("wrote stop");
    let mut tell = |done, all| {
        progress.tell(done, all);
        ControlFlow::Continue(())
    };
    rerun_log::export(path, &traverse.index().name, traverse, (&logs, None), &mut tell)
}

/// Parses `azimuth,elevation` in degrees.
fn angles(text: &str) -> Result<MastAngles, String> {
    match numbers(text).as_deref() {
        Some([azimuth_deg, elevation_deg]) => Ok(MastAngles {
            azimuth_rad: azimuth_deg.to_radians(),
            elevation_rad: elevation_deg.to_radians(),
        }),
        _ => Err("write it as azimuth,elevation in degrees, for example 12.5,-20".to_owned()),
    }
}

/// Parses `x,y,z`.
fn point(text: &str) -> Result<[f64; 3], String> {
    let point = numbers(text).and_then(|numbers| numbers.try_into().ok());
    point.ok_or_else(|| "write it as x,y,z in metres, for example 8,-1.2,0.1".to_owned())
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|part| part.trim().parse().ok()).collect()
}

/// Parses `x,y`.
pub(super) fn pixel(text: &str) -> Result<Pixel, String> {
    match numbers(text).as_deref() {
        Some([x, y]) => Ok(Pixel::new(*x, *y)),
        _ => Err("write it as x,y in pixels, for example 512.5,300".to_owned()),
    }
}
