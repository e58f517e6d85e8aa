//! The truth files against closed forms, against the API, and when they are cancelled.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use npyz::NpyFile;

use super::*;
use crate::create_simulated;
use sightline_world::Scenario;
use sightline_world::scenario::Fiducial;

/// Two stops of 128 × 128 px on a level plain with a ball, its cameras pointed with an error.
fn scenario() -> Scenario {
    let mut scenario = Scenario::demo();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (128, 1);
    (scenario.drive.start_distance_m, scenario.drive.end_distance_m) = (5.0, 4.5);
    scenario.drive.pointing_error_deg = 0.05;
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    scenario.terrain.rms_at_1m_m = 0.0;
    scenario.fiducials = vec![Fiducial::Sphere { x_m: 0.4, y_m: 0.2, height_m: 0.6, radius_m: 0.5 }];
    scenario
}

fn read<T: npyz::Deserialize>(folder: &Path, name: &str) -> (Vec<u64>, Vec<T>) {
    let file = File::open(folder.join(TRUTH_FOLDER).join(name)).unwrap();
    let array = NpyFile::new(BufReader::new(file)).unwrap();
    (array.shape().to_vec(), array.into_vec().unwrap())
}

#[test]
fn truth_files_of_a_plane_and_a_ball_hold_their_closed_forms() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    traverse.write_truth(1, &AtomicBool::new(false)).unwrap();
    let world = traverse.world_at(1).unwrap();
    let (middle, to_sun) = (world.solids()[0].middle, world.to_sun());
    for (eye, name) in [(Eye::Left, "left"), (Eye::Right, "right")] {
        let camera = true_camera_in_site(&traverse.index().stops[1], eye).unwrap();
        let (shape, range_m) = read::<f32>(folder.path(), &format!("{name}_0001_range_m.npy"));
        let (_, surface) = read::<i32>(folder.path(), &format!("{name}_0001_surface.npy"));
        let (of_normals, normal) = read::<f32>(folder.path(), &format!("{name}_0001_normal.npy"));
        let (_, shadow) = read::<u8>(folder.path(), &format!("{name}_0001_shadow.npy"));
        assert_eq!((shape, of_normals), (vec![128, 128], vec![128, 128, 3]));
        let (mut seen, mut shaded) = ([0; 3], [0; 2]);
        for k in 0..128 * 128 {
            let ray = camera.ray(Pixel::new((k % 128) as f64, (k / 128) as f64)).unwrap();
            let found = nalgebra::Vector3::from_row_slice(&normal[3 * k..3 * k + 3]).map(f64::from);
            let (o, d) = (ray.origin - middle, ray.direction);
            let root = o.dot(&d).powi(2) - o.norm_squared() + 0.25;
            let (expected_m, expected_normal) = match surface[k] {
                0 => (f64::INFINITY, nalgebra::Vector3::zeros()),
                // The height field stores the mean ground's 0.294 m as f32.
                1 => ((f64::from(0.294f32) - ray.origin.z) / d.z, -nalgebra::Vector3::z()),
                -1000 => {
                    let near_m = -o.dot(&d) - root.sqrt();
                    (near_m, (ray.at(near_m) - middle) / 0.5)
                }
                other => panic!("there is no {other}"),
            };
            assert!(
                f64::from(range_m[k]) == expected_m
                    || (f64::from(range_m[k]) / expected_m - 1.0).abs() < 3e-7
            );
            assert!((found - expected_normal).norm() < 1e-6, "{found} {expected_normal}");
            seen[match surface[k] {
                0 => 0,
                1 => 1,
                _ => 2,
            }] += 1;
            if surface[k] == 1 {
                let off = ray.at(expected_m) - middle;
                let aside_m = (off - off.dot(&to_sun) * to_sun).norm();
                if (aside_m - 0.5).abs() > 1e-3 {
                    assert_eq!(shadow[k] == 1, aside_m < 0.5);
                    shaded[usize::from(shadow[k])] += 1;
                }
            }
        }
        assert!(
            seen.iter().all(|count| *count > 300) && shaded.iter().all(|count| *count > 100),
            "{seen:?} {shaded:?}"
        );
    }
    assert_ne!(traverse.true_left_camera(1), traverse.left_camera(1));
}

#[test]
fn truth_files_number_rocks_as_the_world_does_and_are_not_written_when_cancelled() {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = scenario();
    scenario.rocks = Scenario::demo().rocks;
    let traverse = create_simulated(&scenario, folder.path()).unwrap();
    let cancelled = traverse.write_truth(0, &AtomicBool::new(true));
    assert!(matches!(cancelled, Err(Error::Cancelled)) && !folder.path().join(TRUTH_FOLDER).exists());
    traverse.write_truth(0, &AtomicBool::new(false)).unwrap();
    let (_, surface) = read::<i32>(folder.path(), "left_0000_surface.npy");
    let camera = true_camera_in_site(&traverse.index().stops[0], Eye::Left).unwrap();
    let truth = sightline_world::truth::picture_truth(&traverse.world_at(0).unwrap(), &camera);
    let rocks = truth.surface.iter().zip(&surface).filter_map(|(known, found)| match known {
        Some(SurfaceId::Rock(rock)) => Some((*rock as i32 + 2, *found)),
        _ => None,
    });
    let rocks: Vec<_> = rocks.collect();
    assert!(rocks.len() > 100 && rocks.iter().all(|(known, found)| known == found));
    assert!(traverse.write_truth(2, &AtomicBool::new(false)).is_err());
}
