//! The panels: read-only data in, commands out, one panel per file. To add a panel: create its file, which implements
//! [`panel::Panel`], and add its `mod` line and its entry in the table below.

/// The panels in menu order: variant of [`pane::Pane`], identifier in stored arrangements, title, group in the overview,
/// purpose, and path of the implementation in this crate. `$with` is a macro that takes the whole table.
macro_rules! panel_table {
    ($with:ident) => {
        $with! {
            Targets: "targets", "Targets and runs", Home(Group::Lists, 0),
                "The targets, and the runs of each.",
                panels::targets::Targets;
            Settings: "settings", "Settings", Home(Group::Lists, 1),
                "Thresholds and parameters of a run",
                panels::settings::Settings;
            Left: "left", "Left image", Home(Group::LeftImage, 0),
                "The left image with the prediction, the search window and the match",
                panels::images_left::LeftView;
            CloseUp: "close_up", "Close-up", Home(Group::CloseUp, 0),
                "The target in both images, four times magnified, with its marks",
                panels::close_up::CloseUp;
            Right: "right", "Right image", Home(Group::Views, 0),
                "The right image with the epipolar curve and the stereo match",
                panels::image_right::RightView;
            Features: "features", "Features", Home(Group::Views, 1),
                "Evidence of the feature tracker: features, matches, the transform and its covariance.",
                panels::features::Features;
            Shape: "shape", "Shape", Home(Group::Views, 2),
                "Evidence of the shape tracker: surface, range sensor, coarse search, meshes and hand-off.",
                panels::shape::Shape;
            Drive: "drive", "Drive", Home(Group::Views, 3),
                "Sends the rover towards the target: its command, and the decision at every stop.",
                driving::panel::Drive;
            Odometry: "odometry", "Odometry", Home(Group::Views, 7),
                "The motion since the stop before by vision, against wheels and gyro: slip, gates and corners.",
                odometry::panel::Odometry;
            DataFlow: "data_flow", "Data flow", Home(Group::Views, 8),
                "The components of targeted driving, and the last message between them.",
                driving::data_flow::DataFlow;
            Budget: "budget", "Error budget", Home(Group::Views, 4),
                "Error budget of stereo, navigation and drift.",
                panels::budget::Budget;
            Studies: "studies", "Studies", Home(Group::Views, 5),
                "The paper’s experiments, over worlds whose truth is known.",
                studies::panel::Studies;
            Strip: "strip", "Template strip", Home(Group::Strip, 0),
                "The template from its reference to what was compared.",
                panels::strip::Strip;
            History: "history", "Template history", Home(Group::Strip, 1),
                "Every step’s matched window, and how the current view compares with the earlier templates.",
                panels::history::History;
            Surface: "surface", "Match scores", Home(Group::Scores, 0),
                "The match score of every position in the search window.",
                panels::score_map::Scores;
            StereoProfile: "stereo_profile", "Stereo scores", Home(Group::Scores, 1),
                "The stereo score of every range that was searched.",
                panels::stereo_profile::StereoProfile;
            Map: "map", "Map, site frame", Home(Group::Map, 0),
                "The rover’s path and the target, seen from above.",
                panels::map::Map;
            Plots: "plots", "Over the steps", Home(Group::Plots, 0),
                "Scores or confidence, and errors of the run, step by step.",
                panels::plots::Plots;
            Tolerances: "tolerances", "Tolerances", Home(Group::Plots, 1),
                "Criteria 3 and 4: each correction against its tolerance, step by step.",
                panels::tolerances::Tolerances;
            Gates: "gates", "Gates", Home(Group::Verdict, 1),
                "Whether the match can be trusted: the gates with their limits.",
                panels::gates::Gates;
            Machine: "machine", "State machine", Home(Group::Verdict, 2),
                "The tracking state, and the gates that rejected each past update.",
                panels::machine::Machine;
            Inspector: "inspector", "Inspector", Home(Group::Details, 0),
                "The record of the selected stage: values with units, formulas and origins",
                panels::inspector::Inspector;
            Messages: "messages", "Messages", Home(Group::Details, 3),
                "Errors and refused actions, with how to fix each",
                panels::messages::Messages;
            Runs: "runs", "Runs", Home(Group::Views, 6),
                "Metrics of each run, and the settings that differ.",
                panels::runs::Runs;
            Uncertainty: "uncertainty", "Uncertainty", Home(Group::Plots, 2),
                "Whether errors are as large as the covariances say.",
                panels::uncertainty::UncertaintyPanel;
            Why: "why", "Why", Home(Group::Verdict, 0),
                "Why a step was accepted or rejected, what would have saved it, and where a number comes from.",
                why::panel::Why;
            Notes: "notes", "Notes", Home(Group::Details, 2),
                "What you wrote about places of the drive; the list is a tour that can be stepped through.",
                notes::panel::Notes;
            Breakpoints: "breakpoints", "Breakpoints", Home(Group::Verdict, 3),
                "Conditions that are evaluated at all steps of all runs.",
                breakpoints::panel::Breakpoints;
        }
    };
}

pub(crate) mod pane;
pub(crate) mod panel;
pub(crate) mod list;
pub(crate) mod bars;
pub(crate) mod camera_choice;
pub(crate) mod card;
pub(crate) mod chart;
pub(crate) mod close_up;
pub(crate) mod broken;
pub(crate) mod budget;
pub(crate) mod epipolar;
pub(crate) mod exposure;
pub(crate) mod features;
pub(crate) mod gates;
pub(crate) mod history;
pub(crate) mod image_marks;
pub(crate) mod image_right;
pub(crate) mod images_left;
pub(crate) mod inspector;
pub(crate) mod legend;
pub(crate) mod machine;
pub(crate) mod map;
pub(crate) mod messages;
pub(crate) mod chart_legend;
pub(crate) mod playing;
pub(crate) mod plots;
pub(crate) mod runs;
pub(crate) mod numbers;
pub(crate) mod run_tree;
pub(crate) mod step_marks;
pub(crate) mod score_marks;
pub(crate) mod settings;
pub(crate) mod shape;
pub(crate) mod sheets;
pub(crate) mod stereo_profile;
pub(crate) mod status_line;
pub(crate) mod strip;
pub(crate) mod score_map;
pub(crate) mod targets;
pub(crate) mod timeline;
pub(crate) mod track;
pub(crate) mod tolerances;
pub(crate) mod uncertainty;
pub(crate) mod view_menu;

use egui::{Align, Layout, RichText, Ui, UiBuilder};

pub(crate) use sightline_session::format::number as digits;

use crate::theme;

/// Fills an empty panel: a sentence on how to fill it, and the panel's purpose unless empty.
pub(crate) fn missing(ui: &mut Ui, purpose: &str, sentence: &str) {
    let space = ui.available_rect_before_wrap();
    let builder = UiBuilder::new().max_rect(space.shrink(6.0)).layout(Layout::top_down(Align::Center));
    let mut middle = ui.new_child(builder);
    middle.add_space((space.height() / 2.0 - 24.0).clamp(0.0, 80.0));
    middle.add(egui::Label::new(RichText::new(sentence).color(theme::text())).wrap());
    if !purpose.is_empty() {
        middle.add(egui::Label::new(theme::note(purpose)).wrap());
    }
    ui.advance_cursor_after_rect(space);
}

/// An entry of an open list. Choosing it closes the list; egui does this for pointer and keyboard but not for a screen
/// reader.
pub(crate) fn entry(ui: &mut Ui, is_chosen: bool, words: &str) -> egui::Response {
    let response = ui.selectable_label(is_chosen, words);
    if response.clicked() {
        ui.close();
    }
    response
}
