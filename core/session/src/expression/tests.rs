//! The language on runs with known truth: the value of each expression, and the errors of invalid ones.

use std::sync::{Arc, LazyLock};

use super::complete::complete;
use super::*;
use crate::step::RunStep;
use crate::track;
use sightline_geometry::frames::{Pixel, Pose};
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

type Steps = Vec<Arc<RunStep>>;

/// Six stops towards the plane; at stop 3 both cameras are covered, at stop 5 the files are missing.
fn run(changes: &[(&str, serde_json::Value)]) -> Steps {
    let mut world =
        PlaneWorld::new((0..6).map(|k| Pose::translation(0.3 * f64::from(k), 0.0, 0.0)).collect());
    (world.troubles[3], world.troubles[5]) = (Trouble::Covered, Trouble::Missing);
    let changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    let settings = Settings::default().with(&changes).unwrap();
    let designation = Designation::new(0, Pixel::new(118.3, 131.6));
    track::run(&world, designation, &settings).unwrap().into_iter().map(Arc::new).collect()
}

/// Run A with the defaults, run B with a smaller template.
pub(super) static RUNS: LazyLock<[Steps; 2]> =
    LazyLock::new(|| [run(&[]), run(&[("template_size_px", serde_json::json!(11))])]);

fn runs() -> [&'static [Arc<RunStep>]; 2] {
    [RUNS[0].as_slice(), RUNS[1].as_slice()]
}

/// The values of an expression over run A.
fn values(text: &str) -> Vec<Value> {
    let expression = Expression::read(text).unwrap_or_else(|refused| panic!("{text}: {refused}"));
    (0..6).map(|index| expression.value(&runs(), 0, index)).collect()
}

/// The stops of run A at which a condition is true.
fn hits(text: &str) -> Vec<usize> {
    let is_true = |(_, value): &(usize, Value)| *value == Value::Truth(true);
    values(text).into_iter().enumerate().filter(is_true).map(|(step, _)| step).collect()
}

fn refused(text: &str) -> Refused {
    match Expression::read(text) {
        Err(refused) => refused,
        Ok(read) => panic!("{text} was read as {read}"),
    }
}

fn numbers(steps: impl Fn(&RunStep) -> Option<f64>) -> Vec<Value> {
    RUNS[0].iter().map(|trace| steps(trace).map_or(Value::Missing, Value::Number)).collect()
}

#[test]
fn a_column_is_the_row_s_value_and_missing_where_the_row_has_none() {
    assert_eq!(values("ncc"), numbers(|trace| trace.row().ncc));
    assert_eq!(values("roll_deg").len(), 6);
    for (value, trace) in values("sigma_m").iter().zip(RUNS[0].iter()) {
        assert_eq!(*value, trace.row().sigma_m.map_or(Value::Missing, Value::Number));
    }
    assert_eq!(values("ncc")[0], Value::Missing, "nothing is matched at the designation");
}

#[test]
fn a_path_reaches_any_value_of_any_stage() {
    let evidence = |trace: &RunStep| Some(trace.template()?.match_template.as_ref()?.peak.score);
    assert_eq!(values("locate.evidence.match_template.peak.score"), numbers(evidence));
    let margin = |trace: &RunStep| trace.verdict()?.gates.iter().find(|gate| gate.name == "ncc")?.margin;
    assert_eq!(values("judge.gates.ncc.margin"), numbers(margin));
    let covariance = |trace: &RunStep| Some(trace.update.target.covariance_in_rover[(0, 1)]);
    assert_eq!(values("covariance_in_rover.xy"), numbers(covariance));
    let taken = |trace: &RunStep| Some(trace.update.target.memory.template()?.appearance.step as f64);
    assert_eq!(values("update.target.appearance.step"), numbers(taken));
    assert_eq!(values("judge.gates[0].margin"), numbers(margin));
    let second =
        |trace: &RunStep| Some(trace.template()?.match_template.as_ref()?.second_peak.as_ref()?.ratio);
    assert_eq!(values("peak_ratio"), numbers(second));
    let x = |trace: &RunStep| Some(trace.located()?.left_pixel?.x);
    assert_eq!(values("locate.left_pixel.x"), numbers(x));
    let forward = |trace: &RunStep| Some(trace.update.target.position_in_rover.x);
    assert_eq!(values("update.target.position_in_rover.x"), numbers(forward));
    assert_eq!(values("position_in_rover[0]"), numbers(forward));
    let travelled = |trace: &RunStep| Some(trace.prediction()?.step_length_m);
    assert_eq!(values("predict.step_length_m"), numbers(travelled));
    let gates = |trace: &RunStep| Some(trace.verdict()?.gates.len() as f64);
    assert_eq!(values("count(judge.gates)"), numbers(gates));
    assert_eq!(values("update.state.state")[1], Value::Word("tracking".to_owned()));
    assert_eq!(values("time_s"), numbers(|trace| Some(trace.time_s)));
}

#[test]
fn words_are_compared_with_and_without_quotes() {
    let lost: Vec<usize> =
        RUNS[0].iter().filter(|trace| trace.update.state.word() == "lost").map(|trace| trace.step).collect();
    assert!(lost.contains(&3), "the covered stop is lost: {lost:?}");
    for text in ["state == \"lost\"", "state == 'lost'", "state == lost", "lost == state"] {
        assert_eq!(hits(text), lost, "{text}");
    }
    assert_eq!(hits("state != lost").len(), 6 - lost.len());
    assert_eq!(hits("contains(reason, \"NCC\")"), hits("contains(reason, Ncc) "));
    assert_eq!(hits("fault"), [5]);
}

#[test]
fn what_is_missing_compares_as_false_and_can_be_asked_for() {
    assert_eq!(values("ncc < 2")[0], Value::Truth(false));
    assert_eq!(values("ncc >= -2")[0], Value::Truth(false));
    assert_eq!(values("ncc != 0.5")[0], Value::Truth(false));
    assert_eq!(values("!(ncc < 2)")[0], Value::Truth(true));
    assert_eq!(values("ncc + 1")[0], Value::Missing);
    assert_eq!(hits("missing(ncc)"), hits("!has(ncc)"));
    assert!(hits("missing(ncc)").contains(&0) && hits("missing(ncc)").contains(&5));
    assert_eq!(values("sqrt(0 - 1)")[0], Value::Missing);
    assert_eq!(values("step / 0")[1], Value::Missing);
    assert_eq!(values("0 / 0")[0], Value::Missing);
}

#[test]
fn the_step_before_is_seen_by_prev_and_changes() {
    let before = values("prev(ncc)");
    assert_eq!(before[0], Value::Missing);
    assert_eq!(before[1..], values("ncc")[..5]);
    assert_eq!(values("prev(prev(step))")[3], Value::Number(1.0));
    let words: Vec<&str> = RUNS[0].iter().map(|trace| trace.update.state.word()).collect();
    let changed: Vec<usize> = (1..6).filter(|&k| words[k] != words[k - 1]).collect();
    assert!(!changed.is_empty());
    assert_eq!(hits("state changes"), changed);
    assert_eq!(hits("changes(state)"), changed);
    assert!(hits("ncc changes").contains(&1), "from missing to a value is a change");
}

#[test]
fn numbers_convert_between_units_and_bare_ones_take_the_unit_beside_them() {
    let sigma = |at: usize| RUNS[0][at].row().sigma_m.unwrap();
    for at in 0..6 {
        let half_cm = Value::Truth(sigma(at) > 0.005);
        for text in
            ["sigma_m > 0.5 cm", "sigma_m > 5 mm", "sigma_m > 0.005 m", "sigma_m > 0.005", "0.005 < sigma_m"]
        {
            assert_eq!(values(text)[at], half_cm, "{text} at {at}");
        }
    }
    assert_eq!(values("roll_deg < 3")[1], values("roll_deg < 3 deg")[1]);
    let roll = RUNS[0][1].row().roll_deg.unwrap();
    let Value::Number(sum) = values("roll_deg + 1")[1] else { panic!("no sum") };
    assert!((sum - (roll + 1.0)).abs() < 1e-12, "{sum} against {roll} + 1");
    assert_eq!(
        values("50 % * 4")[0],
        Value::Number(200.0),
        "the unit of a product with a share is the share's"
    );
    assert_eq!(values("max(1, sigma_m, 2 cm)")[0], Value::Number(1.0));
    assert_eq!(values("hypot(3 cm, 40 mm)")[0], Value::Number(5.0));
}

#[test]
fn the_unit_of_a_result_is_known() {
    let unit = |text: &str| Expression::read(text).unwrap().unit().to_owned();
    assert_eq!(unit("sigma_m"), "m");
    assert_eq!(unit("2 * sigma_m"), "m");
    assert_eq!(unit("err_m / range_m"), "");
    assert_eq!(unit("err_m / err_px"), "m/px");
    assert_eq!(unit("roll_deg + 1 rad"), "deg");
    assert_eq!(unit("sqrt(sigma_m * sigma_m)"), "m");
    assert_eq!(unit("5 cm + sigma_m"), "cm");
    assert_eq!(unit("judge.gates.position_correction_m.limit"), "m");
    assert_eq!(unit("update.target.covariance_in_rover[0]"), "m²");
    assert_eq!(unit("locate.left_pixel.x"), "px");
    assert_eq!(unit("position_in_rover.x"), "m");
    assert_eq!(unit("covariance_in_rover.xx"), "m²");
    assert_eq!(unit("update.target.drift.covariance_px2.xy"), "px²");
    assert_eq!(unit("step"), "");
}

#[test]
fn precedence_is_that_of_arithmetic_and_logic() {
    assert_eq!(values("1 + 2 * 3")[0], Value::Number(7.0));
    assert_eq!(values("(1 + 2) * 3")[0], Value::Number(9.0));
    assert_eq!(values("8 - 2 - 1")[0], Value::Number(5.0));
    assert_eq!(values("8 / 2 / 2")[0], Value::Number(2.0));
    assert_eq!(values("-2 * -3")[0], Value::Number(6.0));
    assert_eq!(hits("true || false && false").len(), 6);
    assert_eq!(hits("(true || false) && false"), [0; 0]);
    assert_eq!(hits("not step < 4"), [4, 5]);
    assert_eq!(hits("step > 1 and not step > 3 or step == 5"), [2, 3, 5]);
    assert_eq!(hits("abs(step - 3) <= 1"), [2, 3, 4]);
    assert_eq!(hits("step ≥ 4"), [4, 5]);
}

#[test]
fn runs_are_compared_by_their_letters() {
    let expression = Expression::condition("differs(A, B, ncc, 0.0001)").unwrap();
    assert_eq!(expression.runs_compared(), [0, 1]);
    for index in 0..6 {
        let scores = [0, 1].map(|run| RUNS[run][index].row().ncc);
        let expected = match scores {
            [Some(a), Some(b)] => (a - b).abs() > 0.0001,
            [a, b] => a.is_some() != b.is_some(),
        };
        for run in [0, 1] {
            assert_eq!(expression.is_true(&runs(), run, index), expected, "step {index}");
        }
    }
    assert!((1..3).any(|index| expression.is_true(&runs(), 0, index)), "a smaller template scores otherwise");
    let alone = [runs()[0]];
    assert!(
        (0..6).all(|index| !expression.is_true(&alone, 0, index)),
        "a run that is not there differs nowhere"
    );
    let words = Expression::condition("differs(A, B, state)").unwrap();
    assert!(!words.is_true(&runs(), 0, 1));
    assert_eq!(run_number("C"), Some(2));
    assert_eq!(run_number("A1"), Some(26));
    assert_eq!((run_number("A0"), run_number("ncc"), run_number("A01")), (None, None, None));
}

#[test]
fn what_cannot_be_compared_is_refused_with_both_units() {
    let wrong = refused("sigma_m < err_px");
    assert_eq!(wrong.sentence, "`<` takes one unit, but `sigma_m` is in m and `err_px` is in px");
    assert!(refused("ncc < 5 cm").sentence.contains("`ncc` is without a unit"), "{}", refused("ncc < 5 cm"));
    assert!(refused("sigma_m > 5 %").sentence.contains("share"));
    assert!(refused("err_px + err_m > 1").sentence.contains("`+`"));
    assert!(refused("sqrt(sigma_m)").sentence.contains("no square root"));
    assert!(refused("max(sigma_m, err_px)").sentence.contains("`max`"));
    assert!(refused("differs(A, B, sigma_m, 2 px)").sentence.contains("in px"));
}

#[test]
fn an_unknown_name_is_refused_at_its_place_with_the_nearest_known_one() {
    let wrong = refused("step > 3 && nccc < 0.6");
    assert_eq!((wrong.from, wrong.to), (12, 16));
    assert_eq!(wrong.to_string(), "at character 13, there is no name `nccc`");
    assert_eq!(wrong.hint.as_deref(), Some("Did you mean `ncc`?"));
    let deep = refused("judge.gates.nccs.margin > 0");
    assert_eq!((deep.from, deep.to), (12, 16));
    assert_eq!(deep.hint.as_deref(), Some("Did you mean `ncc`?"));
    assert!(refused("predict.step_lenght_m > 1").hint.unwrap().contains("step_length_m"));
    assert!(refused("peak_ratio.ratio > 1").sentence.contains("has no parts"));
    assert!(refused("flor(ncc) > 1").sentence.contains("no function `flor`"));
    assert!(refused("state == lots").hint.unwrap().contains("lost"));
    let label = refused("match score < 0.85").hint;
    assert_eq!(label.as_deref(), Some("In expressions, “match score” is `ncc`."));
    assert!(refused("contains(ncc, \"a\")").sentence.contains("takes a text"));
    assert!(refused("differs(A, Q9x, ncc)").sentence.contains("is not a run"));
    assert!(refused("differs(A, A, ncc)").sentence.contains("never differs from itself"));
    assert!(refused("differs(A, B, differs(A, B, ncc))").sentence.contains("nested in another"));
}

#[test]
fn every_kind_of_bad_text_gets_one_sentence_with_its_place() {
    for (text, from, words) in [
        ("", 0, "no expression yet"),
        ("ncc <", 5, "ends too soon"),
        ("(ncc < 1", 0, "never closed"),
        ("ncc < 1)", 7, "has no matching"),
        ("ncc = 1", 4, "write `==`"),
        ("a < b < c", 2, "do not chain"),
        ("ncc < 0.6 step > 1", 10, "an operator is missing"),
        ("ncc < 5 furlongs", 8, "is no unit"),
        ("state == \"lost", 9, "no closing quote"),
        ("ncc == null", 7, "null"),
        ("ncc && true", 0, "takes conditions"),
        ("state < lost", 0, "takes numbers"),
        ("ncc == lost", 7, "there is no name `lost`"),
        ("abs(1, 2) > 1", 0, "its form is `abs(x)`"),
        ("ncc < 1e999", 6, "too large"),
        ("$ncc", 0, "has no meaning"),
        ("1 + !fault", 4, "is not allowed here"),
        ("judge.", 6, "must follow the dot"),
        ("judge.gates[x]", 12, "whole number"),
    ] {
        let wrong = refused(text);
        assert!(wrong.sentence.contains(words), "{text}: {wrong}");
        assert_eq!(wrong.from, from, "{text}: {wrong}");
        assert!(!wrong.sentence.trim_end().ends_with('.') && !wrong.sentence.contains(". "), "{wrong}");
    }
    assert!(Expression::condition("ncc").unwrap_err().sentence.contains("a breakpoint is a condition"));
    assert!(Expression::column("state").unwrap_err().sentence.contains("cannot be plotted"));
    assert!(Expression::read("judge").unwrap_err().sentence.contains("record"));
    assert!(Expression::read("judge.gates").unwrap_err().sentence.contains("list"));
}

#[test]
fn a_place_is_counted_in_characters_and_not_in_bytes() {
    let wrong = refused("\"σσσ\" == reason && nccc > 1");
    assert_eq!((wrong.from, wrong.to), (19, 23));
}

#[test]
fn length_depth_and_parts_are_limited() {
    let long = format!("{} < 1", "n".repeat(LENGTH_LIMIT));
    assert!(refused(&long).sentence.contains("characters"));
    let deep = format!("{}1{} < 2", "(".repeat(DEPTH_LIMIT + 1), ")".repeat(DEPTH_LIMIT + 1));
    assert!(refused(&deep).sentence.contains("levels of nesting"));
    let many = vec!["1"; NODE_LIMIT].join("+");
    assert!(refused(&many).sentence.contains("parts"));
}

#[test]
fn every_gate_and_every_column_of_a_real_run_is_in_the_catalogue() {
    let names: Vec<String> = catalogue::all_names().into_iter().map(|name| name.name).collect();
    for gate in RUNS[0].iter().filter_map(|trace| trace.verdict()).flat_map(|verdict| &verdict.gates) {
        assert!(names.contains(&format!("judge.gates.{}.margin", gate.name)), "{}", gate.name);
    }
    let row = serde_json::to_value(RUNS[0][1].row()).unwrap();
    for column in row.as_object().unwrap().keys() {
        assert!(names.contains(column), "{column}");
    }
    // Every field of a recorded step can be named, except the private fields of the tracker's memory.
    let trace = serde_json::to_value(RUNS[0][1].as_ref()).unwrap();
    let mut open = vec![(String::new(), trace)];
    while let Some((path, value)) = open.pop() {
        if let Some(fields) = value.as_object().filter(|_| path != "update.target.memory") {
            assert!(path.is_empty() || names.contains(&path), "{path}");
            open.extend(fields.iter().map(|(name, value)| {
                (if path.is_empty() { name.clone() } else { format!("{path}.{name}") }, value.clone())
            }));
        }
    }
}

#[test]
fn every_short_name_has_a_meaning_and_reads_as_what_the_catalogue_says() {
    for name in catalogue::all_names() {
        assert!(!name.meaning.is_empty() || name.stage != "row", "{} has no meaning", name.name);
        match name.kind {
            catalogue::NameKind::Number => {
                let read =
                    Expression::read(&name.name).unwrap_or_else(|wrong| panic!("{}: {wrong}", name.name));
                assert_eq!(
                    (read.answers(), read.unit()),
                    (Answers::Number, name.unit.as_str()),
                    "{}",
                    name.name
                );
            }
            catalogue::NameKind::Truth => {
                assert_eq!(Expression::read(&name.name).unwrap().answers(), Answers::Truth, "{}", name.name);
            }
            _ => {}
        }
    }
}

#[test]
fn completion_offers_names_with_units_words_after_a_comparison_and_parts_after_a_point() {
    let texts = |text: &str| -> Vec<String> {
        complete(text, text.chars().count()).candidates.into_iter().map(|c| c.text).collect()
    };
    assert_eq!(texts("nc")[0], "ncc");
    let sigma = complete("ncc < 1 && sig", 14);
    assert_eq!((sigma.from, sigma.to, sigma.candidates[0].text.as_str()), (11, 14, "sigma_m"));
    assert_eq!(sigma.candidates[0].unit, "m");
    assert!(!sigma.candidates[0].meaning.is_empty());
    assert_eq!(texts("state == "), ["cleared", "tracking", "lost", "failed"]);
    assert_eq!(texts("state == lo"), ["lost"]);
    assert!(texts("judge.gates.").contains(&"judge.gates.ncc.".to_owned()));
    assert!(texts("judge.gates.ncc.").contains(&"judge.gates.ncc.margin".to_owned()));
    assert!(texts("predict.tra").contains(&"predict.travelled_m".to_owned()));
    assert!(texts("prev(err").contains(&"err_px".to_owned()));
    assert!(texts("hyp").contains(&"hypot(".to_owned()));
    assert!(texts("sigma_m > 5 ").contains(&"cm".to_owned()));
    assert!(texts("ncc ").contains(&"< ".to_owned()));
    // After an operator whose operands must have the same unit, names with that unit come first.
    for text in
        ["ncc < ", "sigma_m >= ", "step > 2 && err_px < ", "(hypot(err_m, 2 cm) - ", "not scale * 2 == "]
    {
        let first = &texts(text)[0];
        let whole = format!("{text}{first}{}", if text.starts_with('(') { ")" } else { "" });
        assert!(Expression::read(&whole).is_ok(), "{whole}");
    }
    assert_eq!(texts("err_m < s")[0], "sigma_m", "a length before a scale");
    assert_eq!(texts("ncc < s")[0], "scale");
    assert_eq!(complete("ncc", 99).to, 3);
    assert!(complete("\"open", 5).candidates.is_empty());
}
