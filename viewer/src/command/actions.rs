//! All commands by name, as the palette finds them, with their keys.

use sightline_session::step::StepRow;

use crate::breakpoints::goto;
use crate::command::table;
use crate::command::{Command, Go};
use crate::exports;
use crate::figure::request::{FigureFormat, FigureRequest};
use crate::layout::command::LayoutCommand;
use crate::layout::presets::Preset;
use crate::panels::digits;
use crate::panels::pane::Pane;
use crate::panels::sheets::of_panel;
use crate::state::targets::Rename;
use crate::state::{State, events, run_letter};
use crate::theme::ColourTheme;

/// Maximum number of results in the palette.
const LISTED: usize = 12;

/// An entry of the palette.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Action {
    /// The name, which the search matches.
    pub title: String,
    /// The keys of the command; empty without any.
    pub keys: String,
    /// The command.
    pub command: Command,
}

/// An entry without keys.
fn action(title: impl Into<String>, command: Command) -> Action {
    Action { title: title.into(), keys: String::new(), command }
}

/// The actions that match the words, best match first.
pub(crate) fn find(state: &State, words: &str) -> Vec<Action> {
    let mut found = goes(state, words);
    let wanted: Vec<String> = words.split_whitespace().map(str::to_lowercase).collect();
    let mut ranked: Vec<(usize, Action)> = all(state)
        .into_iter()
        .filter_map(|action| rank(&action.title.to_lowercase(), &wanted).map(|rank| (rank, action)))
        .collect();
    ranked.sort_by_key(|(rank, _)| *rank);
    found.extend(ranked.into_iter().map(|(_, action)| action));
    found.truncate(LISTED);
    found
}

/// Search words, each with the words of titles that they also match.
const SYNONYMS: [(&str, &[&str]); 28] = [
    ("panel", &["show"]),
    ("view", &["show", "layout"]),
    ("window", &["show"]),
    ("export", &["save", "copy"]),
    ("download", &["export", "save"]),
    ("screenshot", &["save"]),
    ("picture", &["save"]),
    ("figure", &["save"]),
    ("jump", &["go to", "next event"]),
    ("branch", &["run from", "as a branch"]),
    ("fork", &["run from"]),
    ("rerun", &["run from"]),
    ("zoom", &["fit all", "fill the page"]),
    ("fullscreen", &["fill the page"]),
    ("maximise", &["fill the page"]),
    ("maximize", &["fill the page"]),
    ("rename", &["targets and runs", "label"]),
    ("delete", &["remove"]),
    ("import", &["open"]),
    ("load", &["open"]),
    ("share", &["link", "export"]),
    ("url", &["link"]),
    ("shortcut", &["keys"]),
    ("help", &["keys", "tour"]),
    ("theme", &["looks"]),
    ("colour", &["looks"]),
    ("csv", &["table", "export"]),
    ("arrangement", &["layout"]),
];

/// Rank penalty of a synonym against the words of the title itself.
const SYNONYM_RANK: usize = 1000;

/// Sum of the positions at which the words occur in a title; `None` if neither a word nor a synonym of it occurs.
fn rank(title: &str, wanted: &[String]) -> Option<usize> {
    wanted.iter().map(|word| place(title, word)).sum()
}

fn place(title: &str, word: &str) -> Option<usize> {
    let own = title.find(word);
    let others = SYNONYMS.iter().filter(|(typed, _)| *typed == word).flat_map(|(_, words)| words.iter());
    own.or_else(|| others.filter_map(|other| title.find(other)).min().map(|at| SYNONYM_RANK + at))
}

/// The command to go to a step, if the words are a valid step number.
fn goes(state: &State, words: &str) -> Vec<Action> {
    let step = words.trim().parse::<usize>().ok().filter(|step| *step < state.stop_count());
    step.map(|step| Action {
        keys: "G".to_owned(),
        ..action(format!("Go to step {step}"), Command::Go(Go::Step(step)))
    })
    .into_iter()
    .collect()
}

/// All actions that are available in this state.
pub(crate) fn all(state: &State) -> Vec<Action> {
    let mut all = of_table(state);
    all.extend(moves(state));
    all.extend(works(state));
    all.extend(places(state));
    all.extend(values(state));
    all
}

/// The commands of the table that have a name.
fn of_table(state: &State) -> Vec<Action> {
    let named = table::all().filter(|entry| !entry.name.is_empty());
    named
        .map(|entry| Action {
            title: entry.name.to_owned(),
            keys: entry.keys(),
            command: (entry.command)(state),
        })
        .collect()
}

fn moves(state: &State) -> Vec<Action> {
    let mut all = Vec::new();
    for name in goto::EVENTS {
        if let Ok(step) = state.step_meant(name) {
            let title = format!("Go to {name}: step {step}");
            all.push(action(title, Command::Go(Go::Step(step))));
        }
    }
    for step in state.run().map(events).unwrap_or_default() {
        let row = state.row_at(step);
        let word = row.map_or("fault", |row| if row.fault { "fault" } else { row.state.as_str() });
        all.push(action(format!("Go to step {step}: {word}"), Command::Go(Go::Step(step))));
    }
    for stage in state.stages() {
        let title = format!("Stage {}: {}", stage.word(), stage.question());
        all.push(action(title, Command::SelectStage(stage)));
    }
    all
}

fn works(state: &State) -> Vec<Action> {
    let mut all = Vec::new();
    for target in state.session.iter().flat_map(|session| &session.targets) {
        for run in &target.runs {
            let title = format!("Look at {}, run {}", target.label, run_letter(run.number));
            all.push(action(title, Command::SelectRun { target: target.number, run: run.number }));
        }
        let rename = Command::Rename(Rename::Begin(target.number));
        all.push(action(format!("Rename {}", target.label), rename));
        all.push(action(format!("Remove {}", target.label), Command::RemoveTarget(target.number)));
    }
    for entry in state.traverses.iter().flatten() {
        all.push(action(
            format!("Open the traverse {}", entry.name),
            Command::OpenTraverse(entry.id.clone()),
        ));
    }
    all
}

fn places(state: &State) -> Vec<Action> {
    let arrange = |command| Command::Layout(command);
    let mut all: Vec<Action> = Preset::ALL
        .into_iter()
        .map(|preset| {
            let command = arrange(LayoutCommand::Use(preset));
            Action {
                title: format!("Layout {}: {}", preset.title(), preset.purpose()),
                keys: table::keys_of(state, &command),
                command,
            }
        })
        .collect();
    all.extend(
        Pane::ALL.map(|pane| action(format!("Show {}", pane.title()), arrange(LayoutCommand::Show(pane)))),
    );
    for pane in of_panel::panes() {
        all.push(action(format!("{} as table, or as it was", pane.title()), Command::Table(pane)));
    }
    for pane in Pane::ALL {
        all.extend(FigureFormat::ALL.map(|kind| {
            let title = format!("Save {} as {}", pane.title(), kind.word());
            action(title, Command::Exports(exports::ExportsCommand::Figure(FigureRequest { pane, kind })))
        }));
    }
    all.extend(ColourTheme::ALL.map(|colour_theme| {
        action(format!("Looks: {}", colour_theme.title()), Command::SetColourTheme(colour_theme))
    }));
    let settings = state.settings.iter().map(|info| {
        let title = format!("Setting {}: {}", info.key, info.help);
        action(title, arrange(LayoutCommand::Show(Pane::Settings)))
    });
    all.extend(settings);
    all
}

/// The values of the cursor's step; the command shows the panel that plots the value.
fn values(state: &State) -> Vec<Action> {
    let Some(row) = state.row() else { return Vec::new() };
    let numbers = |row: &StepRow| {
        [
            ("ncc, score of the match", row.ncc, ""),
            ("stereo_score", row.stereo_score, ""),
            ("confidence", row.confidence, ""),
            ("err_px, error in the image", row.err_px, " px"),
            ("err_m, error in space", row.err_m, " m"),
            ("sigma_m, largest axis of the covariance", row.sigma_m, " m"),
            ("nees", row.nees, ""),
            ("range_m, distance", row.range_m, " m"),
            ("scale", row.scale, ""),
            ("roll_deg", row.roll_deg, " deg"),
        ]
    };
    let known = numbers(row).into_iter().filter_map(|(name, value, unit)| Some((name, value?, unit)));
    known
        .map(|(name, value, unit)| {
            let title = format!("Value {name}: {}{unit} at step {}", digits(value), row.step);
            action(title, Command::Layout(LayoutCommand::Show(Pane::Plots)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    #[test]
    fn all_words_must_be_there_and_the_earliest_come_first() {
        let state = fixture::without_target();
        let titles = |words: &str| find(&state, words).into_iter().map(|a| a.title).collect::<Vec<_>>();
        assert_eq!(titles("next panel"), ["Next panel"]);
        assert_eq!(titles("stereo layout")[0], "Layout Stereo: how the point was found in space");
        assert!(titles("no such thing at all").is_empty());
    }

    #[test]
    fn words_match_in_any_order_and_by_synonym() {
        let state = fixture::at_step(&egui::Context::default(), 0);
        let first =
            |words: &str| find(&state, words).first().map(|action| action.title.clone()).unwrap_or_default();
        assert_eq!(first("panel runs"), "Show Runs");
        assert_eq!(first("runs panel"), "Show Runs");
        assert!(first("export svg").starts_with("Save ") && first("export svg").ends_with("SVG"));
        assert_eq!(first("go lost"), "Go to lost: step 3");
        assert!(first("branch").starts_with("Run from this step"), "{}", first("branch"));
        assert_eq!(first("zoom"), "Fit all images");
        assert_eq!(first("rename"), "Rename ridge");
    }

    #[test]
    fn a_number_goes_to_that_step_and_one_too_large_goes_nowhere() {
        let state = fixture::without_target();
        assert_eq!(find(&state, "3")[0].command, Command::Go(Go::Step(3)));
        assert!(
            find(&state, "900").iter().all(|action| !matches!(action.command, Command::Go(Go::Step(900))))
        );
    }
}
