//! Replays the inputs under `corpus/`, unchanged and with seeded changes.

use std::path::{Path, PathBuf};

use super::{TARGETS, Target};

/// Number of inputs that are replayed for each parser.
const INPUTS: usize = 1500;
/// Parsers that need a whole server.
const SERVED: [&str; 4] = ["requests", "http", "websocket", "store"];
/// Number of inputs that are replayed for each of [`SERVED`].
const SERVED_INPUTS: usize = 400;

/// A small seeded generator (xorshift64*).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize % end.max(1)
    }
}

/// The inputs of a parser, by name.
fn corpus(target: &Target) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).expect("an input")).collect()
}

/// One to four changes: a byte replaced, or a piece removed, repeated, or copied from another input.
fn changed(input: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    const TOKENS: [&[u8]; 10] =
        [b"-1", b"0", b"1e308", b"nan", b"99999999999999999999", b"\"", b"{", b"]", b"\xff\xfe", b"\0"];
    let mut bytes = input.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() + 1);
        let end = (at + 1 + random.below(16)).min(bytes.len());
        match random.below(5) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 if at < end => drop(bytes.drain(at..end)),
            2 if at < end => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            3 => {
                let from = random.below(other.len() + 1);
                let piece = other[from..(from + 32).min(other.len())].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => drop(bytes.splice(at..end.max(at), TOKENS[random.below(TOKENS.len())].iter().copied())),
        }
    }
    bytes
}

fn replay(target: &Target, count: usize) {
    let name = target.name;
    let inputs = corpus(target);
    assert!(!inputs.is_empty(), "{name} has no inputs");
    for input in &inputs {
        (target.parse)(input);
    }
    (target.parse)(b"");
    let mut random = Random(0x5EED_0000 + name.len() as u64);
    for _ in inputs.len()..count {
        let [input, other] = [(); 2].map(|()| &inputs[random.below(inputs.len())]);
        let input = changed(input, other, &mut random);
        let outcome = std::panic::catch_unwind(|| (target.parse)(&input));
        assert!(outcome.is_ok(), "{name} failed at {:?}", String::from_utf8_lossy(&input));
    }
}

#[test]
fn each_parser_has_a_folder_of_inputs_of_its_name() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let entries = std::fs::read_dir(folder).expect("the inputs");
    let mut folders: Vec<_> = entries.map(|entry| entry.expect("an entry").file_name()).collect();
    let mut names: Vec<_> = TARGETS.iter().map(|target| std::ffi::OsString::from(target.name)).collect();
    folders.sort();
    names.sort();
    assert_eq!(folders, names);
}

#[test]
fn parsers_return_for_every_input() {
    for target in TARGETS.iter().filter(|target| !SERVED.contains(&target.name)) {
        replay(target, INPUTS);
    }
}

#[test]
fn server_answers_every_request_without_an_internal_error() {
    for name in SERVED {
        replay(super::target(name).expect("a parser"), SERVED_INPUTS);
    }
}
