//! `sightline study checkouts` and `sightline study k9-day`: the papers' drives as commanded drives, with the published
//! values.

use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_study::checkouts::{self, Checkout, Images};
use sightline_study::k9_day::{self, DAYS, K9Visit};

use super::terminal::{self, Progress};

/// The four checkouts.
#[derive(Debug, Args)]
pub(super) struct CheckoutsStudy {
    /// Numbers of the checkouts.
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2,3,4",
        value_parser = clap::value_parser!(u32).range(1..=4))]
    checkouts: Vec<u32>,
    /// The configuration of the tracker; checkout 4 uses `combined`, for the hand-off.
    #[arg(long, value_name = "NAME", default_value = "ncc-scale-roll")]
    preset: String,
    /// The world's seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    images: ImageOptions,
    /// Format of the output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// The days of K9.
#[derive(Debug, Args)]
pub(super) struct K9DayStudy {
    /// Number of worlds.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    worlds: u64,
    /// The seed of the first world; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    #[command(flatten)]
    images: ImageOptions,
    /// Format of the output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// The images of the drives.
#[derive(Clone, Copy, Debug, Args)]
struct ImageOptions {
    /// Side of the images, px.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(128..=1024))]
    size: u32,
    /// Samples along each side of a pixel.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    samples_per_axis: u32,
}

impl ImageOptions {
    const fn of(self, seed: u64) -> Images {
        Images { seed, size: self.size, samples_per_axis: self.samples_per_axis }
    }
}

/// Format of the output.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// One line of text per step or visit.
    Text,
    /// One JSON object per drive or visit.
    Jsonl,
}

impl CheckoutsStudy {
    /// Drives the checkouts and writes each when it ends.
    ///
    /// # Errors
    /// An unknown preset, a world in which no drive is possible, or no space for images.
    pub(super) fn run(&self) -> Result<()> {
        let folder = temporary()?;
        let mut progress = Progress::new("checkout");
        for (done, number) in self.checkouts.iter().enumerate() {
            let folder = folder.path().join(number.to_string());
            let images = self.images.of(self.seed);
            let checkout = checkouts::drive(*number, images, &self.preset, &folder, Cancel::default())?;
            progress.tell(done + 1, self.checkouts.len());
            match self.format {
                Format::Jsonl => json(&checkout)?,
                Format::Text => text(&checkout).iter().try_for_each(|line| terminal::line(line))?,
            }
        }
        Ok(())
    }
}

impl K9DayStudy {
    /// Drives both days in every world and writes each visit when it ends.
    ///
    /// # Errors
    /// A world in which no drive is possible, or no space for images.
    pub(super) fn run(&self) -> Result<()> {
        let folder = temporary()?;
        let mut progress = Progress::new("day");
        let seeds = self.first_seed..self.first_seed.saturating_add(self.worlds);
        let all: Vec<(&'static str, u64)> = seeds.flat_map(|seed| DAYS.map(|day| (day, seed))).collect();
        for (done, (day, seed)) in all.iter().enumerate() {
            let folder = folder.path().join(format!("{day}-{seed}"));
            match k9_day::drive(day, self.images.of(*seed), &folder, Cancel::default()) {
                Ok(visits) => visits.iter().try_for_each(|visit| self.write(visit))?,
                Err(problem @ Error::Target(_)) => terminal::error(&format!("{day} seed {seed}: {problem}")),
                Err(error) => return Err(error),
            }
            // The images of many drives would fill a disk.
            let _ = std::fs::remove_dir_all(&folder);
            progress.tell(done + 1, all.len());
        }
        Ok(())
    }

    fn write(&self, visit: &K9Visit) -> Result<()> {
        if self.format == Format::Jsonl {
            return json(visit);
        }
        let cm =
            |metres: Option<f64>| metres.map_or_else(|| "–".to_owned(), |m| format!("{:.2} cm", 100.0 * m));
        let why = visit.failure.as_ref().map_or_else(String::new, |failure| format!(" ({failure})"));
        terminal::line(&format!(
            "{} seed {} target {}: {}, {} stops, {} of them bad; designation {}, tracker {}, first view {}, hand-off {}{why}, after it {}, touch {} beside; {:.0} min",
            visit.day,
            visit.seed,
            visit.target,
            visit.reason,
            visit.stops,
            visit.bad_stops,
            cm(visit.designation_m),
            cm(visit.tracker_m),
            cm(visit.first_view_m),
            cm(visit.hand_off_m),
            cm(visit.handed_m),
            cm(visit.touch_m),
            visit.minutes
        ))
    }
}

fn temporary() -> Result<tempfile::TempDir> {
    tempfile::tempdir().map_err(|source| Error::Write { path: std::env::temp_dir(), source })
}

fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|error| Error::Request(error.to_string()))?;
    terminal::line(&text)
}

/// The lines of a checkout; the paper's values are in brackets.
fn text(checkout: &Checkout) -> Vec<String> {
    let mut lines = vec![format!("checkout {}", checkout.number)];
    for step in &checkout.steps {
        let record = &step.record;
        let value = |ours: Option<f64>, row: usize, decimals: usize| {
            let ours = ours.map_or_else(|| "–".to_owned(), |ours| format!("{ours:.decimals$}"));
            step.paper.map_or(ours.clone(), |paper| format!("{ours} ({:.2})", paper[row]))
        };
        lines.push(format!(
            "{:>3} {:<17} {:<9} {} m, magnification {}, roll {}°, azimuth {}°, score {}, correction {} px, error {} cm",
            record.position,
            step.phase,
            record.state,
            value(record.distance_m, 0, 2).split(' ').next().unwrap_or_default(),
            value(record.magnification, 0, 3),
            value(record.roll_deg.map(f64::abs), 1, 2),
            value(record.azimuth_change_deg.map(f64::abs), 2, 2),
            value(record.ncc, 3, 2),
            record.correction_px.map_or_else(|| "–".to_owned(), |px| format!("{px:.1}")),
            record.err_m.map_or_else(|| "–".to_owned(), |m| format!("{:.2}", 100.0 * m)),
        ));
    }
    for phase in &checkout.phases {
        let [target, odometry, navigator] = phase.updates;
        let paper = phase.paper.map_or_else(String::new, |([target, odometry, navigator], minutes)| {
            format!(" (paper: {target}, {odometry}, {navigator}; {minutes:.0} min)")
        });
        lines.push(format!(
            "    {}: {target} updates of the target, {odometry} of odometry, {navigator} of the navigator, {:.1} min{paper}",
            phase.phase, phase.minutes
        ));
    }
    let summary = &checkout.summary;
    lines.push(format!(
        "    {}; target error {}, total correction {:.1} cm, {:.1} min on Mars",
        summary.reason.map_or("under way", |reason| reason.word()),
        summary.target_error_m.map_or_else(|| "unknown".to_owned(), |m| format!("{:.2} cm", 100.0 * m)),
        100.0 * checkout.total_correction_m,
        summary.flight_minutes
    ));
    lines.extend(checkout.turn_centre.map(|turn| {
        let [x, y] = turn.centre_m;
        let [[seventh, az7], [eighth, az8]] = turn.rows;
        format!(
            "    turn about ({x:.2}, {y:.2}) m: row 7 {seventh:.3}, {:.2}°, row 8 {eighth:.3}, {:.2}°; residual {:.2} (of 4 % and 1°)",
            az7.abs(), az8.abs(), turn.residual
        )
    }));
    lines.extend(checkout.placement.map(|placement| {
        let touch =
            placement.offset_m.map_or_else(|| "nowhere".to_owned(), |m| format!("{:.1} mm beside", 1e3 * m));
        format!(
            "    arm: {:.2} m from its shoulder, reachable {}, touched {touch}",
            placement.reach_m, placement.is_reachable
        )
    }));
    lines
}
