//! The items that the current view needs.

use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::trace::ArrayName;

use crate::cache::{ImageSide, Key};
use crate::panels::timeline::film;
use crate::state::{State, row_of};

/// Number of windows of a long run that are loaded at once, and how many of them are after the cursor.
const NEAR: usize = 120;
const AFTER: usize = 10;

impl State {
    /// The items that the current view needs, most urgent first: the cursor's step and, once that is complete, its
    /// neighbours. A browser has few connections, so that prefetching would delay the cursor's step.
    pub fn needed_items(&self) -> Vec<Key> {
        let step = self.cursor.step;
        let mut keys = self.items_of_cursor_step();
        if self.are_settled(&keys) {
            keys.extend(self.row().and_then(|_| self.step_key(step)).map(Key::Times));
            for step in [step.checked_add(1), step.checked_sub(1)].into_iter().flatten() {
                if step < self.stop_count() {
                    self.add_step_items(step, true, &mut keys);
                }
            }
        }
        self.add_odometry_items(&mut keys);
        self.add_hazard_items(&mut keys);
        self.add_compared_items(&mut keys);
        // The record of the pick contains its warnings.
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

    /// Whether all items of the cursor's step are loaded or refused.
    pub fn is_complete(&self) -> bool {
        self.stop_count() > 0 && self.are_settled(&self.items_of_cursor_step())
    }

    fn items_of_cursor_step(&self) -> Vec<Key> {
        let mut keys = Vec::new();
        if self.cursor.step < self.stop_count() {
            self.add_step_items(self.cursor.step, false, &mut keys);
        }
        keys
    }

    fn are_settled(&self, keys: &[Key]) -> bool {
        keys.iter().all(|key| self.cache.is_settled(key))
    }

    /// The rows whose windows are shown together: the pick, and the rows around the cursor.
    pub(crate) fn near_rows<'a>(&self, run: &'a RunView) -> impl Iterator<Item = &'a StepRow> {
        let here = run.rows.partition_point(|row| row.step < self.cursor.step);
        let from = (here + AFTER).min(run.rows.len()).saturating_sub(NEAR).max(1);
        let near = run.rows.iter().skip(from).take(NEAR);
        run.rows.first().into_iter().chain(near)
    }

    /// The cache key of the window that a step matched; at the pick, the template that the next step took there.
    pub(crate) fn window_key(&self, run: &RunView, row: &StepRow) -> Option<Key> {
        let is_pick = run.rows.first().is_some_and(|first| first.step == row.step);
        let (step, name) =
            if is_pick { (row.step + 1, ArrayName::REFERENCE) } else { (row.step, ArrayName::MATCHED) };
        let has_window = row_of(run, step).is_some_and(|row| row.ncc.is_some());
        has_window.then(|| self.step_key(step)).flatten().map(|key| Key::Array(key, name))
    }

    /// The images among `keys` that must be rendered first.
    pub fn unrendered(&self, keys: &[Key]) -> Vec<Key> {
        let is_ready =
            |step: usize| self.traverse.as_ref().and_then(|t| t.stops.get(step)).is_some_and(|s| s.ready);
        let is_simulated = self.traverse.as_ref().is_some_and(|traverse| traverse.simulated);
        let is_slow = |key: &&Key| match key {
            Key::Image { step, camera: None, .. } => !is_ready(*step),
            // The page has no information on whether it is rendered.
            Key::Image { camera: Some(_), .. } => is_simulated,
            _ => false,
        };
        keys.iter().filter(is_slow).cloned().collect()
    }

    fn add_step_items(&self, step: usize, is_neighbour: bool, keys: &mut Vec<Key>) {
        let computed = self.row_at(step).and_then(|_| self.step_key(step));
        keys.extend(computed.iter().flat_map(|key| [Key::Trace(key.clone()), Key::Arrays(key.clone())]));
        // The record of a computed step contains its cameras.
        let has_cameras = computed.is_some() && self.shows_targets_camera();
        keys.extend(self.stop_detail_key(step).filter(|_| !has_cameras));
        // Rendering the images of a simulated stop is slow, and is not started for neighbours.
        let is_further = self.camera().is_some();
        let is_ready = self.traverse.as_ref().is_some_and(|traverse| {
            let is_known = !is_further || !traverse.simulated;
            is_known && traverse.stops.get(step).is_some_and(|stop| stop.ready)
        });
        if (is_ready || !is_neighbour) && !self.lacks_images_yet(step) {
            keys.extend(
                [ImageSide::Left, ImageSide::Right].into_iter().filter_map(|side| self.image_key(step, side)),
            );
        }
    }
}
