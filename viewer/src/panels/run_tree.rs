//! Runs as a tree: a branch is listed below its parent, with only the settings that it changes.

use sightline_session::view::RunView;
use sightline_track::settings::Settings;

/// The runs in depth-first order, each with its depth. A branch of a removed run is listed as a root.
pub(crate) fn order(runs: &[RunView]) -> Vec<(usize, &RunView)> {
    let is_root = |run: &&RunView| parent(runs, run).is_none();
    let mut ordered = Vec::new();
    runs.iter().filter(is_root).for_each(|root| add(runs, root, 0, &mut ordered));
    ordered
}

fn add<'a>(runs: &'a [RunView], run: &'a RunView, depth: usize, ordered: &mut Vec<(usize, &'a RunView)>) {
    ordered.push((depth, run));
    let left = |child: &&RunView| parent(runs, child).is_some_and(|parent| parent.number == run.number);
    runs.iter().filter(left).for_each(|child| add(runs, child, depth + 1, ordered));
}

/// The run from which a run was forked, if it still exists; always an earlier one.
pub(crate) fn parent<'a>(runs: &'a [RunView], run: &RunView) -> Option<&'a RunView> {
    let left = run.fork.filter(|fork| fork.run < run.number)?.run;
    runs.iter().find(|other| other.number == left)
}

/// The settings that a run changes against its parent, or against the defaults if it has none, and the position of its
/// prediction if that was set.
pub(crate) fn changed(runs: &[RunView], run: &RunView) -> Vec<String> {
    let defaults = Settings::default();
    let before = parent(runs, run).map_or(&defaults, |parent| &parent.settings);
    let changes = run.settings.changes_from(before);
    let mut lines: Vec<String> = changes.iter().map(|(key, now)| format!("{key} = {now}")).collect();
    let put = run.fork.and_then(|fork| fork.prediction_px);
    lines.extend(put.map(|pixel| format!("prediction at {:.1}, {:.1} px", pixel.x, pixel.y)));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use sightline_geometry::frames::Pixel;
    use sightline_session::Fork;
    use sightline_track::settings::Changes;

    fn run(number: usize, fork: Option<Fork>, changes: &[(&str, serde_json::Value)]) -> RunView {
        let changes: Changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
        RunView {
            number,
            fork,
            settings: Settings::default().with(&changes).unwrap(),
            changes,
            without_effect: Default::default(),
            rows: Vec::new(),
            complete: false,
            stopped: None,
            waits_for: None,
            summary: Default::default(),
        }
    }

    #[test]
    fn a_branch_stands_below_what_it_left_and_says_only_what_it_changed() {
        let put = Fork { prediction_px: Some(Pixel::new(3.0, 4.5)), ..Fork::new(1, 5) };
        let runs = [
            run(0, None, &[("ncc_min", json!(0.6))]),
            run(1, Some(Fork::new(0, 3)), &[("ncc_min", json!(0.6)), ("search_window_px", json!(61))]),
            run(2, Some(Fork::new(0, 4)), &[("ncc_min", json!(0.5))]),
            run(3, Some(put), &[("ncc_min", json!(0.6)), ("search_window_px", json!(61))]),
            // Its parent was removed.
            run(6, Some(Fork::new(5, 2)), &[]),
        ];
        let order: Vec<(usize, usize)> =
            order(&runs).iter().map(|(depth, run)| (*depth, run.number)).collect();
        assert_eq!(order, [(0, 0), (1, 1), (2, 3), (1, 2), (0, 6)]);
        assert_eq!(changed(&runs, &runs[0]), ["ncc_min = 0.6"]);
        assert_eq!(changed(&runs, &runs[1]), ["search_window_px = 61"]);
        assert_eq!(changed(&runs, &runs[3]), ["prediction at 3.0, 4.5 px"]);
    }
}
