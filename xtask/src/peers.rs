//! `cargo xtask bench --peers`: compares our correlation, features, matching and dense stereo with OpenCV, on the same
//! pixels, in turn, in one run.
//!
//! Both sides are programs that stay open and answer one line with another (`core/benches/peer.rs`,
//! `xtask/peers/opencv.py`): they repeat one task a few times and report the shortest time. They are called alternately, so
//! that other load on the machine affects both; the result is the median over the rounds. Each side uses one thread. The
//! results of both must agree before any time is shown: scores to 1e-4, the number of keypoints to 5 %, the nearest
//! descriptors exactly, disparities to half a pixel.
//!
//! OpenCV is installed from PyPI into a virtual environment in the target folder, once.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::cmd;

/// The exact versions to install.
const PACKAGES: [&str; 2] = ["numpy==2.4.6", "opencv-python-headless==5.0.0.93"];

/// The names of the OpenCV functions in the table.
const CORRELATION: &str = "opencv matchTemplate(TM_CCOEFF_NORMED)";
const FEATURES: &str = "opencv SIFT.detectAndCompute";
const MATCHES: &str = "opencv BFMatcher(NORM_L2).knnMatch(k=2)";
const STEREO: [(&str, &str); 2] = [("block", "opencv StereoBM(15)"), ("semi-global", "opencv StereoSGBM(5)")];

/// Tolerance of scores at one position: OpenCV sums in single precision.
const SCORE_TOLERANCE: f64 = 1e-4;

/// Relative tolerance of the number of keypoints.
const KEYPOINT_TOLERANCE: f64 = 0.05;

/// Tolerance of descriptor distances, the square roots of integers written with four digits.
const DISTANCE_TOLERANCE: f64 = 2e-4;

/// Tolerance of disparities, px.
const DISPARITY_TOLERANCE: f64 = 0.5;

/// Number of calls of each side per task.
const ROUNDS: usize = 15;

/// Sides of the images, px: two for template matching, and a scene for features and stereo.
const IMAGES: [u32; 2] = [161, 621];
const SCENE: u32 = 1024;

/// Side of the template, index into `IMAGES`, and number of repetitions.
const TEMPLATES: [(u32, usize, u32); 4] = [(11, 0, 20), (21, 0, 20), (31, 0, 20), (21, 1, 3)];

/// Number of disparities searched between the scene and its second view.
const DISPARITIES: u32 = 128;

/// Number of descriptors that are matched with as many others.
const QUERIES: u32 = 2000;

/// One task, as requested from both sides.
struct Workload {
    name: String,
    request: String,
    peer: &'static str,
    /// Absolute and relative tolerance of the numbers of both sides.
    tolerance: [f64; 2],
}

/// The comparison of one task.
struct Comparison {
    work: String,
    peer: &'static str,
    ours_ms: f64,
    peer_ms: f64,
}

/// Runs every task on both sides and prints a table, or with `json` one object per line.
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
        cmd::print_line(format!(
            "{:<40} {:>10} {:>10} {:>7}   one thread each",
            "work", "ours ms", "peer ms", "ratio"
        ));
    }
    let descriptors = folder.join("descriptors.u8");
    peer.request(&format!("describe {} {} {}", IMAGES.len(), 2 * QUERIES, descriptors.display()))?;
    for work in workloads(&descriptors.display().to_string()) {
        let compared = compare(work, &mut ours, &mut peer)?;
        cmd::print_line(if json { compared.json() } else { compared.row() });
    }
    Ok(())
}

/// All tasks; `descriptors` is the file with the descriptors to match.
fn workloads(descriptors: &str) -> Vec<Workload> {
    let correlation = |(size, image, repetitions): (u32, usize, u32)| {
        let side = IMAGES[image];
        Workload {
            name: format!("zncc {size}x{size} over {side}x{side}"),
            request: format!("zncc {image} {size} {} {} {repetitions}", side / 3, side / 4),
            peer: CORRELATION,
            tolerance: [SCORE_TOLERANCE, 0.0],
        }
    };
    let features = Workload {
        name: format!("sift {SCENE}x{SCENE}"),
        request: format!("sift {} 1", IMAGES.len()),
        peer: FEATURES,
        tolerance: [0.0, KEYPOINT_TOLERANCE],
    };
    let matches = Workload {
        name: format!("match {QUERIES}x{QUERIES} of sift"),
        request: format!("match {descriptors} {QUERIES} 3"),
        peer: MATCHES,
        tolerance: [DISTANCE_TOLERANCE, 0.0],
    };
    let stereo = STEREO.map(|(method, peer)| Workload {
        name: format!("dense stereo {method} {SCENE}x{SCENE}x{DISPARITIES}"),
        request: format!("stereo {method} {} {DISPARITIES} 1", IMAGES.len()),
        peer,
        tolerance: [DISPARITY_TOLERANCE, 0.0],
    });
    TEMPLATES.into_iter().map(correlation).chain([features, matches]).chain(stereo).collect()
}

impl Comparison {
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

/// Calls both sides alternately.
fn compare(work: Workload, ours: &mut Side, peer: &mut Side) -> Result<Comparison> {
    let Workload { name, request, peer: peer_name, tolerance: [absolute, share] } = work;
    let (mut our_times, mut peer_times) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let (our_time, our_numbers) = ours.request(&request)?;
        let (peer_time, peer_numbers) = peer.request(&request)?;
        let mut pairs = our_numbers.iter().zip(&peer_numbers);
        let mismatch = pairs.find(|(a, b)| (*a - *b).abs() > absolute + share * b.abs());
        if let Some((a, b)) = mismatch {
            bail!("{name}: the two sides do not agree: {a} and {b}; mend this first");
        }
        if our_numbers.len() != peer_numbers.len() || our_numbers.is_empty() {
            bail!("{name}: the two sides do not find as much; mend this first");
        }
        our_times.push(our_time);
        peer_times.push(peer_time);
    }
    let (ours_ms, peer_ms) = (1e3 * median(our_times), 1e3 * median(peer_times));
    Ok(Comparison { work: name, peer: peer_name, ours_ms, peer_ms })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// One side: a program that answers requests line by line.
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

    /// Time in seconds, and the numbers of the answer.
    fn request(&mut self, request: &str) -> Result<(f64, Vec<f64>)> {
        let mut line = String::new();
        let sent = writeln!(self.requests, "{request}").and_then(|()| self.requests.flush());
        sent.and_then(|()| self.answers.read_line(&mut line))
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
        // It may already have ended; it must be reaped in either case.
        self.child.kill().unwrap_or_default();
        drop(self.child.wait());
    }
}

/// The Python of a virtual environment with the packages.
fn environment(folder: &Path) -> Result<PathBuf> {
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let stamp = folder.join("installed");
    if std::fs::read_to_string(&stamp).is_ok_and(|text| text == PACKAGES.join(" ")) {
        return Ok(python);
    }
    let system = cmd::find_in_path(&["python3", "python"])
        .context("there is no python3; install it (Debian: python3-venv) and run this again")?;
    cmd::print_line("Installing OpenCV from PyPI into the target folder, once.");
    let mend = "install Python's venv (Debian: apt-get install python3-venv) and run this again";
    cmd::output(cmd::program(system).args(["-m", "venv", "--clear"]).arg(folder), mend)?;
    let mut install = cmd::program(&python);
    install.args(["-m", "pip", "install", "--quiet"]).args(PACKAGES);
    cmd::output(&mut install, "PyPI must be reachable: try again later")?;
    std::fs::write(&stamp, PACKAGES.join(" ")).context("the target folder cannot be written")?;
    Ok(python)
}

/// Builds our side in the development profile, and returns its path.
fn our_program() -> Result<PathBuf> {
    let arguments =
        ["bench", "--workspace", "--exclude", "xtask", "--bench", "peer", "--profile", "dev", "--no-run"];
    std::fs::create_dir_all(crate::web::output_dir())?;
    let mut cargo = cmd::cargo(&arguments);
    cargo.args(["--message-format", "json"]).stderr(Stdio::inherit());
    let messages = cmd::output(&mut cargo, "mend the error reported above")?;
    executable(&messages).context("cargo built no bench `peer`; look at core/Cargo.toml")
}

/// The path in Cargo's message about the benchmark `peer`.
fn executable(messages: &str) -> Option<PathBuf> {
    let message = messages
        .lines()
        .rfind(|line| line.contains("\"name\":\"peer\"") && line.contains("\"executable\":\""))?;
    let (path, _) = message.split_once("\"executable\":\"")?.1.split_once('"')?;
    Some(PathBuf::from(path.replace("\\\\", "\\")))
}

/// A pseudo-random number from 0 to 1 for each pixel.
fn hash(x: u32, y: u32) -> f64 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from(h ^ (h >> 13)) / f64::from(u32::MAX)
}

/// The images for both sides, always the same: hashed values smoothed by a 3 × 3 mean, the scene, and its second view with
/// 16 to 101 px of disparity, increasing from top to bottom.
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

/// Interpolated hashed values at spacings of 4, 8 … 64 pixels, with some 6000 features; multiples of 1/255, because OpenCV
/// detects features in 8 bits.
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
        let compared = Comparison {
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
