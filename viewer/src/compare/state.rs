//! The runs that are compared with the selected one, their aligned stops, and the server's comparison.

use std::collections::BTreeMap;

use egui::Color32;
use sightline_geometry::frames::Pixel;
use sightline_session::compare::{Alignment, Comparison, RUNS_MAX, RunName, Tolerance};
use sightline_session::metrics::{Metric, RunMetrics};
use sightline_session::step::{RunStep, StepRow};
use sightline_session::view::{RunView, TargetView};
use sightline_track::trace::ArrayName;

use crate::cache::{ImageSide, Key, Slot, StepKey};
use crate::drawing::overlay::{Mark, run_mark};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::View2d;
use crate::state::{State, row_of, run_letter};
use crate::theme;

/// Magnification of a stabilised target unless the user chose one.
const HELD_SCALE: f64 = 4.0;

/// Colour and shape of a run's marks in all panels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunStyle {
    /// The colour.
    pub colour: Color32,
    /// The shape.
    pub mark: Mark,
}

/// A run that is compared with the selected one.
#[derive(Clone, Copy)]
pub struct Other<'a> {
    /// Numbers of its target and run.
    pub name: RunName,
    /// Its target.
    pub target: &'a TargetView,
    /// The run.
    pub run: &'a RunView,
    /// Colour and shape of its marks.
    pub style: RunStyle,
}

impl State {
    /// The selected run.
    pub fn own_name(&self) -> Option<RunName> {
        self.run().and(self.cursor.target).map(|target| RunName { target, run: self.cursor.run })
    }

    /// The run with this identifier, and its target.
    pub(crate) fn run_named(&self, name: RunName) -> Option<(&TargetView, &RunView)> {
        let target = self.session.as_ref()?.targets.iter().find(|target| target.number == name.target)?;
        Some((target, target.runs.iter().find(|run| run.number == name.run)?))
    }

    /// All runs of the session.
    pub(crate) fn all_runs(&self) -> impl Iterator<Item = (RunName, &TargetView, &RunView)> {
        let targets = self.session.iter().flat_map(|session| &session.targets);
        targets.flat_map(|target| {
            target
                .runs
                .iter()
                .map(move |run| (RunName { target: target.number, run: run.number }, target, run))
        })
    }

    /// The label of a run: its letter, preceded by its target unless that is selected.
    pub(crate) fn run_label(&self, name: RunName) -> String {
        let letter = run_letter(name.run);
        match self.run_named(name) {
            Some((target, _)) if Some(name.target) != self.cursor.target => {
                format!("{} · run {letter}", target.label)
            }
            _ => format!("run {letter}"),
        }
    }

    /// The compared runs. Each has the colour and shape of its run number, unless an earlier run has them.
    pub fn others(&self) -> Vec<Other<'_>> {
        let Some(own) = self.own_name() else { return Vec::new() };
        let mut taken = vec![own.run % RUNS_MAX];
        let mut others = Vec::new();
        for &name in self.compare.others.iter().filter(|&&name| name != own) {
            let Some((target, run)) = self.run_named(name) else { continue };
            let number = (0..RUNS_MAX).map(|i| (name.run + i) % RUNS_MAX).find(|n| !taken.contains(n));
            let number = number.unwrap_or(name.run);
            taken.push(number);
            let style = RunStyle { colour: theme::run(number), mark: run_mark(number) };
            others.push(Other { name, target, run, style });
        }
        others
    }

    /// Colour and shape of the selected run's marks.
    pub fn own_style(&self) -> RunStyle {
        RunStyle { colour: theme::run(self.cursor.run), mark: run_mark(self.cursor.run) }
    }

    /// Whether the selected run is compared with another.
    pub fn is_comparing(&self) -> bool {
        self.own_name().is_some_and(|own| {
            self.compare.others.iter().any(|&name| name != own && self.run_named(name).is_some())
        })
    }

    /// The server's comparison; `None` until received.
    pub fn comparison(&self) -> Option<&Comparison> {
        let (request, answer) = self.compare.answer.as_ref()?;
        // An answer about other runs or another alignment does not apply.
        (Some(&request.new.runs) == self.compared_names().as_ref() && request.new.align == self.compare.align)
            .then_some(answer.as_ref().ok())
            .flatten()
    }

    /// Why the server refused the comparison.
    pub fn comparison_problem(&self) -> Option<&str> {
        self.compare.answer.as_ref().and_then(|(_, answer)| answer.as_ref().err()).map(String::as_str)
    }

    /// The selected run followed by the compared ones; `None` if there are none.
    pub(crate) fn compared_names(&self) -> Option<Vec<RunName>> {
        let own = self.own_name()?;
        let names: Vec<RunName> =
            std::iter::once(own).chain(self.others().iter().map(|other| other.name)).collect();
        (names.len() > 1).then_some(names)
    }

    /// The stop of another run that is aligned with a stop of the selected run.
    pub fn aligned_step(&self, other: RunName, step: usize) -> Option<usize> {
        if self.compare.align == Alignment::Step {
            return Some(step);
        }
        let (comparison, at) = self.place_of(other)?;
        comparison.moments.iter().find(|moment| moment.steps[0] == Some(step))?.steps[at]
    }

    /// The stop of the selected run that is aligned with a stop of another run.
    pub fn own_aligned_step(&self, other: RunName, step: usize) -> Option<usize> {
        if self.compare.align == Alignment::Step {
            return Some(step);
        }
        let (comparison, at) = self.place_of(other)?;
        comparison.moments.iter().find(|moment| moment.steps[at] == Some(step))?.steps[0]
    }

    fn place_of(&self, other: RunName) -> Option<(&Comparison, usize)> {
        let comparison = self.comparison()?;
        Some((comparison, comparison.runs.iter().position(|&name| name == other)?))
    }

    /// The row of another run aligned with the cursor's step.
    pub(crate) fn other_row(&self, other: &Other<'_>) -> Option<&StepRow> {
        let (_, run) = self.run_named(other.name)?;
        row_of(run, self.aligned_step(other.name, self.cursor.step)?)
    }

    pub(crate) fn other_key(&self, other: RunName, step: usize) -> Option<StepKey> {
        let session = self.session.as_ref()?.id.clone();
        Some(StepKey { session, target: other.target, run: other.run, step })
    }

    /// The record of another run aligned with the cursor's step.
    pub fn other_trace(&self, other: RunName) -> Slot<'_, RunStep> {
        let step = self.aligned_step(other, self.cursor.step);
        let key = step.and_then(|step| self.other_key(other, step));
        key.map_or(Slot::Absent, |key| self.cache.trace(&key))
    }

    /// An array of another run, of the stop aligned with the cursor's step.
    pub(crate) fn other_array(&self, other: RunName, name: ArrayName) -> Slot<'_, Raster> {
        let step = self.aligned_step(other, self.cursor.step);
        let key = step.and_then(|step| self.other_key(other, step)).map(|key| Key::Array(key, name));
        key.map_or(Slot::Absent, |key| self.cache.raster(&key))
    }

    /// The left image of another run, of the stop aligned with the cursor's step.
    pub(crate) fn other_image(&self, other: RunName) -> Slot<'_, Raster> {
        let step = self.aligned_step(other, self.cursor.step);
        let camera = self.camera_of(other);
        let key = step.and_then(|step| self.image_key_in(step, camera, ImageSide::Left));
        key.map_or(Slot::Absent, |key| self.cache.raster(&key))
    }

    /// The tolerance within which values count as equal.
    pub fn tolerance(&self) -> Tolerance {
        Tolerance::new(&self.tolerances()).unwrap_or_default()
    }

    /// The tolerances by unit.
    pub(crate) fn tolerances(&self) -> BTreeMap<String, f64> {
        self.compare.tolerance.tolerances().iter().map(|(unit, value)| ((*unit).to_owned(), *value)).collect()
    }

    /// The metrics of a run; `None` until loaded.
    pub fn metrics(&self, name: RunName) -> Option<&RunMetrics> {
        self.compare.metrics.get(&name)?.1.as_ref().ok()
    }

    /// Why a run's metrics cannot be shown.
    pub(crate) fn metrics_problem(&self, name: RunName) -> Option<&str> {
        self.compare.metrics.get(&name)?.1.as_ref().err().map(String::as_str)
    }

    /// One metric of a run.
    pub fn metric(&self, name: RunName, metric: &str) -> Option<&Metric> {
        self.metrics(name)?.metrics.iter().find(|found| found.name == metric)
    }

    /// The visible region of the left image; centred on the target if it is stabilised.
    pub(crate) fn stabilised_view(&self, view: View2d, trace: Option<&RunStep>) -> View2d {
        match trace.and_then(place_of_target).filter(|_| self.compare.is_stabilised) {
            Some(centre) => View2d::At { centre, scale: scale_of(view) },
            None => view,
        }
    }
}

/// The target's pixel in the left image: the match, otherwise the prediction.
pub(crate) fn place_of_target(trace: &RunStep) -> Option<Pixel> {
    let located = trace.located().filter(|_| !trace.update.state.is_lost()).and_then(|l| l.left_pixel);
    located.or(trace.point_mast.predicted_left)
}

/// The magnification of a view; of a fitted view, the default of a stabilised target.
pub(crate) fn scale_of(view: View2d) -> f64 {
    match view {
        View2d::Fit => HELD_SCALE,
        View2d::At { scale, .. } => scale,
    }
}
