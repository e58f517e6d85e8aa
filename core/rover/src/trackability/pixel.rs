//! The exact verdict at one pixel: the criteria of the images, and the designation itself.
//!
//! *Good* means that the designation succeeds without a warning. The simulator's ground truth (true shadow) is not used,
//! so that recorded and simulated drives are rated in the same way.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::ground::{Assessment, Ground};
use super::{Aspect, Criterion, Verdict};
use crate::pipeline::{self, Stops};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::template::warnings::WarningKind;
use sightline_track::target::Designation;
use sightline_track::trace::StepTrace;

/// Number of points rated in the search for a good one.
const SEARCHED: usize = 6000;
/// Number of good points designated before the search stops.
const TRIED: usize = 8;

/// The rating of one pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PixelVerdict {
    /// The stop.
    pub step: usize,
    /// The pixel.
    pub pixel: Pixel,
    /// The verdict.
    pub verdict: Verdict,
    /// The reason for the verdict; null if it is good.
    pub reason: Option<String>,
    /// The criteria with value, unit, limits and source.
    pub criteria: Vec<Criterion>,
    /// Distance from the left camera, m: from the designation, or else from dense stereo.
    pub range_m: Option<f64>,
    /// 1σ of that distance according to the designation, m.
    pub range_sigma_m: Option<f64>,
    /// The score of point stereo.
    pub stereo_score: Option<f64>,
    /// Left–right consistency: distance between the pixel and the match of its right partner, px.
    pub left_right_px: Option<f64>,
    /// Longest safe step to the next stop, m.
    pub longest_step_m: Option<f64>,
    /// The nearest good pixel; null if this one is good.
    pub nearest_good: Option<Pixel>,
}

impl PixelVerdict {
    /// Rates a pixel, and searches for a good one near it if it is not good itself.
    pub fn of(stops: &dyn Stops, ground: &Ground, pixel: Pixel) -> Self {
        let mut found = judge(stops, ground, pixel);
        if found.verdict != Verdict::Good {
            found.nearest_good = nearest_good(stops, ground, pixel);
        }
        found
    }
}

/// The nearest pixel of the map's grid that is good and can be designated without a warning.
pub fn nearest_good(stops: &dyn Stops, ground: &Ground, pixel: Pixel) -> Option<Pixel> {
    let [width, height] = ground.size();
    let cell = ground.limits.cell_px.max(2);
    let middles = |size: u32| (cell / 2..size).step_by(cell as usize).map(f64::from);
    let mut places: Vec<Pixel> =
        middles(height).flat_map(|y| middles(width).map(move |x| Pixel::new(x, y))).collect();
    places.sort_by(|a, b| a.distance(pixel).total_cmp(&b.distance(pixel)));
    let good = places
        .into_iter()
        .take(SEARCHED)
        .filter(|place| ground.assess(*place, false).verdict == Verdict::Good);
    good.take(TRIED).find(|place| judge(stops, ground, *place).verdict == Verdict::Good)
}

fn judge(stops: &dyn Stops, ground: &Ground, pixel: Pixel) -> PixelVerdict {
    let seen = ground.assess(pixel, true);
    let designation = Designation::new(ground.step, pixel);
    match pipeline::designate(stops, designation, &ground.settings) {
        Ok(first) => designated(ground, &seen, &first),
        Err(error) => {
            let mut refused = without_designation(ground, &seen);
            refused.criteria.insert(0, designation_criterion(Verdict::Bad));
            (refused.verdict, refused.reason) = (Verdict::Bad, Some(error.to_string()));
            // A reason from the images is more specific than the refusal's message.
            if seen.verdict == Verdict::Bad {
                refused.reason = seen.sentence();
            }
            refused
        }
    }
}

fn without_designation(ground: &Ground, seen: &Assessment) -> PixelVerdict {
    PixelVerdict {
        step: ground.step,
        pixel: seen.pixel,
        verdict: seen.verdict,
        reason: seen.sentence(),
        criteria: seen.criteria.iter().map(super::ground::Measured::criterion).collect(),
        range_m: seen.range_m,
        range_sigma_m: None,
        stereo_score: None,
        left_right_px: None,
        longest_step_m: seen.longest_step_m,
        nearest_good: None,
    }
}

fn designated(ground: &Ground, seen: &Assessment, first: &StepTrace) -> PixelVerdict {
    let mut found = without_designation(ground, seen);
    let (target, evidence) = (&first.update.target, first.template());
    let warnings = evidence.map(|evidence| evidence.warnings.as_slice()).unwrap_or_default();
    let warning = warnings.iter().find(|warning| warning.kind != WarningKind::Shadow);
    let own = if warning.is_some() { Verdict::Risky } else { Verdict::Good };
    found.criteria.insert(0, designation_criterion(own));
    if let Some(warning) = warning.filter(|_| found.verdict == Verdict::Good) {
        (found.verdict, found.reason) = (Verdict::Risky, Some(warning.sentence.clone()));
    }
    let stereo = evidence.and_then(|evidence| evidence.point_stereo.as_ref());
    found.range_m = Some(target.initial_distance_m);
    found.range_sigma_m = Some(target.covariance_in_rover.symmetric_eigenvalues().max().max(0.0).sqrt());
    found.stereo_score = stereo.map(|stereo| stereo.score);
    found.left_right_px = stereo.and_then(|stereo| stereo.left_right_px);
    // Without a range from dense stereo only the papers' rule limits the step.
    found.longest_step_m =
        found.longest_step_m.or(Some(ground.limits.step_share * target.initial_distance_m));
    found
}

fn designation_criterion(verdict: Verdict) -> Criterion {
    Criterion {
        aspect: Aspect::Refused,
        value: None,
        unit: String::new(),
        risky: None,
        bad: None,
        at_least: false,
        verdict,
        source: Aspect::Refused.source().to_owned(),
    }
}
