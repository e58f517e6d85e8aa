//! Labels that are read, labels that are rejected, and arbitrary bytes.

use super::*;
use proptest::prelude::*;

const LABEL: &str = "PDS_VERSION_ID = PDS3\r\n/* FILE */\r\nRECORD_BYTES = 2048\r\n^IMAGE = \
    (\"A.IMG\"\r\n      ,25 <BYTES>)\r\nMSL:FLAG = B\r\nEMPTY =\r\nTEXT = \"one\r\n     two\"\r\n\
    GROUP = G\r\n ANGLES = (1.5 <rad>,\r\n -2e-3 <rad>)\r\n MASK = 2#0000111111111111#\r\nEND_GROUP = G\r\n\
    GROUP = G\r\n SPICE =\r\n  \"x.chronos\"\r\n SET = {A, (1,2)}\r\nEND_GROUP\r\nABSENT = \"N/A\"\r\nEND\r\n\0\u{1}";

#[test]
fn a_label_with_every_form_of_value_is_read() {
    let label = Group::parse(LABEL.as_bytes()).unwrap();
    assert_eq!(label.number("RECORD_BYTES"), Some(2048.0));
    let pointer = label.value("^IMAGE").unwrap().items();
    assert_eq!((pointer[0].text(), pointer[1].number()), (Some("A.IMG"), Some(25.0)));
    assert!(pointer[1].has_unit("BYTES"));
    assert_eq!(label.text("FLAG"), Some("B"));
    assert_eq!((label.value("EMPTY"), label.text("ABSENT")), (None, None));
    assert_eq!(label.text("TEXT"), Some("one two"));
    assert_eq!(label.groups[0].numbers("ANGLES"), Some(vec![1.5, -2e-3]));
    assert_eq!(label.groups[0].number("MASK"), Some(4095.0));
    let last = label.last_group(|name| name == "G").unwrap();
    assert_eq!(last.text("SPICE"), Some("x.chronos"));
    assert_eq!(last.value("SET").unwrap().items().len(), 2);
}

#[test]
fn what_would_misplace_data_is_refused_with_its_line() {
    for (text, line, part) in [
        ("A = 1\nGROUP = G\nEND_GROUP = H\nEND\n", 3, "closes G"),
        ("A = 1\nB = \"open\nEND\n", 2, "never closed"),
        ("A = (1, 2\nB = 3\nEND\n", 2, "expected ','"),
        ("A = 1\nGROUP = G\nEND\n", 4, "ends inside G"),
        ("A = 1\n", 2, "stops before its END"),
        ("A 1\nEND\n", 1, "expected '='"),
        ("END_GROUP = G\nEND\n", 1, "without a group"),
        ("A = 5 <ms\nEND\n", 1, "closing '>'"),
    ] {
        let problem = Group::parse(text.as_bytes()).unwrap_err();
        assert!(problem.problem.contains(part), "{text:?}: {problem}");
        assert_eq!(problem.line, line, "{text:?}: {problem}");
    }
    let deep = format!("A = {}\nEND\n", "(".repeat(100_000));
    assert!(Group::parse(deep.as_bytes()).unwrap_err().problem.contains("deeper"));
    let deep = "GROUP = G\n".repeat(100_000);
    assert!(Group::parse(deep.as_bytes()).unwrap_err().problem.contains("deeper"));
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = Group::parse(&bytes);
    }

    #[test]
    fn arbitrary_marks_never_panic(text in "([A-Z1#]|=|[(]|[)]|[{]|[}]|<|>|\"|'|,|/[*]|[*]/|\n| |END|GROUP|END_GROUP){0,120}") {
        let _ = Group::parse(text.as_bytes());
    }

    #[test]
    fn a_truncated_label_is_refused_or_complete(cut in 0..LABEL.len()) {
        if let Ok(label) = Group::parse(&LABEL.as_bytes()[..cut]) {
            prop_assert_eq!(label, Group::parse(LABEL.as_bytes()).unwrap());
        }
    }
}
