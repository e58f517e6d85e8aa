//! A number that a stage declares appears in the views of the page, although none of them names it.

use sightline_session::records::{self, StageQuantity};

use super::{Shown, fixture};
use crate::command::{Command, Stage};
use crate::panels::pane::Pane;
use crate::panels::plots;
use crate::why::WhyCommand;

/// The number: declared in the `impl Record` of its stage, but not a field of the evidence.
const NAME: &str = "match_template.match_sigma_px";

#[test]
fn one_declaration_puts_a_number_into_inspector_and_plots() {
    let quantity = StageQuantity::named(NAME).unwrap();
    let mut shown = Shown::pane(Pane::Inspector, |context| {
        let mut state = fixture::at_step(context, 2);
        state.stage = Stage::MATCH_TEMPLATE;
        state
    });
    shown.says("match sigma").says(&format!("= {}", quantity.declared().formula));
    let why = Command::Why(WhyCommand::Value { step: 2, value: NAME.to_owned() });
    assert_eq!(shown.click("match sigma"), vec![why]);
    let names: Vec<String> = records::stages()
        .iter()
        .flat_map(|stage| plots::names_to_plot(stage.schema()))
        .map(|(name, _)| name)
        .collect();
    assert!(names.contains(&NAME.to_owned()), "{names:?}");
    for name in names {
        assert!(sightline_session::expression::Expression::column(&name).is_ok(), "{name} can be plotted");
    }
}
