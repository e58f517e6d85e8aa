//! The trackability map of convergent pairs, compared with point stereo as a designation uses it.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::frames::{Pixel, Pose, Vector3};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_recordings::{Traverse, import};
use sightline_rover::pipeline::{self, Stops};
use sightline_rover::trackability::*;
use sightline_testing::PlaneWorld;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

/// Largest left–right distance of a valid match, px.
const LEFT_RIGHT_MAX_PX: f64 = 1.5;

/// Largest difference of the disparities of consistent neighbours, px.
const AGREE_PX: f64 = 1.5;

/// Number of the four neighbours that must be consistent.
const AGREE_MIN: usize = 3;

/// The map's ranges, compared with designations that pass the left–right check and have consistent neighbours.
#[derive(Debug, Default)]
struct Agreement {
    /// Number of pixels with such a designation.
    matched: usize,
    /// Number of them at which the map has a range.
    both: usize,
    /// Number of them at which both ranges agree.
    ranges_agree: usize,
}

impl Agreement {
    fn of(stops: &dyn Stops, ground: &Ground, pixels: &[Pixel]) -> Self {
        let mut agreement = Self::default();
        for pixel in pixels {
            let Some(inverse) = consistent(stops, *pixel) else { continue };
            agreement.matched += 1;
            let Some(range_m) = ground.assess(*pixel, true).range_m else { continue };
            agreement.both += 1;
            let difference_px = (1.0 / range_m - inverse).abs() * product(stops, *pixel);
            agreement.ranges_agree += usize::from(difference_px <= AGREE_PX);
        }
        agreement
    }

    fn recall(&self) -> f64 {
        self.both as f64 / self.matched.max(1) as f64
    }
}

/// Disparity times range, px m.
fn product(stops: &dyn Stops, pixel: Pixel) -> f64 {
    let (left, right) = stops.cameras(0);
    let ray = left.ray(pixel).unwrap();
    let baseline = right.model.centre() - ray.origin;
    let across = baseline - ray.direction * baseline.dot(&ray.direction);
    left.model.focal_length_px(pixel).unwrap() * across.norm()
}

/// The inverse range of a designation that passes the left–right check, 1/m.
fn designated(stops: &dyn Stops, pixel: Pixel) -> Option<f64> {
    let first = pipeline::designate(stops, Designation::new(0, pixel), &Settings::default()).ok()?;
    let stereo = first.template()?.point_stereo.clone()?;
    (stereo.left_right_px? <= LEFT_RIGHT_MAX_PX).then_some(1.0 / stereo.range_m)
}

/// The inverse range of a designation with consistent neighbours, 1/m.
fn consistent(stops: &dyn Stops, pixel: Pixel) -> Option<f64> {
    let (inverse, product) = (designated(stops, pixel)?, product(stops, pixel));
    let neighbours = [(-6.0, 0.0), (6.0, 0.0), (0.0, -6.0), (0.0, 6.0)];
    let others = neighbours.iter().filter_map(|(x, y)| designated(stops, pixel.offset(*x, *y)));
    let agreeing = others.filter(|other| (other - inverse).abs() * product <= AGREE_PX);
    (agreeing.count() >= AGREE_MIN).then_some(inverse)
}

fn imported(set: &Path, folder: &Path) -> Traverse {
    let (never, pair) = (AtomicBool::new(false), folder.join("pair"));
    import::import(set, &import::ImportOptions::default(), &pair, &mut |_, _| {}, &never).unwrap();
    Traverse::open(&pair).unwrap()
}

/// The plane seen by a camera whose mast turned by 0.08 rad, which moved it mainly along its line of sight.
fn convergent_plane() -> PlaneWorld {
    let mut world = PlaneWorld::new(vec![Pose::identity()]);
    let (sine, cosine) = 0.08_f64.sin_cos();
    let axis = Vector3::new(cosine, sine, 0.0);
    let horizontal = Vector3::new(-sine, cosine, 0.0) * 600.0 + axis * 127.5;
    let vertical = Vector3::z() * 600.0 + axis * 127.5;
    let centre = world.left.model.centre() + Vector3::new(0.3, 0.2, 0.0);
    let model = CameraModel::Cahv(Cahv::as_printed(centre, axis, horizontal, vertical));
    world.right = Camera::new(model, 256, 256);
    world.stereo = StereoGeometry::Convergent;
    world
}

#[test]
fn a_convergent_pair_has_ranges_wherever_both_views_overlap() {
    let world = convergent_plane();
    let ground = Ground::new(&world, 0, &Settings::default(), &TrackabilityLimits::default()).unwrap();
    let map = TrackabilityMap::of(&ground);
    let (mut seen, mut ranged) = (0, 0);
    for cell in map.cells() {
        let point = world.plane_point(0, &world.left, cell.pixel).unwrap();
        let right = world.right.project(&point).unwrap();
        let margin_px = cell.pixel.x.min(cell.pixel.y).min(255.0 - cell.pixel.x).min(255.0 - cell.pixel.y);
        let right_margin_px = right.x.min(right.y).min(255.0 - right.x).min(255.0 - right.y);
        if margin_px.min(right_margin_px) < 20.0 {
            continue;
        }
        seen += 1;
        let Some(range_m) = cell.range_m else { continue };
        ranged += 1;
        let truth_m = (point - world.left.model.centre()).norm();
        assert!((range_m / truth_m - 1.0).abs() < 0.1, "{:?}: {range_m} of {truth_m}", cell.pixel);
    }
    assert!(seen > 300 && ranged * 20 > seen * 19, "{ranged} of {seen}");
    let cells = (44..256).step_by(32).flat_map(|x| (28..256).step_by(32).map(move |y| [x, y]));
    let cells = cells.map(|[x, y]| Pixel::new(f64::from(x), f64::from(y))).collect::<Vec<_>>();
    let agreement = Agreement::of(&world, &ground, &cells);
    assert!(agreement.matched > 20 && agreement.recall() >= 0.95, "{agreement:?}");
    assert_eq!(agreement.both, agreement.ranges_agree, "{agreement:?}");
    // The plane is smooth and textured: most of it passes all criteria.
    let [good, risky, _] = map.shares();
    assert!(good + risky > 0.4, "{:?}", map.shares());
    let outside = ground.assess(Pixel::new(12.0, 128.0), false);
    assert_eq!((outside.verdict, outside.reason), (Verdict::Bad, Some(Aspect::Range)));
}

#[test]
fn the_overlap_of_the_opportunity_pair_is_not_a_stereo_hole() {
    let name = "mer1-navcam-sol4087-pair";
    let Some(set) = sightline_testdata::recorded(name, "trackability of a convergent pair") else { return };
    let folder = tempfile::tempdir().unwrap();
    let traverse = imported(&set, folder.path());
    let ground = Ground::new(&traverse, 0, &Settings::default(), &TrackabilityLimits::default()).unwrap();
    let text = std::fs::read_to_string(set.join("reference_matches.csv")).unwrap();
    let pixels = text.lines().filter_map(|line| {
        let mut numbers = line.split(',').map_while(|value| value.trim().parse::<f64>().ok());
        Some(Pixel::new(numbers.next()?, numbers.next()?))
    });
    let (mut holes, mut usable, mut all, mut reasons) = (0, 0, 0, std::collections::BTreeMap::new());
    for pixel in pixels.step_by(4) {
        let seen = ground.assess(pixel, false);
        all += 1;
        holes += usize::from(seen.reason == Some(Aspect::Range));
        usable += usize::from(seen.verdict != Verdict::Bad);
        *reasons.entry(format!("{:?} {:?}", seen.verdict, seen.reason)).or_insert(0) += 1;
    }
    println!("{all} matches: {reasons:?}");
    // Most matches are too far away for so short a baseline: 57 % have a 3σ range error above a third.
    assert!(all > 100 && holes * 10 < all * 4, "{holes} of {all} are stereo holes");
    assert!(usable * 10 > all, "{usable} of {all} are usable");
    let cells = (760..1008).step_by(48).flat_map(|x| (340..1000).step_by(48).map(move |y| [x, y]));
    let cells = cells.map(|[x, y]| Pixel::new(f64::from(x / 8 * 8 + 4), f64::from(y / 8 * 8 + 4)));
    let agreement = Agreement::of(&traverse, &ground, &cells.collect::<Vec<_>>());
    println!("{agreement:?}");
    assert!(agreement.matched > 25 && agreement.recall() >= 0.9, "{agreement:?}");
    assert!(agreement.ranges_agree * 20 >= agreement.both * 19, "{agreement:?}");
}
