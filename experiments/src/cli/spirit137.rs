//! `sightline-experiments spirit-137`: visual odometry along the path that Spirit drove at site 137.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_server::cli::terminal::{self, Progress};

use crate::spirit137::path::Path;
use crate::spirit137::report::{SpiritBin, SpiritReport};
use crate::spirit137::{Replay, rvf};

/// The recorded poses and the world.
#[derive(Debug, Args)]
pub(super) struct Spirit137 {
    /// The folder of the data sets, which holds mer2-rover-motion; without it that of SIGHTLINE_DATA, or ../shared/data.
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// The seed of the world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of the images, px.
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// Samples along each side of a pixel.
    #[arg(long, default_value_t = 2)]
    samples_per_axis: u32,
    /// What is written to the standard output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// What is written to the standard output.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// Figures, refusals, and a line for each size of the true motion.
    Text,
    /// One JSON object with every update.
    Json,
}

impl Spirit137 {
    /// Replays the path and writes the outcome.
    ///
    /// # Errors
    /// Poses that are missing or damaged, or no room for images.
    pub(super) fn run(&self) -> Result<()> {
        let path = Path::new(&rvf::read(&self.data())?)?;
        let replay = Replay {
            path: &path,
            seed: self.seed,
            image_size: self.size,
            samples_per_axis: self.samples_per_axis,
        };
        let folder =
            std::env::temp_dir().join(format!("sightline-spirit-{}-{}", self.seed, std::process::id()));
        let mut progress = Progress::new("update");
        let all = path.poses.len() - 1;
        let report = replay.run(&folder, Cancel::default(), &mut |done| progress.tell(done, all))?;
        if self.format == Format::Json {
            let text = serde_json::to_string(&report).map_err(|error| Error::Request(error.to_string()))?;
            return terminal::line(&text);
        }
        words(&report).iter().try_for_each(|line| terminal::line(line))
    }

    fn data(&self) -> PathBuf {
        let named = || std::env::var_os("SIGHTLINE_DATA").map(PathBuf::from);
        self.data.clone().or_else(named).unwrap_or_else(|| PathBuf::from("../shared/data"))
    }
}

/// A report in lines.
fn words(report: &SpiritReport) -> Vec<String> {
    let mm =
        |length_m: Option<f64>| length_m.map_or_else(|| "-".to_owned(), |m| format!("{:.2} mm", 1e3 * m));
    let nees = report
        .nees_per_dof
        .map_or_else(|| "-".to_owned(), |[mean, median]| format!("{mean:.2}, {median:.2}"));
    let worst = report.worst_drive.map_or_else(String::new, |drive| format!(" (drive counter {drive})"));
    let mut lines = vec![
        format!(
            "seed {}: {} counters, path {:.2} m in space, {:.2} m in the level",
            report.seed, report.counters, report.path_m[0], report.path_m[1]
        ),
        format!(
            "ground: slope {:.1}° rising towards {:.0}°; mean tilt of the rover {:.1}°; left camera {:.2} to {:.2} m above it",
            report.slope_deg[0],
            report.slope_deg[1],
            report.mean_tilt_deg,
            report.camera_height_m[0],
            report.camera_height_m[1]
        ),
        format!("{} updates accepted, {} refused", report.accepted, report.refused),
        format!(
            "error at the end {:.3} m, {:.2} % of the path; wheels and gyro alone {:.2} m, {:.0} %",
            report.end_error[0], report.end_error[1], report.wheels_end_error[0], report.wheels_end_error[1]
        ),
        format!("worst accepted update {}{worst}", mm(report.worst_error_m)),
        format!(
            "silently wrong {}; translation more than 5 σ off {}; NEES per degree of freedom (mean, median) {nees}",
            report.silently_wrong, report.beyond_5_sigma
        ),
        format!(
            "smallest motion resolved {}; greatest not resolved {}",
            mm(report.smallest_resolved_m),
            mm(report.greatest_unresolved_m)
        ),
    ];
    lines.extend(report.bins.iter().map(bin_words));
    let refused = report.steps.iter().filter_map(|step| Some((step, step.refusal.as_ref()?)));
    lines.extend(refused.map(|(step, why)| {
        format!("drive counter {}, {:.3} m, {:.1}°: {why}", step.drive, step.true_m, step.true_turn_deg)
    }));
    lines
}

/// The motions of one size in a line.
fn bin_words(bin: &SpiritBin) -> String {
    let size = match bin.up_to_m {
        0.0 => "no motion".to_owned(),
        m if m.is_finite() => format!("up to {:.0} mm", 1e3 * m),
        _ => "longer".to_owned(),
    };
    let error = bin.median_error_m.map_or_else(|| "-".to_owned(), |m| format!("{:.2} mm", 1e3 * m));
    format!(
        "{size:>12}: {:3} counters, {:3} accepted, median error {error}, {:3} resolved",
        bin.counters, bin.accepted, bin.resolved
    )
}
