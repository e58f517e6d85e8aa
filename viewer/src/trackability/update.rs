//! Reads the trackability map of the cursor's stop, and moves the aim in its left image.

use sightline_api::endpoint::{Call, Endpoint, NoBody};
use sightline_api::endpoints::{CancelTrackability, ShowTrackability};
use sightline_api::location::AtStop;
use sightline_api::query::MapLimits;
use sightline_api::wire::Problem;
use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::map::Cell;
use sightline_rover::trackability::{MapProgress, TrackabilityLimits, TrackabilityMap, Verdict};
use sightline_track::settings::Changes;

use crate::command::{Command, Mode};
use crate::drawing::view2d::View2d;
use crate::picking::aim::Aim;
use crate::state::{ImagePosition, Refusal, State};
use crate::trackability::limits::{LimitsCommand, LimitsForm};
use crate::trackability::{MapPlace, Trackability};

impl State {
    /// The map of the cursor's stop, as far as it is computed; `None` for further cameras.
    pub fn trackability_map(&self) -> Option<&TrackabilityMap> {
        let (traverse, step, _) = self.trackability.place.as_ref()?;
        let is_here =
            self.traverse.as_ref().is_some_and(|open| open.id == *traverse) && *step == self.cursor.step;
        // Only the main pair of a stop has a map.
        self.trackability.progress.as_ref().filter(|_| is_here && self.camera().is_none())?.map.as_ref()
    }

    /// The cell of the map at a pixel of the left image.
    pub(crate) fn trackability_at(&self, pixel: Pixel) -> Option<Cell> {
        self.trackability_map()?.at(pixel)
    }

    /// Applies a command about the aim.
    pub(crate) fn aim(&mut self, aim: Aim) {
        let nearest = self.refusal.as_ref().and_then(|refusal| refusal.nearest);
        match aim {
            Aim::Put(pixel) => self.trackability.aim = Some(pixel),
            Aim::Nudge { dx, dy } => {
                let from = self.trackability.aim.unwrap_or_else(|| self.first_aim());
                let [width, height] = self.left_size().unwrap_or([1, 1]);
                let hold = |v: f64, size: u32| ((v * 10.0).round() / 10.0).clamp(0.0, f64::from(size) - 1.0);
                self.trackability.aim = Some(Pixel::new(hold(from.x + dx, width), hold(from.y + dy, height)));
            }
            Aim::Accept => match self.trackability.aim.take() {
                Some(pixel) => self.perform(Command::Pick(pixel)),
                None => self.aim(Aim::TakeNearest),
            },
            Aim::Insist => {
                if let Some(refusal) = self.refusal.clone().filter(|refusal| refusal.is_advice) {
                    self.trackability.aim = None;
                    self.designate(refusal.place);
                }
            }
            Aim::TakeNearest => {
                if let Some(pixel) = nearest {
                    self.trackability.aim = None;
                    self.designate(ImagePosition { step: self.cursor.step, pixel, camera: self.camera() });
                }
            }
        }
    }

    /// Whether the map has no verdict for a position yet, but will have one.
    pub(crate) fn is_to_be_judged(&self, place: ImagePosition) -> bool {
        let progress = self.trackability.progress.as_ref();
        let is_coming = match progress {
            Some(progress) => !progress.ended,
            None => self.trackability.is_pending || self.trackability.is_stale,
        };
        is_coming && place.camera.is_none() && self.trackability_at(place.pixel).is_none()
    }

    /// The advice against a position whose verdict is risky or poor; `None` without a map.
    pub(crate) fn advised_against(&self, place: ImagePosition) -> Option<Refusal> {
        let cell = self.trackability_at(place.pixel).filter(|cell| cell.verdict != Verdict::Good)?;
        let word = cell.verdict.title();
        let sentence = cell.sentence().map_or_else(|| word.to_owned(), |why| format!("{word}: {why}"));
        let nearest = self.trackability_map().and_then(|map| map.nearest_good(place.pixel));
        Some(Refusal { place, sentence, nearest, is_advice: true })
    }

    /// The initial aim of the keys: the refused pixel, otherwise the centre of the view.
    pub(crate) fn first_aim(&self) -> Pixel {
        let [width, height] = self.left_size().unwrap_or([1, 1]);
        let middle = match self.views.left {
            View2d::Fit => Pixel::new(f64::from(width / 2), f64::from(height / 2)),
            View2d::At { centre, .. } => centre,
        };
        self.refusal.as_ref().map_or(middle, |refusal| refusal.place.pixel)
    }

    /// Reads the map while a target is being picked; cancels it afterwards.
    pub(crate) fn sync_trackability(&mut self) {
        let limits = &self.trackability.limits;
        let here = self.traverse.as_ref().map(|open| (open.id.clone(), self.cursor.step, limits.clone()));
        let wanted = here.filter(|_| self.mode == Mode::Pick && self.camera().is_none());
        if self.mode != Mode::Pick {
            self.trackability.aim = None;
        }
        let known = &mut self.trackability;
        if known.place != wanted {
            let is_made = known.progress.as_ref().is_none_or(|progress| progress.ended);
            let unfinished = known.place.take().filter(|_| !is_made);
            let (limits, form) = (std::mem::take(&mut known.limits), known.form.take());
            let (aim, judged) = (known.aim, known.judged.take());
            let judged = judged.filter(|place| place.step == self.cursor.step);
            *known = Trackability { aim, judged, limits, form, ..Trackability::default() };
            (known.is_stale, known.place) = (wanted.is_some(), wanted);
            if let Some(place) = unfinished {
                let call = map_call::<CancelTrackability>(&place);
                // A refusal means that the map was completed meanwhile.
                self.call_with_problem::<CancelTrackability>(call, |_, _| {});
            }
        }
        let known = &mut self.trackability;
        let wanted = known.place.clone().filter(|_| known.is_stale && !known.is_pending);
        if let Some(place) = wanted {
            (known.is_pending, known.is_stale) = (true, false);
            let call = map_call::<ShowTrackability>(&place);
            self.call_with_problem::<ShowTrackability>(call, move |state, answer| {
                state.on_trackability_reply(&place, answer);
            });
        }
    }

    /// Handles an event about new rows of a map.
    pub(crate) fn on_trackability_progress(&mut self, traverse: &str, step: usize) {
        let known = &mut self.trackability;
        let is_ours = known.place.as_ref().is_some_and(|(own, at, _)| own == traverse && *at == step);
        let is_made = known.progress.as_ref().is_some_and(|progress| progress.ended);
        known.is_stale |= is_ours && !is_made;
    }

    /// Marks an unfinished map as stale: events about it may have been missed.
    pub(crate) fn trackability_stale(&mut self) {
        let is_made = self.trackability.progress.as_ref().is_some_and(|progress| progress.ended);
        self.trackability.is_stale |= self.trackability.place.is_some() && !is_made;
    }

    /// Stores a reply about the map; picking also works without one.
    fn on_trackability_reply(&mut self, place: &MapPlace, answer: Result<MapProgress, Problem>) {
        let known = &mut self.trackability;
        if known.place.as_ref() != Some(place) {
            return;
        }
        known.is_pending = false;
        let waiting = known.judged;
        match answer {
            Ok(progress) => known.progress = Some(progress),
            // The server is unreachable: the map is read again when it is back.
            Err(problem) if problem.status == 0 => {}
            Err(problem) => {
                known.progress =
                    Some(MapProgress { k: 0, n: 0, ended: true, failed: Some(problem.detail), map: None });
            }
        }
        if let Some(place) = waiting.filter(|place| !self.is_to_be_judged(*place)) {
            self.pick(place.pixel);
        }
    }
}

/// The call of `E` about the map of a stop.
pub(crate) fn map_call<E>((traverse, step, limits): &MapPlace) -> Call
where
    E: Endpoint<At = AtStop, Query = MapLimits, Body = NoBody>,
{
    let limits = (!limits.is_empty()).then(|| TrackabilityLimits::text(limits));
    Call::with_query::<E>(&AtStop { id: traverse.clone(), step: *step }, &MapLimits { limits })
}

impl State {
    /// Applies a command about the limits.
    pub(crate) fn apply_limits_command(&mut self, command: LimitsCommand) {
        let known = &mut self.trackability;
        match command {
            LimitsCommand::Open => known.form = Some(LimitsForm::of(&known.limits)),
            LimitsCommand::Close => known.form = None,
            LimitsCommand::Type { key, text } => {
                if let Some(form) = &mut known.form {
                    form.texts.insert(key, text);
                    form.refused = None;
                }
            }
            LimitsCommand::Defaults => known.form = Some(LimitsForm::of(&Changes::new())),
            LimitsCommand::Use => {
                let Some(form) = &mut known.form else { return };
                match form.changes() {
                    Ok(limits) => {
                        (known.limits, known.form) = (limits, None);
                        // The map is visible only while a target is being picked.
                        self.set_mode(Mode::Pick);
                    }
                    Err(sentence) => form.refused = Some(sentence),
                }
            }
        }
    }
}
