//! The panels' display of compared runs, and the commands of their controls.

use crate::tests::compare::*;

#[test]
fn the_top_bar_chooses_the_run_to_compare_with_and_takes_it_out() {
    let mut shown = Shown::new([1500.0, 300.0], |context| two_runs(context, 3), bars::top);
    shown.click("compared with: none");
    assert_eq!(shown.click("run B"), vec![Command::Compare(CompareCommand::With { place: 0, run: Some(B) })]);
    let mut shown = Shown::new([1500.0, 300.0], |context| compared(context, 3), bars::top);
    shown.says("selected run: run A").says("compared with: run B").says("third run compared: +");
    assert_eq!(
        shown.click("take compared with out"),
        vec![Command::Compare(CompareCommand::With { place: 0, run: None })]
    );
    let alone = Shown::new([1500.0, 300.0], |context| fixture::at_step(context, 3), bars::top);
    alone.says("compared with none");
}

#[test]
fn no_words_of_the_top_bar_overlap_with_two_runs() {
    for width in [820.0, 960.0, 1024.0, 1280.0, 1440.0] {
        let shown = Shown::new([width, 60.0], |context| compared(context, 3), bars::top);
        let texts = shown.harness.output().shapes.iter().filter_map(|clipped| match &clipped.shape {
            egui::Shape::Text(text) => {
                let seen = clipped.shape.visual_bounding_rect().intersect(clipped.clip_rect);
                let is_seen = seen.is_positive() && !text.galley.text().is_empty();
                is_seen.then(|| (text.galley.text().to_owned(), seen.shrink(0.5)))
            }
            _ => None,
        });
        let texts: Vec<(String, egui::Rect)> = texts.collect();
        assert!(texts.iter().any(|(words, _)| words == "run A"), "{width}: {texts:?}");
        for (number, (words, place)) in texts.iter().enumerate() {
            assert!(place.right() <= width, "{width}: {words} is cut off");
            for (other, there) in &texts[number + 1..] {
                assert!(!there.intersects(*place), "{width}: {words} is over {other}");
            }
        }
    }
}

#[test]
fn the_status_line_has_the_differences_and_the_other_runs_state() {
    let shown = Shown::new([1700.0, 60.0], |context| compared(context, 3), bars::top);
    // 40 px less 4.5 px.
    shown.says("Δ+35.50").says("LOST").says("TRACKING").says("Δ±0");
}

#[test]
fn the_row_above_the_image_says_the_sentence_and_chooses_how_to_compare() {
    let mut shown = panel(Pane::Left, View::Marks);
    shown.says("vs run B: first differ at step 3 in match_template");
    let (view, button) = ("compare by: marks", "First divergence (D)");
    let top = |label: &str| shown.harness.get_by_label(label).rect().center().y;
    assert!((top(view) - top(button)).abs() < 8.0, "one row: {} and {}", top(view), top(button));
    assert_eq!(shown.click("First divergence (D)"), vec![Command::Compare(CompareCommand::FirstDivergence)]);
    shown.click("compare options");
    shown.says("align by step").says("ignore below none");
    assert_eq!(shown.click("hold target"), vec![Command::Compare(CompareCommand::Stabilise)]);
    let mut shown = panel(Pane::Left, View::Marks);
    shown.click("compare options");
    assert_eq!(shown.click("overlay previous step"), vec![Command::Compare(CompareCommand::OnionSkin)]);
    let mut shown = panel(Pane::Left, View::Marks);
    shown.click("compare by: marks");
    assert_eq!(shown.click("difference"), vec![Command::Compare(CompareCommand::View(View::Difference))]);
}

#[test]
fn all_runs_are_marked_on_one_image_with_their_names() {
    let mut shown = panel(Pane::Left, View::Marks);
    shown.click("legend");
    assert_eq!(shown.click("compared: run B (legend)"), vec![Command::ToggleLayer(Layer::Compared)]);
    assert!(paints(&shown, "run B"));
    let hidden = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 3);
        state.perform(Command::ToggleLayer(Layer::Compared));
        state
    });
    assert!(!paints(&hidden, "run B"));
}

#[test]
fn the_right_image_marks_the_compared_runs_as_well() {
    let mut shown = panel(Pane::Right, View::Marks);
    shown.click("legend");
    assert_eq!(shown.click("compared: run B (legend)"), vec![Command::ToggleLayer(Layer::Compared)]);
    assert!(paints(&shown, "run B"));
}

#[test]
fn marks_of_another_stop_are_not_painted_on_this_one() {
    let shown = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 2);
        state.perform(Command::Compare(CompareCommand::Align(Alignment::Distance)));
        twice_as_far(&mut state);
        state
    });
    assert!(paints(&shown, "run B is at step 1: press V for its own image"));
    assert!(!paints(&shown, "run B"));
}

#[test]
fn side_by_side_shows_each_run_about_its_own_target() {
    let shown = panel(Pane::Left, View::SideBySide);
    shown.says("left image, run A: lost, ncc 0.41").says("left image, run B: tracking, ncc 0.41");
    let rects = ["left image, run A: lost, ncc 0.41", "left image, run B: tracking, ncc 0.41"]
        .map(|label| shown.harness.get_by_label(label).rect());
    assert!(rects[0].right() <= rects[1].left() && (rects[0].width() - rects[1].width()).abs() < 1.0);
    // While a target is being picked, the whole image is shown.
    let picking = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 3);
        (state.compare.view, state.mode) = (View::SideBySide, Mode::Pick);
        state
    });
    assert!(picking.harness.query_by_label("left image, run A: lost, ncc 0.41").is_none());
}

#[test]
fn the_divider_of_the_wipe_moves_by_drag_and_by_keyboard_and_its_keys_do_not_step() {
    let label = "wipe divider, per cent of the image's width";
    let mut shown = Shown::new(
        [760.0, 480.0],
        |context| {
            let mut state = compared(context, 3);
            state.compare.view = View::Wipe;
            state
        },
        |ui, state, out| {
            out.extend(crate::command::keys::commands(ui.ctx(), state));
            show_pane(ui, Pane::Left, state, out);
        },
    );
    shown.harness.get_by_label(label).focus();
    shown.harness.run_steps(2);
    shown.harness.state_mut().clear();
    shown.harness.key_press(Keyboard::ArrowRight);
    shown.harness.run_steps(1);
    let commands = std::mem::take(shown.harness.state_mut());
    assert_eq!(commands, vec![Command::Compare(CompareCommand::Wipe(0.55))]);
    shown.harness.key_press(Keyboard::Home);
    shown.harness.run_steps(1);
    assert_eq!(std::mem::take(shown.harness.state_mut()), vec![Command::Compare(CompareCommand::Wipe(0.0))]);
    let middle = shown.harness.get_by_label(label).rect().center();
    shown.harness.drag_at(middle);
    shown.harness.hover_at(middle + egui::vec2(60.0, 0.0));
    shown.harness.run_steps(1);
    let commands = std::mem::take(shown.harness.state_mut());
    let is_right =
        |command: &Command| matches!(command, Command::Compare(CompareCommand::Wipe(at)) if *at > 0.5);
    assert!(commands.iter().any(is_right), "{commands:?}");
    assert!(paints(&shown, "run A") && paints(&shown, "run B"));
}

#[test]
fn the_other_run_shows_while_x_is_held_and_nothing_flashes_by_itself() {
    let mut shown = Shown::new(
        [760.0, 480.0],
        |context| compared(context, 3),
        |ui, state, out| {
            out.extend(crate::command::keys::commands(ui.ctx(), state));
            show_pane(ui, Pane::Left, state, out);
        },
    );
    shown.harness.state_mut().clear();
    shown.harness.key_down(Keyboard::X);
    shown.harness.run_steps(1);
    assert_eq!(
        std::mem::take(shown.harness.state_mut()),
        vec![Command::Compare(CompareCommand::Blink(true))]
    );
    shown.harness.key_up(Keyboard::X);
    shown.harness.run_steps(1);
    assert!(shown.harness.state_mut().is_empty(), "this state does not blink: nothing has to end");
    let still = panel(Pane::Left, View::Blink);
    assert!(paints(&still, "hold X to see run B"));
    let held = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 3);
        (state.compare.view, state.compare.is_blinking) = (View::Blink, true);
        state
    });
    assert!(paints(&held, "run B") && !paints(&held, "hold X to see run B"));
}

#[test]
fn the_difference_has_a_row_for_template_and_match_with_its_correlation() {
    let shown = panel(Pane::Left, View::Difference);
    shown.says("run A less run B").says("matched patch: ncc of run A and run B");
    shown.says("warped template: ncc of run A and run B").says("cut to what both have");
    let missing = Shown::pane(Pane::Left, |context| {
        let mut state = compared(context, 0);
        state.compare.view = View::Difference;
        state.cursor.step = 0;
        state
    });
    missing.says("less run B");
}

#[test]
fn titles_of_compared_patches_are_clear_of_each_other() {
    for width in [320.0, 420.0, 760.0] {
        let shown = Shown::new(
            [width, 480.0],
            |context| {
                let mut state = compared(context, 3);
                state.compare.view = View::Difference;
                state
            },
            |ui, state, out| {
                show_pane(ui, Pane::Left, state, out);
            },
        );
        for patch in ["warped template", "matched patch"] {
            let rect = |run: &str| shown.harness.get_by_label(&format!("{patch}, {run}")).rect();
            let [own, other] = ["run A", "run B"].map(rect);
            assert!(own.right() <= other.left() && own.top() == other.top(), "{width}: {own:?} {other:?}");
            let differences = shown.harness.query_all_by_label("difference").map(|node| node.rect());
            let mut clear = differences.filter(|rect| rect.left() >= other.right());
            assert!(clear.any(|rect| rect.top() == other.top()), "{width}: {patch}");
        }
    }
}

#[test]
fn a_held_target_stays_in_the_middle_of_the_image() {
    let middle = std::rc::Rc::new(std::cell::Cell::new(None));
    for (view, scale) in [(View2d::Fit, 4.0), (View2d::At { centre: Pixel::new(3.0, 9.0), scale: 7.0 }, 7.0)]
    {
        let seen = middle.clone();
        Shown::new(
            [520.0, 420.0],
            move |context| {
                let mut state = fixture::at_step(context, 2);
                state.views.left = view;
                state.perform(Command::Compare(CompareCommand::Stabilise));
                state
            },
            move |ui, state, out| {
                let shown = images_left::show(ui, state, out);
                seen.set(shown.map(|(transform, _)| transform));
            },
        );
        let transform = middle.get().unwrap();
        assert!(transform.to_screen(fixture::PIXEL).distance(transform.rect.center()) < 0.01);
        assert_eq!(transform.scale, scale);
    }
}

#[test]
fn the_step_before_shines_through_and_says_so() {
    let shown = Shown::pane(Pane::Left, |context| {
        let mut state = fixture::at_step(context, 2);
        let raster =
            state.cache.raster(&state.image_key(2, crate::cache::ImageSide::Left).unwrap()).ready().unwrap();
        let values = raster.values.clone();
        let bytes = sightline_vision::image::io::encode_png_u8(&values).unwrap();
        let raster = Raster::from_png(context, "left", &bytes).unwrap();
        let key = state.image_key(1, crate::cache::ImageSide::Left).unwrap();
        state.cache.store(key, Ok(Item::Raster(Arc::new(raster))), 0.0);
        state.perform(Command::Compare(CompareCommand::OnionSkin));
        state
    });
    assert!(paints(&shown, "step 1 shines through"));
}

#[test]
fn gates_and_inspector_say_what_differs_from_the_other_run() {
    let gates = panel(Pane::Gates, View::Marks);
    gates.says("Δ vs run B: ±0, limit Δ +0.400; it passes there");
    let inspector = Shown::pane(Pane::Inspector, |context| {
        let mut state = compared(context, 3);
        state.stage = Stage::MATCH_TEMPLATE;
        state
    });
    inspector.says("Δ vs run B: 1 value differs").says("pixel x (px)").says("−8");
    let alike = Shown::pane(Pane::Inspector, |context| {
        let mut state = compared(context, 2);
        state.stage = Stage::MATCH_TEMPLATE;
        state
    });
    alike.says("Δ vs run B: identical");
}

#[test]
fn score_surfaces_stand_side_by_side() {
    let shown = panel(Pane::Surface, View::Marks);
    shown.says("match scores of run A: peak 0.410").says("match scores of run B: peak 0.410");
}

#[test]
fn plots_and_map_name_all_compared_runs() {
    panel(Pane::Plots, View::Marks).says("run B");
    panel(Pane::Map, View::Marks).says("target, run B");
}

#[test]
fn the_table_links_every_metric_to_its_worst_step() {
    let mut shown = Shown::new(
        [1500.0, 900.0],
        |context| compared(context, 3),
        |ui, state, out| {
            show_pane(ui, Pane::Runs, state, out);
        },
    );
    shown.says("ridge · run A").says("ridge · run B").says("states: tracking 0 to 2, lost 3, failed 4");
    shown.says("ncc_min=0.3").says("protocol: sightline").says("left out of all metrics: step 0");
    shown.says("SETTINGS THAT DIFFER").says("0.3").says("0.7");
    let label = "max_px 5.500 of ridge · run B, worst at step 4";
    assert_eq!(shown.click(label), vec![Command::Compare(CompareCommand::Visit { run: B, step: 4 })]);
    let star = shown.click("baseline: ridge · run A");
    assert_eq!(star, vec![Command::Compare(CompareCommand::Baseline(A))]);
    assert_eq!(shown.click("compare ridge · run B"), vec![Command::Compare(CompareCommand::Toggle(B))]);
    let sort = Sort { metric: Some("max_px".to_owned()), is_descending: false };
    assert_eq!(shown.click("sort by max_px"), vec![Command::Compare(CompareCommand::Sort(sort))]);
}

#[test]
fn the_table_is_sorted_and_filtered_and_the_baseline_decides_which_settings_show() {
    let mut state = compared(&Context::default(), 3);
    assert_eq!(runs::table::order(&state), [A, B]);
    // Run A has the smaller maximum error (0.5 px against 5.5 px), run B survives longer.
    for (metric, is_descending, expected) in
        [("max_px", true, [B, A]), ("max_px", false, [A, B]), ("survival_steps", true, [B, A])]
    {
        let sort = Sort { metric: Some(metric.to_owned()), is_descending };
        state.perform(Command::Compare(CompareCommand::Sort(sort)));
        assert_eq!(runs::table::order(&state), expected, "{metric}");
    }
    state.perform(Command::Compare(CompareCommand::Filter("ncc_MIN".to_owned())));
    assert_eq!(runs::table::order(&state), [B]);
    let shown = Shown::new(
        [1500.0, 900.0],
        |context| {
            let mut state = compared(context, 3);
            state.perform(Command::Compare(CompareCommand::Baseline(B)));
            state
        },
        |ui, state, out| {
            show_pane(ui, Pane::Runs, state, out);
        },
    );
    shown.says("settings unlike run B").says("ncc_min=0.7").says("Δ−5");
    let none = Shown::pane(Pane::Runs, |context| {
        let mut state = compared(context, 3);
        state.perform(Command::Compare(CompareCommand::Filter("nonsense".to_owned())));
        state
    });
    none.says("No run has these words").says("0 of 2 runs");
}

#[test]
fn the_uncertainty_has_a_sentence_for_each_run_and_words_for_each_plot() {
    let shown = panel(Pane::Uncertainty, View::Marks);
    shown.says("run A: covariance about right: mean NEES 2.1, band").says("run B: covariance about right");
    shown.says("NEES, squared Mahalanobis distance of the error, over the steps; run A: mean 2.10");
    shown.says("NIS, squared Mahalanobis").says("coverage: 100 % of the steps within 3 σ, 97 % expected");
    let asked = Shown::pane(Pane::Uncertainty, |context| fixture::at_step(context, 2));
    asked.says("are being computed");
    let without = Shown::pane(Pane::Uncertainty, |context| {
        let mut state = fixture::at_step(context, 2);
        state.compare.wants_metrics = true;
        let mut traces = traces_a();
        traces.iter_mut().for_each(|trace| trace.truth = None);
        let steps: Vec<_> = traces.into_iter().map(Arc::new).collect();
        for _ in calls_of::<ShowMetrics>(&mut state) {
            calls::answer::<ShowMetrics>(&mut state, &metrics(&steps));
        }
        state
    });
    without.says("NEES needs the truth");
}
