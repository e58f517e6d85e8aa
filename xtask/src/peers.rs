//! `cargo xtask bench --peers`: our correlation, features, matches and dense stereo and OpenCV's, on the same pixels, in turn, in one run.
//!
//! Both sides are programs that stay open and answer one line with another (`core/benches/peer.rs`,
//! `xtask/peers/opencv.py`): a few repetitions of one work, of which the quickest counts. They are asked in turn, ours,
//! theirs, ours, theirs, so that whatever else the machine does meets both; of the rounds the median is reported. Each
//! side has one thread. What both find must agree before any time is shown: scores to 1e-4, the number of keypoints to
//! 5 %, the nearest descriptors exactly, disparities to half a pixel.
//!
//! OpenCV comes from PyPI into a virtual environment in the target folder, once.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::cmd;

/// What is installed, exactly.
const PACKAGES: [&str; 2] = ["numpy==2.4.6", "opencv-python-headless==5.0.0.93"];

/// The names under which the other side is reported.
const CORRELATION: &str = "opencv matchTemplate(TM_CCOEFF_NORMED)";
const FEATURES: &str = "opencv SIFT.detectAndCompute";
const MATCHES: &str = "opencv BFMatcher(NORM_L2).knnMatch(k=2)";
const STEREO: [(&str, &str); 2] = [("block", "opencv StereoBM(15)"), ("semi-global", "opencv StereoSGBM(5)")];

/// How far two scores of one position may lie apart: OpenCV sums in single precision.
const SCORES_APART: f64 = 1e-4;

/// How far the numbers of keypoints may lie apart, as a share of them.
const KEYPOINTS_APART: f64 = 0.05;

/// How far distances of descriptors, the roots of whole numbers written with four digits, may lie apart.
const DISTANCES_APART: f64 = 2e-4;

/// How far disparities may lie apart, px.
const DISPARITIES_APART: f64 = 0.5;

/// How often each side is asked for one work.
const ROUNDS: usize = 15;

/// Sides of the images: two that are searched, and a scene whose features are looked for.
const IMAGES: [u32; 2] = [161, 621];
const SCENE: u32 = 1024;

/// A template of a side over an image of `IMAGES`, so often in a row.
const TEMPLATES: [(u32, usize, u32); 4] = [(11, 0, 20), (21, 0, 20), (31, 0, 20), (21, 1, 3)];

/// Disparities that are searched in the scene and what a second eye sees of it.
const DISPARITIES: u32 = 128;

/// Descriptors that are compared with as many others.
const QUERIES: u32 = 2000;

/// One work, as both sides are asked for it.
struct Work {
    name: String,
    request: String,
    peer: &'static str,
    /// How far the numbers of both sides may lie apart: by themselves, and as a share of them.
    apart: [f64; 2],
}

/// The comparison of one work.
struct Compared {
    work: String,
    peer: &'static str,
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
            "{:<40} {:>10} {:>10} {:>7}   one thread each",
            "work", "ours ms", "peer ms", "ratio"
        ));
    }
    let descriptors = folder.join("descriptors.u8");
    peer.ask(&format!("describe {} {} {}", IMAGES.len(), 2 * QUERIES, descriptors.display()))?;
    for work in works(&descriptors.display().to_string()) {
        let compared = compare(work, &mut ours, &mut peer)?;
        cmd::say(if json { compared.json() } else { compared.row() });
    }
    Ok(())
}

/// All works; `descriptors` is the file of those that are compared.
fn works(descriptors: &str) -> Vec<Work> {
    let correlation = |(size, image, repetitions): (u32, usize, u32)| {
        let side = IMAGES[image];
        Work {
            name: format!("zncc {size}x{size} over {side}x{side}"),
            request: format!("zncc {image} {size} {} {} {repetitions}", side / 3, side / 4),
            peer: CORRELATION,
            apart: [SCORES_APART, 0.0],
        }
    };
    let features = Work {
        name: format!("sift {SCENE}x{SCENE}"),
        request: format!("sift {} 1", IMAGES.len()),
        peer: FEATURES,
        apart: [0.0, KEYPOINTS_APART],
    };
    let matches = Work {
        name: format!("match {QUERIES}x{QUERIES} of sift"),
        request: format!("match {descriptors} {QUERIES} 3"),
        peer: MATCHES,
        apart: [DISTANCES_APART, 0.0],
    };
    let stereo = STEREO.map(|(method, peer)| Work {
        name: format!("dense stereo {method} {SCENE}x{SCENE}x{DISPARITIES}"),
        request: format!("stereo {method} {} {DISPARITIES} 1", IMAGES.len()),
        peer,
        apart: [DISPARITIES_APART, 0.0],
    });
    TEMPLATES.into_iter().map(correlation).chain([features, matches]).chain(stereo).collect()
}

impl Compared {
    fn ratio(&self) -> f64 {
        self.peer_ms / self.ours_ms
    }

    fn row(&self) -> String {
        let Self { work, peer, ours_ms, peer_ms } = self;
        format!("{work:<40} {ours_ms:>10.3} {peer_ms:>10.3} {:>7.2}   {peer}", self.ratio())
    }

    fn json(&self) -> String {
        let Self { work, peer, ours_ms, peer_ms } = self;
        format!(
            "{{\"work\": \"{work}\", \"ours_ms\": {ours_ms:.4}, \"peer\": \"{peer}\", \"peer_ms\": {peer_ms:.4}, \"ratio\": {:.3}}}",
            self.ratio()
        )
    }
}

/// Asks both sides in turn.
fn compare(work: Work, ours: &mut Side, peer: &mut Side) -> Result<Compared> {
    let Work { name, request, peer: peer_name, apart: [absolute, share] } = work;
    let (mut our_times, mut peer_times) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let (our_time, our_numbers) = ours.ask(&request)?;
        let (peer_time, peer_numbers) = peer.ask(&request)?;
        let mut pairs = our_numbers.iter().zip(&peer_numbers);
        let apart = pairs.find(|(a, b)| (*a - *b).abs() > absolute + share * b.abs());
        if let Some((a, b)) = apart {
            bail!("{name}: the two sides do not agree: {a} and {b}; mend this first");
        }
        if our_numbers.len() != peer_numbers.len() || our_numbers.is_empty() {
            bail!("{name}: the two sides do not find as much; mend this first");
        }
        our_times.push(our_time);
        peer_times.push(peer_time);
    }
    let (ours_ms, peer_ms) = (1e3 * median(our_times), 1e3 * median(peer_times));
    Ok(Compared { work: name, peer: peer_name, ours_ms, peer_ms })
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

    /// Seconds, and what was found.
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

/// A number from 0 to 1 for each pixel, without repetition.
fn hash(x: u32, y: u32) -> f64 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
}

/// The squares that both sides read, always the same: hashed values smoothed by a 3 × 3 mean, the scene, and what
/// a second eye sees of it: 16 to 101 px of disparity, more from the top down.
fn images() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut add = |side: u32, value: &dyn Fn(u32, u32) -> f64| {
        bytes.extend(side.to_le_bytes());
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            bytes.extend((value(x, y) as f32).to_le_bytes());
        }
    };
    for side in IMAGES {
        add(side, &|x, y| (0..9).map(|i| hash(x + i % 3, y + i / 3)).sum::<f64>() / 9.0);
    }
    add(SCENE, &scene);
    add(SCENE, &|x, y| scene(x + 16 + y / 12, y));
    bytes
}

/// Hashed values between which is interpolated, every 4, 8 … 64 pixels, with some 6000 features; whole numbers of 255,
/// because OpenCV looks for them in 8 bits.
fn scene(x: u32, y: u32) -> f64 {
    let noise = |spacing: u32| {
        let (u, v) = (f64::from(x % spacing), f64::from(y % spacing));
        let (u, v) = (u / f64::from(spacing), v / f64::from(spacing));
        let at = |i: u32, j: u32| hash((x / spacing + i) * 97 + spacing, y / spacing + j) - 0.5;
        let along = |j: u32| at(0, j) * (1.0 - u) + at(1, j) * u;
        along(0) * (1.0 - v) + along(1) * v
    };
    let value = 0.5 + (2..7).map(|octave| 0.45 * noise(1 << octave)).sum::<f64>();
    (value.clamp(0.0, 1.0) * 255.0).round() / 255.0
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
        let compared = Compared {
            work: "zncc 21x21 over 161x161".to_owned(),
            peer: CORRELATION,
            ours_ms: 0.125,
            peer_ms: 0.5,
        };
        assert!(compared.row().contains(" 4.00   opencv"), "{}", compared.row());
        let expected = "{\"work\": \"zncc 21x21 over 161x161\", \"ours_ms\": 0.1250, \"peer\": ";
        assert!(compared.json().starts_with(expected) && compared.json().ends_with("\"ratio\": 4.000}"));
    }
}
