//! Trackability of a stop's left image: stereo and noise are computed once, then any pixel can be rated.
//!
//! ```text
//! longest step = min( step_share · R,  step_stretch · R / (tan θ │sin ε│) )
//! ```
//! The first is the papers' rule (R104, R105). The second: a horizontal motion s rotates the line of sight by s │sin ε│/R
//! in the vertical plane, which foreshortens a window whose surface is seen at θ from its normal by tan θ times that;
//! R60's nominal change is 10 %.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | R | `range_m` | m |
//! | θ | `incidence_rad` | rad |
//! | ε | angle of the line of sight with the horizontal plane of the rover frame | rad |

use std::sync::Arc;

use super::depth::{Ranges, Surface, WindowRanges};
use super::point_ranges::{PointRanges, effective_baseline_m};
use super::{Aspect, Criterion, TrackabilityLimits, Verdict, texture};
use crate::pipeline::Stops;
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::estimate::quantile::upper_median;
use sightline_geometry::frames::Pixel;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_track::locate::shape_tracker::surface::StopSurface;
use sightline_track::settings::Settings;
use sightline_vision::correlate::Focus;
use sightline_vision::image::GrayImage;
use sightline_vision::image::patch::{self, Patch};
use sightline_vision::stereo::StereoSettings;

/// Motion of a pixel in a step of 10 % straight ahead, relative to its distance from the image's centre: 1/(1 − 0.1) − 1.
const STEP_FLOW: f64 = 0.11;

/// Images, ranges and noise of a stop's left image, as input of the criteria.
pub struct Ground {
    /// The stop.
    pub step: usize,
    /// The settings with which a target would be designated and tracked.
    pub settings: Settings,
    /// The limits.
    pub limits: TrackabilityLimits,
    image: Arc<GrayImage>,
    left: Camera,
    right: Camera,
    surface: Surface,
    edges_px: Vec<f32>,
    focus: Focus,
    noise: f64,
    level: f64,
}

/// The rating of a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// The rated pixel.
    pub pixel: Pixel,
    /// The worst verdict of its criteria.
    pub verdict: Verdict,
    /// The first criterion with that verdict; `None` if all are good.
    pub reason: Option<Aspect>,
    /// Its criteria.
    pub criteria: Vec<Measured>,
    /// The distance from the left camera, m.
    pub range_m: Option<f64>,
    /// The longest safe step, m.
    pub longest_step_m: Option<f64>,
}

/// The measurement of one criterion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The criterion.
    pub aspect: Aspect,
    /// The measured value; `None` if it could not be measured.
    pub value: Option<f64>,
    /// Limit beyond which it is risky.
    pub risky: Option<f64>,
    /// Limit beyond which it is bad.
    pub bad: Option<f64>,
    /// Verdict of this criterion alone.
    pub verdict: Verdict,
}

impl Measured {
    /// Compares a value with its limits; without a value the verdict is good.
    pub fn new(aspect: Aspect, value: Option<f64>, risky: Option<f64>, bad: Option<f64>) -> Self {
        let beyond = |limit: Option<f64>| {
            value.zip(limit).is_some_and(|(v, limit)| if aspect.at_least() { v < limit } else { v > limit })
        };
        let verdict = match (beyond(bad), beyond(risky)) {
            (true, _) => Verdict::Bad,
            (false, true) => Verdict::Risky,
            _ => Verdict::Good,
        };
        Self { aspect, value, risky, bad, verdict }
    }

    /// Converts to the serialised form.
    pub fn criterion(&self) -> Criterion {
        Criterion {
            aspect: self.aspect,
            value: self.value.filter(|value| value.is_finite()),
            unit: self.aspect.unit().to_owned(),
            risky: self.risky,
            bad: self.bad,
            at_least: self.aspect.at_least(),
            verdict: self.verdict,
            source: self.aspect.source().to_owned(),
        }
    }
}

impl Assessment {
    fn new(pixel: Pixel, criteria: Vec<Measured>, seen: Option<(f64, f64)>) -> Self {
        let verdict = criteria.iter().map(|one| one.verdict).max().unwrap_or_default();
        let of_worst = criteria.iter().filter(|one| one.verdict == verdict && verdict != Verdict::Good);
        let reason = of_worst.map(|one| one.aspect).min();
        let (range_m, longest_step_m) = seen.unzip();
        Self { pixel, verdict, reason, criteria, range_m, longest_step_m }
    }

    /// The measured value of the reason.
    pub fn value(&self) -> Option<f64> {
        let one = self.criteria.iter().find(|one| Some(one.aspect) == self.reason)?;
        one.value
    }

    /// Explains the reason in one sentence; `None` if all criteria are good.
    pub fn sentence(&self) -> Option<String> {
        self.reason.map(|aspect| aspect.sentence(self.value(), self.verdict))
    }
}

impl Ground {
    /// Computes stereo and noise of a stop. The stereo result is shared with the trackers of the traverse.
    ///
    /// # Errors
    /// [`Error::Target`] when there is no such stop, [`Error::Request`] for a pair that cannot be aligned; file errors.
    pub fn new(
        stops: &dyn Stops,
        step: usize,
        settings: &Settings,
        limits: &TrackabilityLimits,
    ) -> Result<Self> {
        Self::new_until(stops, step, settings, limits, Cancel::default())
    }

    /// [`Ground::new`], cancellable.
    ///
    /// # Errors
    /// As [`Ground::new`], and [`Error::Cancelled`].
    pub fn new_until(
        stops: &dyn Stops,
        step: usize,
        settings: &Settings,
        limits: &TrackabilityLimits,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let count = stops.stop_count();
        if step >= count {
            return Err(Error::Target(format!("step {step} does not exist: the traverse has {count} stops")));
        }
        if let Some(contradiction) = settings.template.contradiction() {
            return Err(Error::Target(contradiction));
        }
        let pair = stops.capture(step, cancel)?;
        let (left, right) = stops.cameras(step);
        let surface = match stops.stereo() {
            StereoGeometry::Lateral => {
                let stereo = StereoSettings::default();
                let shared = stops.shared(step);
                Surface::Dense(StopSurface::shared(shared, &pair, [left, right], &stereo, cancel)?)
            }
            // The rows of two freely placed views cannot be aligned in general.
            StereoGeometry::Convergent => {
                Surface::Points(PointRanges::measure(&pair, [left, right], settings, cancel)?)
            }
        };
        cancel.check()?;
        let (image, edges_px) = (pair.left, surface.edge_distances_px(limits));
        let ranges = Ranges { surface: &surface, left };
        Ok(Self {
            step,
            focus: Focus::new(settings.template.template_size_px, settings.template.focus_px),
            noise: texture::noise(&image),
            level: ground_level(&image, &ranges),
            settings: settings.clone(),
            limits: limits.clone(),
            left: left.clone(),
            right: right.clone(),
            image,
            surface,
            edges_px,
        })
    }

    /// Width and height of the left image, px.
    pub fn size(&self) -> [u32; 2] {
        self.image.dimensions().into()
    }

    /// Rates a pixel by the criteria of the images: by all of them, or (unless `all`) until the verdict is nearly certain.
    pub fn assess(&self, pixel: Pixel, all: bool) -> Assessment {
        let mut criteria = vec![self.rim(pixel)];
        let is_over = |criteria: &[Measured]| {
            !all && criteria.last().is_some_and(|one: &Measured| one.verdict == Verdict::Bad)
        };
        let half = self.settings.template.template_size_px / 2;
        let window = patch::extract(&self.image, pixel, half, self.settings.template.kernel);
        let missing = 1.0 - window.valid_share();
        if criteria[0].verdict != Verdict::Bad {
            criteria.push(Measured::new(Aspect::Data, Some(missing), None, Some(0.0)));
        }
        if is_over(&criteria) {
            return Assessment::new(pixel, criteria, None);
        }
        let seen = self.depth(pixel, &mut criteria);
        if is_over(&criteria) || missing > 0.0 {
            return Assessment::new(pixel, criteria, seen);
        }
        self.grey_values(&window, &mut criteria);
        // The most expensive criterion: it seldom lowers a verdict that is already risky.
        if all || criteria.iter().all(|one| one.verdict == Verdict::Good) {
            let (template, limits) = (&self.settings.template, &self.settings.limits);
            let likeness = texture::likeness(&self.image, pixel, &window, template.search_window_px);
            let limits = [limits.far_ncc_min, template.renew_ncc];
            criteria.push(Measured::new(Aspect::Likeness, likeness, Some(limits[0]), Some(limits[1])));
        }
        Assessment::new(pixel, criteria, seen)
    }

    fn rim(&self, pixel: Pixel) -> Measured {
        let [width, height] = self.size().map(|side| f64::from(side) - 1.0);
        let distance = pixel.x.min(pixel.y).min(width - pixel.x).min(height - pixel.y);
        let half = f64::from(self.settings.template.template_size_px / 2);
        let flow = STEP_FLOW * pixel.distance(Pixel::new(width / 2.0, height / 2.0));
        Measured::new(Aspect::Rim, Some(distance), Some(half + flow), Some(half + 1.0))
    }

    /// Adds the criteria of range, edges and the window's plane; returns the range and the longest safe step.
    fn depth(&self, pixel: Pixel, criteria: &mut Vec<Measured>) -> Option<(f64, f64)> {
        let ranges = Ranges { surface: &self.surface, left: &self.left };
        let hole = |outcome: sightline_vision::stereo::Outcome| Measured {
            aspect: Aspect::Range,
            value: Some(f64::from(outcome as u8)),
            risky: None,
            bad: None,
            verdict: Verdict::Bad,
        };
        let Some(at) = ranges.aligned(pixel) else {
            criteria.push(hole(sightline_vision::stereo::Outcome::Outside));
            return None;
        };
        let Some(point) = ranges.point(at) else {
            criteria.push(hole(ranges.outcome(at)));
            return None;
        };
        let (range_m, half) =
            (ranges.range_m(&point), f64::from(self.settings.template.template_size_px / 2));
        let (limits, own) = (&self.settings.limits, &self.limits);
        let edge = f64::from(self.edges_px[(at[1] * self.surface.map().width + at[0]) as usize]);
        // Beyond the focus of the refinement an edge has little weight.
        let focus_px = self.settings.template.focus_px;
        let near = if focus_px > 0.0 { (own.edge_risky_focus * focus_px).min(half) } else { half };
        let window = ranges.window(at, range_m, half);
        let error = self.range_error(pixel, range_m);
        // Stereo noise resembles relief; far away it is most of it.
        let noise = error.unwrap_or(0.0);
        if let score @ Some(_) = ranges.stereo_score(at) {
            criteria.push(Measured::new(Aspect::StereoScore, score, None, Some(limits.stereo_ncc_min)));
        }
        criteria.extend([
            Measured::new(Aspect::RangeError, error, Some(own.range_error_risky), Some(own.range_error_bad)),
            Measured::new(Aspect::Relief, window.departure, Some(limits.warn_boundary + noise), None),
            Measured::new(Aspect::DepthRange, window.spread, Some(limits.warn_depth_range + noise), None),
            Measured::new(
                Aspect::Slant,
                window.incidence_rad.map(f64::to_degrees),
                Some(own.slant_risky_deg),
                None,
            ),
            Measured::new(Aspect::DepthEdge, Some(edge), Some(near), Some(own.edge_bad_px)),
        ]);
        Some((range_m, self.longest_step_m(pixel, range_m, &window)))
    }

    /// 3σ of the range over the range (K-Eq 1).
    fn range_error(&self, pixel: Pixel, range_m: f64) -> Option<f64> {
        let focal_px = self.left.model.focal_length_px(pixel)?;
        let baseline_m = match self.surface {
            Surface::Dense(_) => (self.right.model.centre() - self.left.model.centre()).norm(),
            Surface::Points(_) => effective_baseline_m(&self.left.ray(pixel)?, &self.right),
        };
        Some(range_m * self.settings.limits.disparity_error_px / (focal_px * baseline_m))
    }

    fn longest_step_m(&self, pixel: Pixel, range_m: f64, window: &WindowRanges) -> f64 {
        let by_range_m = self.limits.step_share * range_m;
        let sine = self.left.ray(pixel).map_or(0.0, |ray| ray.direction.z.abs());
        let turn = window.incidence_rad.map_or(0.0, |incidence| incidence.tan().abs() * sine);
        by_range_m.min(self.limits.step_stretch * range_m / turn.max(1e-9))
    }

    fn grey_values(&self, window: &Patch, criteria: &mut Vec<Measured>) {
        let (limits, own) = (&self.settings.limits, &self.limits);
        let saturated = texture::share(window, |value| f64::from(value) >= own.saturated_level);
        let dark = texture::share(window, |value| f64::from(value) < own.dark_level * self.level);
        let sigma = texture::match_sigma_px(window, self.noise, own.step_score, &self.focus);
        // Without a gradient in some direction a match may be anywhere in the search window.
        let sigma = sigma.unwrap_or(f64::from(self.settings.template.search_window_px));
        let flat = patch::FLAT_STD;
        criteria.extend([
            Measured::new(
                Aspect::Saturation,
                Some(saturated),
                Some(own.saturated_risky),
                Some(own.saturated_bad),
            ),
            Measured::new(Aspect::Dark, Some(dark), Some(limits.warn_shadow_share), None),
            Measured::new(Aspect::Contrast, window.std(), Some(limits.warn_contrast), Some(flat)),
            Measured::new(
                Aspect::Texture,
                Some(sigma),
                Some(own.match_sigma_risky_px),
                Some(own.match_sigma_bad_px),
            ),
        ]);
    }
}

/// The median grey level of the pixels with a range: the ground, not the sky.
fn ground_level(image: &GrayImage, ranges: &Ranges<'_>) -> f64 {
    let mut levels = Vec::new();
    for y in (0..image.height()).step_by(8) {
        for x in (0..image.width()).step_by(8) {
            let value = image.get_pixel(x, y)[0];
            let place = ranges.aligned(Pixel::new(f64::from(x), f64::from(y)));
            if value.is_finite() && place.and_then(|place| ranges.point(place)).is_some() {
                levels.push(value);
            }
        }
    }
    upper_median(&mut levels).map_or(0.0, f64::from)
}
