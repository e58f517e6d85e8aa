//! What the page wants loaded for what it shows.

use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::trace::ArrayName;

use crate::cache::{Eye, Key};
use crate::panels::timeline::film;
use crate::state::{State, row_of};

/// How many windows of a long run are loaded at once, and how many of them lie after the cursor.
const NEAR: usize = 120;
const AFTER: usize = 10;

impl State {
    /// What the page wants loaded, most urgent first: the cursor's step, and once that is here the next and the previous one.
    /// A browser keeps few connections: what is asked for ahead would stand before what is looked at.
    pub fn wanted(&self) -> Vec<Key> {
        let step = self.cursor.step;
        let mut keys = self.wanted_here();
        if self.are_settled(&keys) {
            keys.extend(self.row().and_then(|_| self.step_key(step)).map(Key::Times));
            for step in [step.checked_add(1), step.checked_sub(1)].into_iter().flatten() {
                if step < self.stop_count() {
                    self.want_step(step, true, &mut keys);
                }
            }
        }
        self.want_odometry(&mut keys);
        self.want_hazards(&mut keys);
        self.want_compared(&mut keys);
        // The record of the pick has the warnings about it.
        let pick = self.run().and_then(|run| run.rows.first()).map(|row| row.step);
        keys.extend(pick.and_then(|step| self.step_key(step)).map(Key::Trace));
        if let Some(run) = self.run() {
            keys.extend(film::rows(self, run).filter_map(|row| self.window_key(run, row)));
        }
        if let Some(run) = self.run().filter(|_| self.wants_history) {
            keys.extend(self.row().and_then(|_| self.step_key(step)).map(Key::EarlierTemplates));
            keys.extend(self.near_rows(run).filter_map(|row| self.window_key(run, row)));
        }
        keys
    }

    /// Whether everything of the cursor's step is here or was refused.
    pub fn is_complete(&self) -> bool {
        self.stop_count() > 0 && self.are_settled(&self.wanted_here())
    }

    fn wanted_here(&self) -> Vec<Key> {
        let mut keys = Vec::new();
        if self.cursor.step < self.stop_count() {
            self.want_step(self.cursor.step, false, &mut keys);
        }
        keys
    }

    fn are_settled(&self, keys: &[Key]) -> bool {
        keys.iter().all(|key| self.cache.is_settled(key))
    }

    /// The rows whose windows are looked at together: the pick, and as many as are kept in memory around the cursor.
    pub(crate) fn near_rows<'a>(&self, run: &'a RunView) -> impl Iterator<Item = &'a StepRow> {
        let here = run.rows.partition_point(|row| row.step < self.cursor.step);
        let from = (here + AFTER).min(run.rows.len()).saturating_sub(NEAR).max(1);
        let near = run.rows.iter().skip(from).take(NEAR);
        run.rows.first().into_iter().chain(near)
    }

    /// The name of the window that a step matched: at the pick, the template that the next step took from there.
    pub(crate) fn window_key(&self, run: &RunView, row: &StepRow) -> Option<Key> {
        let is_pick = run.rows.first().is_some_and(|first| first.step == row.step);
        let (step, name) =
            if is_pick { (row.step + 1, ArrayName::REFERENCE) } else { (row.step, ArrayName::MATCHED) };
        let has_window = row_of(run, step).is_some_and(|row| row.ncc.is_some());
        has_window.then(|| self.step_key(step)).flatten().map(|key| Key::Array(key, name))
    }

    /// Those of `keys` that are images which must be rendered first.
    pub fn unrendered(&self, keys: &[Key]) -> Vec<Key> {
        let is_ready =
            |step: usize| self.traverse.as_ref().and_then(|t| t.stops.get(step)).is_some_and(|s| s.ready);
        let is_simulated = self.traverse.as_ref().is_some_and(|traverse| traverse.simulated);
        let is_slow = |key: &&Key| match key {
            Key::Image { step, camera: None, .. } => !is_ready(*step),
            // The page does not know whether it is rendered.
            Key::Image { camera: Some(_), .. } => is_simulated,
            _ => false,
        };
        keys.iter().filter(is_slow).cloned().collect()
    }

    fn want_step(&self, step: usize, is_neighbour: bool, keys: &mut Vec<Key>) {
        let computed = self.row_at(step).and_then(|_| self.step_key(step));
        keys.extend(computed.iter().flat_map(|key| [Key::Trace(key.clone()), Key::Arrays(key.clone())]));
        // A step that was computed has its cameras in its record.
        let has_cameras = computed.is_some() && self.shows_targets_camera();
        keys.extend(self.stop_detail_key(step).filter(|_| !has_cameras));
        // The images of a simulated stop take a while: only the one that is looked at is worth that.
        let is_further = self.camera().is_some();
        let is_ready = self.traverse.as_ref().is_some_and(|traverse| {
            let is_known = !is_further || !traverse.simulated;
            is_known && traverse.stops.get(step).is_some_and(|stop| stop.ready)
        });
        if (is_ready || !is_neighbour) && !self.lacks_images_yet(step) {
            keys.extend([Eye::Left, Eye::Right].into_iter().filter_map(|eye| self.image_key(step, eye)));
        }
    }
}
