//! Tests of the checks of an index of stops: jumps of the pose, and a rover that does not move.

use super::*;
use crate::IndexFormat;

/// An index of stops at these positions along x, m.
fn index(positions_m: &[f64]) -> TraverseIndex {
    let camera =
        "{ model = \"CAHV\", size = [8, 8], C = [0, 0, 0], A = [1, 0, 0], H = [1, 1, 0], V = [1, 0, 1] }";
    let mut text = "format = 1\nname = \"way\"\n".to_owned();
    for (step, x_m) in positions_m.iter().enumerate() {
        text += &format!(
            "[[stops]]\ntime_s = {step}.0\nleft = {{ image = \"{step}l.png\", camera = {camera} }}\n\
             right = {{ image = \"{step}r.png\", camera = {camera} }}\n\
             [stops.site_from_rover]\nposition_m = [{x_m:?}, 0.0, 0.0]\nquaternion_sxyz = [1.0, 0.0, 0.0, 0.0]\n"
        );
    }
    crate::index_file::parse(&text, IndexFormat::Toml).unwrap()
}

#[test]
fn a_jump_of_the_poses_is_named_with_its_stop_and_length() {
    let found = jumps(&index(&[100.0, 0.5, 1.0, 1.5, 2.0]));
    assert_eq!(found.len(), 1);
    assert!(found[0].starts_with("stops[1].site_from_rover: is 99.5 m from the stop before"), "{found:?}");
    assert!(found[0].contains("0.50 m"), "{found:?}");
    let short = jumps(&index(&[0.0, 0.1, 0.2, 0.3, 2.8]));
    assert!(short[0].starts_with("stops[4]"), "{short:?}");
    let absurd = jumps(&index(&[0.0, 0.5, 1.0, 1e300]));
    assert!(absurd[0].len() < 150, "{absurd:?}");
}

#[test]
fn even_steps_are_no_jumps() {
    for positions_m in [
        vec![0.0],
        vec![0.0, 5.0],
        vec![0.0, 0.0, 0.0, 0.3],
        // A car at a low frame rate.
        vec![0.0, 28.0, 55.0, 85.0, 110.0],
    ] {
        assert_eq!(jumps(&index(&positions_m)), Vec::<String>::new(), "{positions_m:?}");
    }
}

#[test]
fn many_jumps_are_named_briefly() {
    let positions_m: Vec<f64> = (0..30)
        .scan(0.0, |x, step| {
            *x += if step % 3 == 2 { 100.0 } else { 0.5 };
            Some(*x)
        })
        .collect();
    assert_eq!(jumps(&index(&positions_m)).len(), JUMPS_NAMED + 1);
}
