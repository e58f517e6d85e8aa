//! `sightline-experiments cancel`: how soon each long computation ends once it is cancelled.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use clap::Args;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pixel;
use sightline_recordings::{Traverse, create_simulated_until};
use sightline_rover::trackability::{Ground, TrackabilityLimits};
use sightline_server::cli::open;
use sightline_server::cli::terminal::{self, Progress};
use sightline_session::counterfactual;
use sightline_session::step::RunStep;
use sightline_session::track::{self, NextStep};
use sightline_session::what_if::Base;
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_vision::sift::{self, SiftSettings};
use sightline_vision::stereo::settings::StereoMethod;
use sightline_vision::stereo::{StereoSettings, dense_stereo_until};
use sightline_world::Scenario;

use crate::cancel::{Latency, Work, measure};

/// The presets whose steps are cancelled.
const PRESETS: [&str; 11] = [
    "sightline",
    "sad",
    "sdog",
    "klt-affine",
    "ncc-scale-roll-affine",
    "coarse-to-fine",
    "scale-roll-search",
    "features",
    "features-paper",
    "shape",
    "combined",
];

/// Cancel every long computation at moments spread over its time.
#[derive(Debug, Args)]
pub(super) struct Cancelled {
    /// The folder of a rendered simulated drive with at least two stops, whose first left image has a target at the pixel.
    drive: PathBuf,
    /// Column and row of the target, px.
    #[arg(long, value_delimiter = ',', num_args = 2, default_values_t = [512.0, 600.0])]
    pixel: Vec<f64>,
    /// How many moments.
    #[arg(long, default_value_t = 24)]
    moments: u32,
}

impl Cancelled {
    pub(super) fn run(&self) -> Result<()> {
        let pixel = Pixel::new(self.pixel[0], self.pixel[1]);
        let drive = Traverse::open(&self.drive)?;
        open::render(&drive)?;
        let mut works = of_images(&drive)?;
        works.extend(of_steps(&self.drive, Designation::new(0, pixel))?);
        works.extend(of_worlds());
        let mut progress = Progress::new("cancel: computation");
        terminal::line("| computation | whole, ms | median latency, ms | worst, ms |\n|---|---|---|---|")?;
        for (number, (name, work)) in works.iter().enumerate() {
            progress.tell(number, works.len());
            terminal::line(&row(&measure(name, work, self.moments)))?;
        }
        progress.tell(works.len(), works.len());
        Ok(())
    }
}

fn row(found: &Latency) -> String {
    let ms = |s: Option<f64>| s.map_or_else(|| "–".to_owned(), |s| format!("{:.1}", 1e3 * s));
    let middle = found.latencies_s.get(found.latencies_s.len() / 2).copied();
    let (name, whole) = (&found.name, ms(Some(found.whole_s)));
    format!("| {name} | {whole} | {} | {} |", ms(middle), ms(found.latencies_s.last().copied()))
}

type Named<'a> = (String, Work<'a>);

fn of_images(drive: &Traverse) -> Result<Vec<Named<'static>>> {
    let pair = drive.capture(0)?;
    let cameras = [drive.left_camera(0).clone(), drive.right_camera(0).clone()];
    let left = pair.left.clone();
    let mut works: Vec<Named<'static>> = vec![(
        "SIFT of one image".to_owned(),
        Box::new(move |cancel| drop(sift::detect_until(&left, &SiftSettings::default(), cancel.into()))),
    )];
    for method in [StereoMethod::SemiGlobal, StereoMethod::BlockMatching] {
        let (pair, cameras) = (pair.clone(), cameras.clone());
        let settings = StereoSettings { method, ..StereoSettings::default() };
        let work = move |cancel: &AtomicBool| {
            let images = [&*pair.left, &*pair.right];
            drop(dense_stereo_until(images, [&cameras[0], &cameras[1]], &settings, cancel.into()));
        };
        works.push((format!("dense stereo, {method:?}"), Box::new(work)));
    }
    Ok(works)
}

/// A drive whose store is empty, so that nothing is found ready.
fn fresh(folder: &Path) -> Traverse {
    Traverse::open(folder).unwrap_or_else(|error| unreachable!("it was opened before: {error}"))
}

fn of_steps(folder: &Path, designation: Designation) -> Result<Vec<Named<'static>>> {
    let mut works: Vec<Named<'static>> = Vec::new();
    for name in PRESETS {
        let settings = preset(name)?.settings()?;
        let first = track::designate(&fresh(folder), designation, &settings)?;
        let (own, at) = (settings.clone(), folder.to_owned());
        let designate = move |cancel: &AtomicBool| {
            drop(track::designate_until(&fresh(&at), designation, &own, cancel.into()));
        };
        works.push((format!("designation, {name}"), Box::new(designate)));
        let (own, at, begin) = (settings.clone(), folder.to_owned(), first.clone());
        let step = move |cancel: &AtomicBool| drop(advance(&at, &begin, &own, cancel));
        works.push((format!("step, {name}"), Box::new(step)));
        if name == "sightline" {
            works.push(question(folder, first, &settings)?);
        }
    }
    let at = folder.to_owned();
    let ground = move |cancel: &AtomicBool| {
        let (settings, limits) = (Settings::default(), TrackabilityLimits::default());
        drop(Ground::new_until(&fresh(&at), 0, &settings, &limits, cancel.into()));
    };
    works.push(("surface of a trackability map".to_owned(), Box::new(ground)));
    Ok(works)
}

fn advance(folder: &Path, first: &RunStep, settings: &Settings, cancel: &AtomicBool) -> Result<RunStep> {
    let next = NextStep {
        first,
        last: first,
        settings,
        prediction_px: None,
        before: None,
        ended: None,
        cancel: cancel.into(),
    };
    next.compute(&fresh(folder))
}

/// What would have saved a step that a strict limit has lost.
fn question(folder: &Path, first: RunStep, settings: &Settings) -> Result<Named<'static>> {
    let strict = settings.with(&[("ncc_min".to_owned(), 0.9999.into())].into_iter().collect())?;
    let recorded = advance(folder, &first, &strict, &AtomicBool::new(false))?;
    let at = folder.to_owned();
    let ask = move |cancel: &AtomicBool| {
        let base = Base {
            recorded: &recorded,
            first: &first,
            last: Some(&first),
            settings: &strict,
            prediction_px: None,
        };
        drop(counterfactual::look(&fresh(&at), base, cancel, &mut |_| ()));
    };
    Ok(("counterfactual, sightline".to_owned(), Box::new(ask)))
}

fn of_worlds() -> Vec<Named<'static>> {
    let make = |scenario: Scenario| -> Work<'static> {
        Box::new(move |cancel| {
            let folder = std::env::temp_dir().join(format!("sightline-cancel-{}", std::process::id()));
            let made = create_simulated_until(&scenario, &folder, cancel.into());
            if let Ok(traverse) = made {
                // A render that is cancelled is what is measured.
                let _ = traverse.render_step(0, cancel);
            }
            // Nothing of it is there when it was cancelled early.
            let _ = std::fs::remove_dir_all(&folder);
        })
    };
    let mut crowded = Scenario::demo();
    crowded.rocks.area_fraction = 0.15;
    vec![
        ("world of the demo, and its first stop rendered".to_owned(), make(Scenario::demo())),
        ("world with many rocks, and its first stop rendered".to_owned(), make(crowded)),
    ]
}
