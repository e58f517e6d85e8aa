//! Properties of every text: parsing does not panic, every expression has a value at every step, and parsing a formatted
//! tree gives the same tree.

use proptest::prelude::*;

use super::complete::complete;
use super::tests::RUNS;
use super::tree::{Kind, Node, Operator, Segment};
use super::*;

/// Names of every type, with and without a unit.
const NAMES: [&str; 9] = [
    "ncc",
    "sigma_m",
    "err_px",
    "roll_deg",
    "step",
    "fault",
    "peak_ratio",
    "state",
    "judge.gates.ncc.margin",
];

fn leaf() -> impl Strategy<Value = Kind> {
    let unit =
        proptest::option::of(proptest::sample::select(vec!["m", "cm", "mm", "px", "deg", "rad", "%", "s"]));
    prop_oneof![
        (0.0..1e6_f64, unit.clone())
            .prop_map(|(value, unit)| Kind::Number { value, unit: unit.map(str::to_owned) }),
        (proptest::num::f64::POSITIVE, unit)
            .prop_map(|(value, unit)| Kind::Number { value, unit: unit.map(str::to_owned) }),
        any::<bool>().prop_map(Kind::Truth),
        "[ -~σ≤]{0,8}".prop_map(Kind::Text),
        proptest::sample::select(NAMES.to_vec()).prop_map(|name| Kind::Path(path_of(name).unwrap())),
        ("[a-z_]{4,7}", 0..9_usize)
            .prop_map(|(name, n)| Kind::Path(vec![Segment::Field(format!("{name}_q")), Segment::Index(n)])),
    ]
}

fn operator() -> impl Strategy<Value = Operator> {
    use Operator::*;
    proptest::sample::select(vec![
        Or, And, Less, AtMost, More, AtLeast, Equal, Unequal, Plus, Minus, Times, Over,
    ])
}

/// Any tree, valid or not.
fn tree() -> impl Strategy<Value = Node> {
    let node = |kind: Kind| Node { kind, span: 0..0 };
    leaf().prop_map(node).prop_recursive(5, 24, 3, move |inner| {
        let one = || inner.clone().prop_map(Box::new);
        prop_oneof![
            one().prop_map(Kind::Not),
            one().prop_map(Kind::Negate),
            (operator(), one(), one()).prop_map(|(operator, a, b)| Kind::Pair(operator, a, b)),
            ("(abs|min|prev|has|changes|unknown)", proptest::collection::vec(inner.clone(), 0..3))
                .prop_map(|(name, given)| Kind::Call(name, given)),
        ]
        .prop_map(node)
    })
}

/// Texts of tokens of the language, which reach more of the parser than random letters.
fn pieces() -> impl Strategy<Value = String> {
    let piece = proptest::sample::select(vec![
        "ncc", "state", "lost", "sigma_m", "judge", ".gates", ".ncc", "[0]", "[", "]", "(", ")", "<", "<=",
        "==", "!=", "!", "&&", "||", "and", "or", "not", "+", "-", "*", "/", "%", "5", "0.3", "cm", "px",
        "deg", ",", "prev(", "changes", "differs(", "A", "B", "\"x\"", "'", "has(", "null", "true", ".",
        "sqrt(", "min(", "  ", "σ",
    ]);
    proptest::collection::vec(piece, 0..14).prop_map(|pieces| pieces.join(" "))
}

fn look_at(text: &str) -> std::result::Result<(), TestCaseError> {
    for cursor in 0..=text.chars().count() {
        let offered = complete(text, cursor);
        prop_assert!(offered.from <= offered.to && offered.to <= text.chars().count());
    }
    match Expression::read(text) {
        Err(refused) => {
            prop_assert!(!refused.sentence.is_empty() && !refused.sentence.contains('\n'));
            prop_assert!(refused.from <= refused.to && refused.to <= text.chars().count(), "{refused:?}");
        }
        Ok(read) => {
            let runs = [RUNS[0].as_slice(), RUNS[1].as_slice()];
            for index in 0..7 {
                let value = read.value(&runs, 0, index);
                let fits = match &value {
                    Value::Missing => true,
                    Value::Number(number) => read.answers() == Answers::Number && number.is_finite(),
                    Value::Truth(_) => read.answers() == Answers::Truth,
                    Value::Word(_) => read.answers() == Answers::Word,
                    Value::List(_) | Value::Record => false,
                };
                prop_assert!(fits, "{text} at {index}: {value:?}");
            }
            let again = Expression::read(&read.to_string())
                .map_err(|wrong| TestCaseError::fail(format!("{read}: {wrong}")))?;
            prop_assert_eq!(&again.tree, &read.tree);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_read_or_refused_with_a_place_inside_it(text in "\\PC{0,40}") {
        look_at(&text)?;
    }

    #[test]
    fn any_row_of_the_language_s_own_pieces_is_too(text in pieces()) {
        look_at(&text)?;
    }

    #[test]
    fn a_tree_that_is_written_is_read_as_the_same_tree(node in tree()) {
        let text = node.to_string();
        if text.chars().count() <= LENGTH_LIMIT {
            let again = parse::parse(&text).map_err(|wrong| TestCaseError::fail(format!("{text}: {wrong}")))?;
            prop_assert_eq!(again, node);
        }
    }
}
