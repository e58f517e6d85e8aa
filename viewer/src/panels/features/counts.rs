//! The number of features after each step of the tracker, the earlier stops that were tried, and the motion (R169, R170).

use egui::{Grid, RichText, Ui};
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::evidence::{AnchorTried, FittedMotion};

use crate::command::{Command, Stage};
use crate::state::State;
use crate::theme;

/// A line of the counts.
pub(crate) struct CountLine {
    /// The step.
    pub(crate) stage: Stage,
    /// The counted quantity.
    pub(crate) words: String,
    /// The count, with its share of the preceding count.
    pub(crate) count: String,
}

/// The counts in the order of the steps; steps that were not reached are omitted.
pub(crate) fn lines(evidence: &FeatureEvidence) -> Vec<CountLine> {
    let mut lines = Vec::new();
    let mut add = |stage, words: String, count: String| lines.push(CountLine { stage, words, count });
    if let Some(found) = &evidence.detect {
        let words = "features, left and right".to_owned();
        add(Stage::DETECT, words, format!("{} and {}", found.left, found.right));
        let words = "of them matched in the other image".to_owned();
        add(Stage::MATCH_FEATURES, words, share(found.stereo_matches, found.left));
        let range = found.median_range_m.map_or_else(String::new, |m| format!(", median range {m:.2} m"));
        add(Stage::TRIANGULATE, format!("points{range}"), share(found.points, found.stereo_matches));
    }
    if let Some(matched) = &evidence.match_features {
        let words = format!("matched with the {} points of step {}", matched.then, matched.from_step);
        add(Stage::MATCH_FEATURES, words, share(matched.matches, matched.now));
        if matched.prior_given_up {
            let words = "too few inliers near the prior: the whole image was searched".to_owned();
            add(Stage::MATCH_FEATURES, words, "prior dropped".to_owned());
        }
        if let Some(motion) = &evidence.fit_motion {
            let words = "inliers".to_owned();
            add(Stage::FIT_MOTION, words, share(motion.inliers, matched.matches));
        }
    }
    if let Some(bootstrap) = &evidence.bootstrap {
        add(Stage::BOOTSTRAP, "bootstrap sets of those".to_owned(), bootstrap.sets.to_string());
    }
    lines
}

fn share(count: usize, of: usize) -> String {
    if of == 0 { count.to_string() } else { format!("{count} ({:.0} %)", 100.0 * count as f64 / of as f64) }
}

/// Shows the counts; a click on a step opens its record in the Inspector.
pub(crate) fn show(ui: &mut Ui, state: &State, evidence: &FeatureEvidence, out: &mut Vec<Command>) {
    ui.label(theme::title("from the images to the motion"));
    Grid::new("counts").num_columns(3).spacing([10.0, 1.0]).show(ui, |ui| {
        for line in lines(evidence) {
            let word = RichText::new(line.stage.word()).size(11.5);
            let button = egui::Button::selectable(state.stage() == line.stage, word);
            if ui.add(button).on_hover_text(line.stage.question()).clicked() {
                out.push(Command::SelectStage(line.stage));
            }
            ui.label(theme::number(line.count));
            ui.add(egui::Label::new(theme::note(line.words)).truncate());
            ui.end_row();
        }
    });
}

/// Shows the earlier stops that were tried as the reference of the motion.
pub(crate) fn anchors(ui: &mut Ui, evidence: &FeatureEvidence) {
    ui.label(theme::title("earlier stops tried"));
    if evidence.anchors.is_empty() {
        ui.label(theme::note("None: here the target was picked, and its position comes from point stereo."));
        return;
    }
    Grid::new("anchors").num_columns(6).striped(true).spacing([12.0, 1.0]).show(ui, |ui| {
        for head in ["step", "matches", "inliers", "confidence", "σ, cm", ""] {
            ui.label(theme::note(head));
        }
        ui.end_row();
        for tried in &evidence.anchors {
            anchor(ui, tried);
        }
    });
    for tried in &evidence.anchors {
        if let Some(why) = &tried.missing {
            ui.add(egui::Label::new(theme::note(format!("step {}: {why}", tried.step))).wrap());
        }
    }
}

fn anchor(ui: &mut Ui, tried: &AnchorTried) {
    let colour = if tried.chosen { theme::accent() } else { theme::strong() };
    let sigma = tried.sigma_m.map_or_else(|| "–".to_owned(), |m| format!("{:.2}", m * 100.0));
    let numbers = [
        tried.step.to_string(),
        tried.matches.to_string(),
        tried.inliers.to_string(),
        format!("{:.3}", tried.confidence),
        sigma,
    ];
    for number in numbers {
        ui.label(theme::number(number).color(colour));
    }
    let word = match (tried.chosen, &tried.missing) {
        (true, _) => "● chosen",
        (false, Some(_)) => "no motion",
        (false, None) => "",
    };
    ui.label(theme::note(word).color(colour));
    ui.end_row();
}

/// Shows the motion with its 1σ, and its residuals.
pub(crate) fn motion(ui: &mut Ui, evidence: &FeatureEvidence) {
    ui.label(theme::title("motion and its deviation"));
    let Some(motion) = &evidence.fit_motion else {
        ui.label(theme::note("No motion was fitted at this step."));
        return;
    };
    let sigmas = evidence.bootstrap.as_ref();
    Grid::new("motion").num_columns(4).spacing([12.0, 1.0]).show(ui, |ui| {
        let translation = sigmas.map(|b| b.sigma_translation_m.map(|m| m * 1000.0));
        row(ui, "x, y, z", "m", motion.translation_m, translation.map(|s| (s, "mm")));
        let rotation = sigmas.map(|b| b.sigma_rotation_deg);
        row(ui, "roll, pitch, yaw", "°", motion.roll_pitch_yaw_deg, rotation.map(|s| (s, "°")));
    });
    for sentence in sentences(motion) {
        ui.add(egui::Label::new(theme::note(sentence)).wrap());
    }
}

/// Three numbers, each with its 1σ.
fn row(ui: &mut Ui, name: &str, unit: &str, values: [f64; 3], sigmas: Option<([f64; 3], &str)>) {
    ui.label(theme::label(format!("{name}, {unit}")).size(12.0));
    for (i, value) in values.into_iter().enumerate() {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label(theme::number(format!("{value:+.4}")));
            if let Some((sigmas, unit)) = sigmas {
                ui.label(theme::note(format!("± {} {unit}", super::super::digits(sigmas[i]))));
            }
        });
    }
    ui.end_row();
}

/// The residuals of the motion and its correction of the target, then its successive refits.
pub(crate) fn sentences(motion: &FittedMotion) -> [String; 2] {
    let mm = |m: f64| format!("{:.1} mm", m * 1000.0);
    let fit = format!(
        "residuals: {} root mean square, {} median; the target is moved by {:.1} cm against the prediction",
        mm(motion.rms_m),
        mm(motion.median_m),
        motion.correction_m * 100.0
    );
    let best = motion.consensus_by_draw.iter().max();
    let begin = best.map_or_else(String::new, |best| format!("best hypothesis {best}, then "));
    let rounds: Vec<String> =
        motion.refits.iter().map(|refit| format!("{} ({})", refit.inliers, mm(refit.rms_m))).collect();
    [fit, format!("refit to the inliers: {begin}{}", rounds.join(" → "))]
}
