//! The origin of a value as a tree; a click on a line explains that value.

use egui::collapsing_header::CollapsingState;
use egui::{Id, Label, RichText, Ui};
use sightline_session::why::words::number;
use sightline_session::why::{Node, Origin, OriginKind};

use crate::command::{Command, Go};
use crate::state::State;
use crate::theme;
use crate::why::panel::view;
use crate::why::{Remote, WhyCommand, WhySection};

/// Number of levels that are initially open.
const OPEN: usize = 2;

/// Shows the tree of the value that was requested last.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some((key, value, remote)) = state.explained() else {
        return;
    };
    ui.add_space(2.0);
    let top = ui.cursor().top();
    ui.horizontal_wrapped(|ui| {
        ui.label(theme::title(&format!("why {value}, {}", state.whose(key))));
        if state.why.history.len() > 1
            && ui.button("Back").on_hover_text("The value asked for before").clicked()
        {
            out.push(Command::Why(WhyCommand::Back));
        }
        let is_here = state.step_key(state.cursor.step).as_ref() == Some(key);
        if !is_here && ui.button("At this step").clicked() {
            out.push(Command::Why(WhyCommand::Value { step: state.cursor.step, value: value.to_owned() }));
        }
    });
    match remote {
        Remote::Pending => {
            ui.label(theme::note("Asking …"));
        }
        Remote::Refused(why) => {
            ui.add(Label::new(RichText::new(why).color(theme::lost())).wrap());
        }
        Remote::Received(explanation) => {
            if let Some(tree) = &explanation.tree {
                branch(ui, tree, ui.scope_id().with(("why", value, key.step)), 0, out);
            }
        }
    }
    view::scroll_to(ui, state.why.scroll_request, WhySection::Tree, top, !matches!(remote, Remote::Pending));
}

/// Shows a value with its inputs.
fn branch(ui: &mut Ui, node: &Node, id: Id, depth: usize, out: &mut Vec<Command>) {
    let is_leaf = node.inputs.is_empty() && node.formula.is_none() && node.origin.is_none();
    if is_leaf {
        line(ui, node, out);
        return;
    }
    CollapsingState::load_with_default_open(ui.ctx(), id, depth < OPEN)
        .show_header(ui, |ui| line(ui, node, out))
        .body(|ui| {
            if let Some(formula) = &node.formula {
                let sign = if node.is_closed_form { "= " } else { "" };
                ui.add(
                    Label::new(
                        RichText::new(format!("{sign}{}", theme::formula(formula)))
                            .small()
                            .color(theme::text()),
                    )
                    .wrap(),
                );
            }
            if let Some(origin) = &node.origin {
                from(ui, origin, out);
            }
            for (i, input) in node.inputs.iter().enumerate() {
                branch(ui, input, id.with(i), depth + 1, out);
            }
        });
}

/// Shows name, value, unit and stage; a click on the name explains it.
fn line(ui: &mut Ui, node: &Node, out: &mut Vec<Command>) {
    let value = words(node);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let link =
            ui.link(RichText::new(&node.label).size(12.0)).on_hover_text(format!("Why {}?", node.value));
        if link.clicked() {
            out.push(Command::Why(WhyCommand::Value { step: node.step, value: node.value.clone() }));
        }
        link.context_menu(|ui| {
            if ui.button("Copy value").clicked() {
                ui.ctx().copy_text(value.clone());
                ui.close();
            }
            if ui.button("Copy name").clicked() {
                ui.ctx().copy_text(node.value.clone());
                ui.close();
            }
        });
        ui.label(theme::number(&value).size(12.0));
        ui.label(theme::note(format!("{}  · {}", node.unit, node.stage)));
    });
}

fn from(ui: &mut Ui, origin: &Origin, out: &mut Vec<Command>) {
    let kind = match origin.kind {
        OriginKind::Image => "file",
        OriginKind::Pose => "pose",
        OriginKind::Camera => "camera",
        OriginKind::Setting => "setting",
        OriginKind::Person => "person",
        OriginKind::Step => "step",
        OriginKind::Truth => "truth",
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(theme::note(format!("from {kind}: {}", origin.name)));
        if let Some(step) = origin.step
            && ui.small_button(format!("go to step {step}")).clicked()
        {
            out.push(Command::Go(Go::Step(step)));
        }
    });
}

/// The numbers of a value, or its text.
fn words(node: &Node) -> String {
    if let (Some(text), true) = (&node.text, node.numbers.is_empty()) {
        return text.clone();
    }
    let numbers = node.numbers.iter().map(|value| value.map_or_else(|| "none".to_owned(), number));
    let numbers: Vec<String> = numbers.collect();
    if numbers.len() == 1 { numbers[0].clone() } else { format!("({})", numbers.join(", ")) }
}
