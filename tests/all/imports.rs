//! Real recordings, imported and opened: the traverse has the values of the files.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use nalgebra::{Matrix3, Point3};
use sightline_geometry::frames::Pixel;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_recordings::Traverse;
use sightline_recordings::import::pds3::Product;
use sightline_recordings::import::{ImportOptions, Imported, import};
use sightline_tests::data;

fn imported(source: &Path, folder: &Path) -> (Imported, Traverse) {
    let cancel = AtomicBool::new(false);
    let imported =
        import(source, &ImportOptions::default(), folder, &mut |_, _| {}, &cancel).expect("importable");
    (imported, Traverse::open(folder).expect("a traverse that opens"))
}

#[test]
fn kitti_opens_with_its_true_poses_in_rover_axes() {
    let Some(source) = data::set("kitti-seq1-frames-0-19", "the KITTI import") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (made, traverse) = imported(&source, folder.path());
    assert_eq!((traverse.stop_count(), made.images_written), (20, 40));
    assert!(made.notes.is_empty() && traverse.warnings().is_empty());
    let baseline = traverse.right_camera(0).model.centre() - traverse.left_camera(0).model.centre();
    assert!((baseline.y - 0.53715).abs() < 1e-5 && baseline.x == 0.0 && baseline.z == 0.0, "{baseline}");

    let text = std::fs::read_to_string(source.join("poses.txt")).unwrap();
    for (step, line) in text.lines().enumerate() {
        let p: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let pose = traverse.true_site_from_rover(step).unwrap();
        // Rover x, y, z are camera z, x, y.
        let position = Point3::new(p[11], p[3], p[7]);
        assert!((pose * Point3::origin() - position).norm() < 1e-8, "step {step}");
        let rotation = Matrix3::new(p[10], p[8], p[9], p[2], p[0], p[1], p[6], p[4], p[5]);
        let difference = pose.rotation.to_rotation_matrix().matrix() - rotation;
        assert!(difference.amax() < 1e-6, "step {step}: {difference}");
        assert!((traverse.index().stops[step].time_s - 0.1 * step as f64).abs() < 1e-12);
    }
}

#[test]
fn kitti_images_are_copied_bit_for_bit_and_fit_their_cameras() {
    let Some(source) = data::set("kitti-seq1-frames-0-19", "the KITTI images") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (_, traverse) = imported(&source, folder.path());
    for (step, stop) in traverse.index().stops.iter().enumerate() {
        let pair = traverse.capture(step).unwrap();
        assert_eq!((pair.left.dimensions(), pair.right.dimensions()), ((1226, 370), (1226, 370)));
        for name in [&stop.left.image, &stop.right.image] {
            assert_eq!(
                std::fs::read(source.join(name)).unwrap(),
                std::fs::read(folder.path().join(name)).unwrap()
            );
        }
    }
}

#[test]
fn the_navcam_pair_opens_as_one_convergent_stop() {
    let Some(source) = data::set("mer1-navcam-sol4087-pair", "the PDS3 import") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (made, traverse) = imported(&source, folder.path());
    assert_eq!((traverse.stop_count(), traverse.index().stereo), (1, StereoGeometry::Convergent));
    assert!(made.notes.is_empty(), "{:?}", made.notes);
    let stop = &traverse.index().stops[0];
    assert_eq!(stop.site_from_rover.position_m, [73.9193, 65.9703, 6.56288]);
    assert_eq!(stop.site_from_rover.quaternion_sxyz, [0.580525, 0.0333603, -0.128929, 0.803278]);
    assert_eq!(traverse.index().full_scale_dn, Some(4095.0));
    // The label has the negative of the sun's elevation: -41.7863.
    let light = traverse.light(0, &AtomicBool::new(false)).unwrap().unwrap();
    assert_eq!([light.sun_azimuth_deg, light.sun_elevation_deg], [281.703, 41.7863]);
    assert_eq!(light.exposure_s, Some(0.41984));
    let views =
        [(stop.left.image.as_str(), traverse.left_camera(0)), (&stop.right.image, traverse.right_camera(0))];
    assert!(views[0].0.starts_with("1N491020376") && views[1].0.starts_with("1N491020519"));

    for row in data::table(&source.join("expected_projections.csv"), 2) {
        let name = row.names[0].replace(".IMG", ".png");
        let Some((_, camera)) = views.iter().find(|(image, _)| *image == name) else { continue };
        let [x, y, z] = [0, 1, 2].map(|k| row.numbers[k]);
        let pixel = camera.project(&Point3::new(x, y, z)).unwrap();
        assert!(
            pixel.distance(Pixel::new(row.numbers[3], row.numbers[4])) < 0.001,
            "{name}: {:?}",
            row.numbers
        );
    }
}

#[test]
fn a_hazcam_image_from_the_same_stop_is_a_further_camera() {
    let Some(source) = data::set("mer1-navcam-sol4087-pair", "the hazcam of the import") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (_, traverse) = imported(&source, folder.path());
    let cameras: Vec<_> = traverse.further_cameras(0).collect();
    assert_eq!(cameras.len(), 1);
    // The other image of that moment is not in the folder: a single camera.
    assert_eq!((cameras[0].name.as_str(), cameras[0].right), ("front_hazcam_left", None));
    let product = Product::read(&source.join("1F490747543EFFCNY9P1214L0M1.IMG")).unwrap();
    let image = traverse.capture_one(0, Some(cameras[0].name), true).unwrap();
    let raster = product.read_raster().unwrap();
    assert_eq!(image.dimensions(), (raster.width, raster.height));
    for (dn, fraction) in raster.samples.iter().zip(image.as_raw()) {
        assert!((f64::from(*fraction) * 4095.0 - f64::from(*dn)).abs() < 1e-3);
    }
    // Transformed from the rover frame of its own label into that of the stop.
    let rover_from_site = traverse.site_from_rover(0).inverse();
    let expected =
        product.camera().unwrap().moved(&(rover_from_site * product.site_from_rover().unwrap().to_pose()));
    let apart_m = (expected.model.centre() - cameras[0].left.model.centre()).norm();
    assert!(apart_m < 1e-9, "{apart_m} m");
}

#[test]
fn matched_points_project_to_where_they_were_matched() {
    for (set, count, expected_px) in
        [("mer1-navcam-sol4087-pair", 616, 0.30), ("mer2-navcam-sol1869", 621, 0.85)]
    {
        let Some(source) = data::set(set, "its reference matches") else { continue };
        let folder = tempfile::tempdir().unwrap();
        let (_, traverse) = imported(&source, folder.path());
        let rows = data::table(&source.join("reference_matches.csv"), 0);
        assert_eq!(rows.len(), count, "{set}");
        let mut residuals_px = Vec::new();
        for row in rows {
            let [u1, v1, u2, v2, x, y, z] = [0, 1, 2, 3, 4, 5, 6].map(|k| row.numbers[k]);
            let point = Point3::new(x, y, z);
            let seen = traverse.left_camera(0).project(&point).zip(traverse.right_camera(0).project(&point));
            // Noise makes the rays of matches near the horizon diverge: those "points" are behind the cameras.
            let Some((left, right)) = seen else { continue };
            residuals_px.extend([left.distance(Pixel::new(u1, v1)), right.distance(Pixel::new(u2, v2))]);
        }
        assert!(residuals_px.len() as f64 > 2.0 * 0.85 * count as f64, "{set}: {}", residuals_px.len());
        residuals_px.sort_by(f64::total_cmp);
        let median_px = residuals_px[residuals_px.len() / 2];
        // The medians from the READMEs of the sets; the points are rounded to 1 mm, which is 0.1 px at 5 m.
        assert!((median_px - expected_px).abs() < 0.03, "{set}: {median_px}");
    }
}

#[test]
fn imported_pixels_match_the_statistics_of_their_labels() {
    for (set, file, mean, smallest, largest) in [
        ("mer2-navcam-sol1869", "2n292280938effb100p0703l0m1.img", 1231.7844, 297.0, 4079.0),
        ("mer1-hazcam-edr", "1F483288473EFFCMUFP1214L0M1.IMG", 840.0535, 5.0, 4046.0),
        ("mer1-navcam-sol4087-pair", "1N491020376ILFCNY9P0706L0M1.IMG", 1421.7096, 517.0, 4029.0),
    ] {
        let Some(folder) = data::set(set, "its label statistics") else { continue };
        let product = Product::read(&folder.join(file)).unwrap();
        let raster = product.read_raster().unwrap();
        let (own_mean, own_smallest, own_largest) = raster.statistics();
        assert!((own_mean - mean).abs() < 5e-5, "{file}: {own_mean}");
        assert_eq!(
            (own_smallest, own_largest, raster.full_scale_dn),
            (smallest, largest, Some(4095.0)),
            "{file}"
        );
    }
    let Some(source) = data::set("mer1-navcam-sol4087-pair", "its imported pixels") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (_, traverse) = imported(&source, folder.path());
    let product = Product::read(&source.join("1N491020519ILFCNY9P0706L0M1.IMG")).unwrap();
    let raster = product.read_raster().unwrap();
    let image = traverse.capture(0).unwrap().right;
    for (dn, fraction) in raster.samples.iter().zip(image.as_raw()) {
        assert!((f64::from(*fraction) * 4095.0 - f64::from(*dn)).abs() < 1e-3);
    }
}

#[test]
fn a_folder_without_a_pair_names_what_is_missing() {
    for set in ["mer2-navcam-linearized", "msl-navcam-hazcam", "mer1-hazcam-edr"] {
        let Some(source) = data::set(set, "the refusal of its import") else { continue };
        let folder = tempfile::tempdir().unwrap();
        let options = ImportOptions::default();
        let refused = import(&source, &options, folder.path(), &mut |_, _| {}, &AtomicBool::new(false));
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("no two pictures that make a stereo stop"), "{message}");
    }
}

#[test]
fn two_products_chosen_by_name_make_a_stop() {
    let Some(source) = data::set("mer2-navcam-sol1869", "an import of chosen files") else { return };
    let folder = tempfile::tempdir().unwrap();
    let files = ["2n292280989effb100p0703l0m1.img", "2n292280938effb100p0703l0m1.img"];
    let options = ImportOptions { files: files.map(Into::into).to_vec(), ..ImportOptions::default() };
    import(&source, &options, folder.path(), &mut |_, _| {}, &AtomicBool::new(false)).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(traverse.index().stops[0].left.image, "2N292280989EFFB100P0703L0M1.png");
    assert_eq!(traverse.index().stereo, StereoGeometry::Convergent);
    assert!(traverse.capture(0).is_ok());
}
