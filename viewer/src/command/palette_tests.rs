//! The palette and the keyboard: entered text reaches the intended field every time.

use egui::{Event, Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use crate::command::Mode;
use crate::command::keys;
use crate::command::palette;
use crate::state::State;
use crate::tests::fixture;
use crate::theme;

/// The palette with the keys of the page; their commands are carried out.
fn page() -> Harness<'static, State> {
    let mut harness = Harness::builder().with_size([800.0, 600.0]).build_ui_state(
        |ui, state: &mut State| {
            theme::apply(ui.ctx(), theme::ColourTheme::Dark);
            keys::leave_clicked(ui.ctx());
            let mut out = keys::commands(ui.ctx(), state);
            palette::show(ui, state, &mut out);
            for command in out {
                state.perform(command);
            }
        },
        fixture::without_target(),
    );
    harness.run_steps(2);
    harness
}

fn press(harness: &mut Harness<'_, State>, key: Key, modifiers: Modifiers) {
    harness.key_press_modifiers(modifiers, key);
    harness.run_steps(3);
}

fn type_text(harness: &mut Harness<'_, State>, text: &str) {
    for letter in text.chars() {
        harness.event(Event::Text(letter.to_string()));
        harness.run_steps(1);
    }
    harness.run_steps(2);
}

fn words(harness: &Harness<'_, State>) -> Option<String> {
    match &harness.state().mode {
        Mode::Palette(search) => Some(search.words.clone()),
        _ => None,
    }
}

#[test]
fn the_palette_opens_takes_what_is_typed_and_opens_again() {
    let mut harness = page();
    for text in ["layout stereo", "next panel"] {
        press(&mut harness, Key::K, Modifiers::COMMAND);
        assert_eq!(words(&harness).as_deref(), Some(""), "it is open, and empty");
        type_text(&mut harness, text);
        assert_eq!(words(&harness).as_deref(), Some(text));
        press(&mut harness, Key::Enter, Modifiers::NONE);
        assert_eq!(words(&harness), None, "Enter did it and closed the palette");
    }
    press(&mut harness, Key::K, Modifiers::COMMAND);
    type_text(&mut harness, "nothing is called that");
    harness.get_by_label("Nothing is called that. Try one word, or part of one.");
    press(&mut harness, Key::Escape, Modifiers::NONE);
    assert_eq!(words(&harness), None);
}

#[test]
fn without_a_match_the_palette_lists_no_option() {
    let mut harness = page();
    press(&mut harness, Key::K, Modifiers::COMMAND);
    type_text(&mut harness, "layout stereo");
    let options = |harness: &Harness<'_, State>| harness.query_all_by_role(egui::Role::ListBoxOption).count();
    assert!(options(&harness) > 0);
    type_text(&mut harness, " nothing is called that");
    harness.get_by_label("Nothing is called that. Try one word, or part of one.");
    assert_eq!(options(&harness), 0);
}

#[test]
fn text_typed_in_the_frame_of_enter_counts() {
    let mut harness = page();
    press(&mut harness, Key::K, Modifiers::COMMAND);
    for letter in "go to a step".chars() {
        harness.event(Event::Text(letter.to_string()));
    }
    harness.key_press(Key::Enter);
    harness.run_steps(1);
    assert!(matches!(harness.state().mode, Mode::GoTo(_)), "{:?}", harness.state().mode);
}

#[test]
fn the_arrows_choose_and_the_pointer_does_too() {
    let mut harness = page();
    press(&mut harness, Key::K, Modifiers::COMMAND);
    type_text(&mut harness, "event");
    press(&mut harness, Key::ArrowDown, Modifiers::NONE);
    match &harness.state().mode {
        Mode::Palette(search) => assert_eq!(search.chosen, 1),
        other => panic!("{other:?}"),
    }
    harness.get_by_role_and_label(egui::Role::ListBoxOption, "Next event").click();
    harness.run_steps(3);
    assert_eq!(words(&harness), None, "a click does it");
}
