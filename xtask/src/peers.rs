//! `cargo xtask bench --peers`: our correlation and OpenCV's on the same pixels, in turn, in one run.
//!
//! Both sides are programs that stay open and answer one line with another (`core/benches/peer.rs`,
//! `xtask/peers/opencv.py`): a few repetitions of one work, of which the quickest counts. They are asked in turn, ours,
//! theirs, ours, theirs, so that whatever else the machine does meets both; of the rounds the median is reported. Each
//! side has one thread. The scores of both must agree before any time is shown.
//!
//! OpenCV comes from PyPI into a virtual environment in the target folder, once.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::cmd;

/// What is installed, exactly.
const PACKAGES: [&str; 2] = ["numpy==2.4.6", "opencv-python-headless==5.0.0.93"];

/// The name under which the other side is reported.
const PEER: &str = "opencv matchTemplate(TM_CCOEFF_NORMED)";

/// How far two scores of one position may lie apart: OpenCV sums in single precision.
const TOLERANCE: f64 = 1e-4;

/// How often each side is asked for one work.
const ROUNDS: usize = 15;

/// Sides of the images searched, px.
const IMAGES: [u32; 2] = [161, 621];

/// One work: a template of a side over an image of `IMAGES`, so often in a row.
const WORKS: [(u32, usize, u32); 4] = [(11, 0, 20), (21, 0, 20), (31, 0, 20), (21, 1, 3)];

/// The comparison of one work.
struct Compared {
    work: String,
    ours_ms: f64,
    peer_ms: f64,
}

/// Runs every work on both sides and prints a table, or with `json` one object a line.
pub(crate) fn peers(json: bool) -> Result<()> {
    let folder = cmd::target_dir().join("peers");
    std::fs::create_dir_all(&folder).context("the target folder cannot be written")?;
    let python = environment(&folder.join("venv"))?;
    let pixels = folder.join("pixels.f32");
    std::fs::write(&pixels, images()).context("the file of pixels cannot be written")?;
    let mut ours = Side::start(Command::new(our_program()?).arg(&pixels), "ours")?;
    let script = cmd::root().join("xtask/peers/opencv.py");
    let mut peer = Side::start(Command::new(python).arg(script).arg(&pixels), "opencv.py")?;
    if !json {
        cmd::say(format!(
            "{:<24} {:>10} {:>10} {:>7}   {PEER}, one thread each",
            "work", "ours ms", "peer ms", "ratio"
        ));
    }
    for (size, image, repetitions) in WORKS {
        let side = IMAGES[image];
        let work = format!("zncc {size}x{size} over {side}x{side}");
        let request = format!("zncc {image} {size} {} {} {repetitions}", side / 3, side / 4);
        let compared = compare(work, &request, &mut ours, &mut peer)?;
        cmd::say(if json { compared.json() } else { compared.row() });
    }
    Ok(())
}

impl Compared {
    fn ratio(&self) -> f64 {
        self.peer_ms / self.ours_ms
    }

    fn row(&self) -> String {
        let Self { work, ours_ms, peer_ms } = self;
        format!("{work:<24} {ours_ms:>10.3} {peer_ms:>10.3} {:>7.2}", self.ratio())
    }

    fn json(&self) -> String {
        let Self { work, ours_ms, peer_ms } = self;
        format!(
            "{{\"work\": \"{work}\", \"ours_ms\": {ours_ms:.4}, \"peer\": \"{PEER}\", \"peer_ms\": {peer_ms:.4}, \"ratio\": {:.3}}}",
            self.ratio()
        )
    }
}

/// Asks both sides in turn.
fn compare(work: String, request: &str, ours: &mut Side, peer: &mut Side) -> Result<Compared> {
    let (mut our_times, mut peer_times) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let (our_time, our_scores) = ours.ask(request)?;
        let (peer_time, peer_scores) = peer.ask(request)?;
        let difference = our_scores.iter().zip(&peer_scores).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if our_scores.len() != peer_scores.len() || difference > TOLERANCE {
            bail!(
                "{work}: the two sides do not agree: scores differ by up to {difference:.1e}; mend this first"
            );
        }
        our_times.push(our_time);
        peer_times.push(peer_time);
    }
    Ok(Compared { work, ours_ms: 1e3 * median(our_times), peer_ms: 1e3 * median(peer_times) })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// One side: a program that answers lines.
struct Side {
    name: &'static str,
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Side {
    fn start(command: &mut Command, name: &'static str) -> Result<Self> {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("{name} cannot be started; run the command again"))?;
        let requests = child.stdin.take().context("its input is not open")?;
        let answers = BufReader::new(child.stdout.take().context("its output is not open")?);
        Ok(Self { name, child, requests, answers })
    }

    /// Seconds, and the scores of some positions.
    fn ask(&mut self, request: &str) -> Result<(f64, Vec<f64>)> {
        let mut line = String::new();
        let asked = writeln!(self.requests, "{request}").and_then(|()| self.requests.flush());
        asked
            .and_then(|()| self.answers.read_line(&mut line))
            .with_context(|| format!("{} has ended early; its message stands above", self.name))?;
        let mut numbers = line.split_whitespace().map_while(|word| word.parse::<f64>().ok());
        let seconds = numbers
            .next()
            .with_context(|| format!("{} has ended early; its message stands above", self.name))?;
        Ok((seconds, numbers.collect()))
    }
}

impl Drop for Side {
    fn drop(&mut self) {
        // It may have ended by itself; it must be gone afterwards.
        self.child.kill().unwrap_or_default();
        drop(self.child.wait());
    }
}

/// The Python of a virtual environment that holds the packages.
fn environment(folder: &Path) -> Result<PathBuf> {
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = folder.join("installed");
    if std::fs::read_to_string(&stamp).is_ok_and(|text| text == PACKAGES.join(" ")) {
        return Ok(python);
    }
    let system = cmd::find_in_path(&["python3", "python"])
        .context("there is no python3; install it (Debian: python3-venv) and run this again")?;
    cmd::say("Installing OpenCV from PyPI into the target folder, once.");
    let mend = "install Python's venv (Debian: apt-get install python3-venv) and run this again";
    cmd::output(cmd::program(system).args(["-m", "venv", "--clear"]).arg(folder), mend)?;
    let mut install = cmd::program(&python);
    install.args(["-m", "pip", "install", "--quiet"]).args(PACKAGES);
    cmd::output(&mut install, "PyPI must be reachable: try again later")?;
    std::fs::write(&stamp, PACKAGES.join(" ")).context("the target folder cannot be written")?;
    Ok(python)
}

/// Builds our side in the profile that everything else is built in, and says where it is.
fn our_program() -> Result<PathBuf> {
    let arguments =
        ["bench", "--workspace", "--exclude", "xtask", "--bench", "peer", "--profile", "dev", "--no-run"];
    std::fs::create_dir_all(crate::web::output_dir())?;
    let mut cargo = cmd::cargo(&arguments);
    cargo.args(["--message-format", "json"]).stderr(Stdio::inherit());
    let messages = cmd::output(&mut cargo, "mend the error reported above")?;
    executable(&messages).context("cargo built no bench `peer`; look at core/Cargo.toml")
}

/// The path in Cargo's message on the bench `peer`.
fn executable(messages: &str) -> Option<PathBuf> {
    let message = messages
        .lines()
        .rfind(|line| line.contains("\"name\":\"peer\"") && line.contains("\"executable\":\""))?;
    let (path, _) = message.split_once("\"executable\":\"")?.1.split_once('"')?;
    Some(PathBuf::from(path.replace("\\\\", "\\")))
}

/// Textured squares without repetition, always the same: hashed values, smoothed by a 3 × 3 mean.
fn images() -> Vec<u8> {
    let hash = |x: u32, y: u32| {
        let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
    };
    let mut bytes = Vec::new();
    for side in IMAGES {
        bytes.extend(side.to_le_bytes());
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let around = (0..9).map(|i| hash(x + i % 3, y + i / 3));
            bytes.extend(((around.sum::<f64>() / 9.0) as f32).to_le_bytes());
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bench_is_found_among_cargos_messages() {
        let messages = "{\"target\":{\"name\":\"zncc\"},\"executable\":\"/t/zncc-1\"}\n\
                        {\"target\":{\"kind\":[\"bench\"],\"name\":\"peer\"},\"executable\":\"/t/peer-2\"}\n\
                        {\"reason\":\"build-finished\",\"success\":true}";
        assert_eq!(executable(messages), Some(PathBuf::from("/t/peer-2")));
        assert_eq!(executable("{}"), None);
    }

    #[test]
    fn a_comparison_reads_as_a_row_and_as_an_object() {
        let compared = Compared { work: "zncc 21x21 over 161x161".to_owned(), ours_ms: 0.125, peer_ms: 0.5 };
        assert!(compared.row().ends_with("4.00"), "{}", compared.row());
        let expected = "{\"work\": \"zncc 21x21 over 161x161\", \"ours_ms\": 0.1250, \"peer\": ";
        assert!(compared.json().starts_with(expected) && compared.json().ends_with("\"ratio\": 4.000}"));
    }
}
