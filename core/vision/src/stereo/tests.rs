//! Dense stereo against direct sums, and against scenes with known disparities.

use image::Luma;

use super::*;

/// Settings with all gates off.
fn plain(method: StereoMethod, first: i32, count: u32) -> StereoSettings {
    StereoSettings {
        method,
        disparity_first_px: first,
        disparity_count: count,
        texture_min: 0.0,
        uniqueness_min: 0.0,
        left_right_max_px: -1.0,
        speckle_px: 0,
        ..StereoSettings::default()
    }
}

fn hash(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    (h >> 8) as f32 / 16_777_216.0
}

/// A smooth texture without repetition.
fn texture(x: f64, y: f64) -> f32 {
    let wave = |k: u32| {
        let (turn, length) = (f64::from(k) * 2.399_963, 5.0 * 1.17_f64.powi(k as i32));
        let along = x * turn.cos() + y * turn.sin();
        (std::f64::consts::TAU * along / length + f64::from(k * k)).sin()
    };
    (0.5 + 0.06 * (0..14).map(wave).sum::<f64>()).clamp(0.0, 1.0) as f32
}

/// Both images of a surface whose disparity at the left pixel (x, y) is `disparity(x, y)`, which must change slowly.
fn pair([width, height]: [u32; 2], disparity: impl Fn(f64, f64) -> f64) -> [GrayImage; 2] {
    let left = GrayImage::from_fn(width, height, |x, y| Luma([texture(x.into(), y.into())]));
    let right = GrayImage::from_fn(width, height, |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        let mut at = x;
        for _ in 0..20 {
            at = x + disparity(at, y);
        }
        Luma([texture(at, y)])
    });
    [left, right]
}

/// The cost of a cell, bit by bit; block matching compares a subset of the pixels.
fn cost([left, right]: [&GrayImage; 2], [x, y]: [i32; 2], disparity: i32, method: StereoMethod) -> u32 {
    let is_block = method == StereoMethod::BlockMatching;
    let at = |image: &GrayImage, x: i32, y: i32| {
        let x = x.clamp(0, image.width() as i32 - 1);
        image.get_pixel(x as u32, y.clamp(0, image.height() as i32 - 1) as u32)[0]
    };
    let partner = x - disparity;
    if partner < 0 || partner >= right.width() as i32 {
        return if is_block { 9 } else { 24 };
    }
    let mut bits = 0;
    for dy in -3..=3 {
        for dx in -4..=4_i32 {
            if is_block && (dx % 2 != 0 || (dy % 2 == 0 && dy != 0)) {
                continue;
            }
            let is_brighter = |image: &GrayImage, x: i32| at(image, x + dx, y + dy) > at(image, x, y);
            bits += u32::from(is_brighter(left, x) != is_brighter(right, partner));
        }
    }
    bits
}

/// Sums of every cell along the paths, by the recurrence as printed.
fn path_sums(costs: &[Vec<u32>], left: &GrayImage, settings: &StereoSettings) -> Vec<Vec<u32>> {
    let (width, height) = (left.width() as i32, left.height() as i32);
    let mut paths = vec![[1, 0], [-1, 0], [1, 1], [0, 1], [-1, 1]];
    if settings.paths == StereoPaths::Eight {
        paths.extend([[1, -1], [0, -1], [-1, -1]]);
    }
    let count = settings.disparity_count as usize;
    let mut sums = vec![vec![0; count]; costs.len()];
    for [dx, dy] in paths {
        let mut l: Vec<Vec<u32>> = vec![Vec::new(); costs.len()];
        for step in 0..width * height {
            let (mut x, mut y) = (step % width, step / width);
            (x, y) = (if dx < 0 { width - 1 - x } else { x }, if dy < 0 { height - 1 - y } else { y });
            let (at, px, py) = ((y * width + x) as usize, x - dx, y - dy);
            let is_inside = px >= 0 && py >= 0 && px < width && py < height;
            let before = if is_inside { l[(py * width + px) as usize].clone() } else { vec![0; count] };
            let least = *before.iter().min().unwrap();
            let value = |x: i32, y: i32| left.get_pixel(x as u32, y as u32)[0];
            let edge = if is_inside { (value(x, y) - value(px, py)).abs() } else { 0.0 };
            let (even, low) = (settings.large_step as f32, settings.large_step_least as f32);
            let large = (even - (settings.large_step_slope as f32 * edge).min(even - low)) as u32;
            let cell = |d: usize| {
                let beside = [d.checked_sub(1), Some(d + 1).filter(|d| *d < count)];
                let beside = beside.into_iter().flatten().map(|d| before[d] + settings.small_step);
                beside.chain([before[d], least + large]).min().unwrap() - least + costs[at][d]
            };
            l[at] = (0..count).map(cell).collect();
        }
        for (sum, l) in sums.iter_mut().flatten().zip(l.iter().flatten()) {
            *sum += l;
        }
    }
    sums
}

fn window_sums(costs: &[Vec<u32>], [width, height]: [i32; 2], half: i32) -> Vec<Vec<u32>> {
    let sum = |at: i32| {
        let (x, y) = (at % width, at / width);
        let mut sum = vec![0; costs[0].len()];
        for v in (y - half).max(0)..=(y + half).min(height - 1) {
            for u in (x - half).max(0)..=(x + half).min(width - 1) {
                let cost = &costs[(v * width + u) as usize];
                sum.iter_mut().zip(cost).for_each(|(sum, cost)| *sum += cost);
            }
        }
        sum
    };
    (0..width * height).map(sum).collect()
}

/// Winners from direct sums: index of the disparity of every left pixel.
fn expected(images: [&GrayImage; 2], settings: &StereoSettings) -> Vec<usize> {
    let [left, _] = images;
    let (width, height) = (left.width() as i32, left.height() as i32);
    let count = settings.disparity_count as i32;
    let costs: Vec<Vec<u32>> = (0..width * height)
        .map(|at| {
            let pixel = [at % width, at / width];
            (0..count)
                .map(|d| cost(images, pixel, d + settings.disparity_first_px, settings.method))
                .collect()
        })
        .collect();
    let sums = match settings.method {
        StereoMethod::SemiGlobal => path_sums(&costs, left, settings),
        StereoMethod::BlockMatching => window_sums(&costs, [width, height], settings.window_px as i32 / 2),
    };
    let first_least = |sums: &Vec<u32>| sums.iter().zip(0..).min().unwrap().1;
    sums.iter().map(first_least).collect()
}

fn found(images: [&GrayImage; 2], settings: &StereoSettings) -> Vec<usize> {
    let scene = Scene::new(images[0], images[1], settings, Cancel::default());
    let mut found = Vec::new();
    let take = |_: usize, row: &RowResult| found.extend(row.pixels.iter().map(|pixel| pixel.index()));
    let (rows, mut band) = (0..scene.size[1], block_matching::Band::new(&scene));
    match (settings.method, scene.cells) {
        (StereoMethod::SemiGlobal, 64) => semi_global::match_rows::<1>(&scene, take),
        (StereoMethod::SemiGlobal, _) => semi_global::match_rows::<2>(&scene, take),
        (StereoMethod::BlockMatching, 64) => block_matching::match_rows::<1>(&scene, &mut band, rows, take),
        (StereoMethod::BlockMatching, _) => block_matching::match_rows::<2>(&scene, &mut band, rows, take),
    }
    found
}

#[test]
fn both_methods_find_what_sums_taken_one_by_one_find() {
    // A noisy surface, so that many disparities have similar costs, in an image no wider than a few blocks.
    let [left, right] = pair([75, 33], |x, y| 6.0 + 0.05 * x + 0.1 * y);
    let noisy = |image: &GrayImage, seed: u32| {
        GrayImage::from_fn(image.width(), image.height(), |x, y| {
            // Multiples of 1/255, since the census uses 16 bits.
            Luma([((image.get_pixel(x, y)[0] * 0.8 + 0.2 * hash(x + seed, y)) * 255.0).round() / 255.0])
        })
    };
    let (left, right) = (noisy(&left, 0), noisy(&right, 1000));
    for (first, count) in [(0, 20), (-5, 64), (3, 70)] {
        for method in [StereoMethod::SemiGlobal, StereoMethod::BlockMatching] {
            for paths in [StereoPaths::Five, StereoPaths::Eight] {
                let settings = StereoSettings { paths, ..plain(method, first, count) };
                let (expected, found) =
                    (expected([&left, &right], &settings), found([&left, &right], &settings));
                let wrong = expected.iter().zip(&found).filter(|(a, b)| a != b).count();
                assert_eq!(wrong, 0, "{method:?} {paths:?} from {first}, {count}");
            }
        }
    }
}

#[test]
fn a_slanted_surface_has_its_disparity_below_the_pixel() {
    let truth = |x: f64, y: f64| 9.3 + 0.031 * x + 0.017 * y;
    let [left, right] = pair([200, 120], truth);
    for (method, rms_max) in [(StereoMethod::SemiGlobal, 0.15), (StereoMethod::BlockMatching, 0.1)] {
        let settings = StereoSettings { method, disparity_count: 40, ..StereoSettings::default() };
        let map = disparities([&left, &right], &settings).unwrap();
        let (mut squares, mut count, mut visible) = (0.0, 0.0, 0.0);
        for (at, found) in map.disparity_px.iter().enumerate() {
            let (x, y) = ((at % 200) as f64, (at / 200) as f64);
            visible += f64::from(u8::from(x - truth(x, y) > 0.0));
            if found.is_finite() {
                squares += (f64::from(*found) - truth(x, y)).powi(2);
                count += 1.0;
            }
        }
        println!(
            "{method:?}: rms {:.3} px of {:.3} of the visible",
            (squares / count).sqrt(),
            count / visible
        );
        assert!((squares / count).sqrt() < rms_max && count > 0.95 * visible, "{method:?}");
    }
}

#[test]
fn every_hole_has_its_own_reason() {
    let [left, right] = pair([160, 96], |_, _| 12.0);
    let settings = |method| StereoSettings { method, disparity_count: 32, ..StereoSettings::default() };
    for method in [StereoMethod::SemiGlobal, StereoMethod::BlockMatching] {
        // A square without texture, an invalid one, and one that is visible in the left image only.
        let painted = |image: &GrayImage, shift: u32, is_right: bool| {
            GrayImage::from_fn(160, 96, |x, y| {
                let value = image.get_pixel(x, y)[0];
                let inside = |left: u32, top: u32| {
                    (left..left + 30).contains(&(x + shift)) && (top..top + 30).contains(&y)
                };
                Luma([if inside(40, 10) {
                    0.5
                } else if inside(40, 55) && !is_right {
                    f32::NAN
                } else if inside(90, 55) && is_right {
                    hash(x, y)
                } else {
                    value
                }])
            })
        };
        let (left, right) = (painted(&left, 0, false), painted(&right, 12, true));
        let map = disparities([&left, &right], &settings(method)).unwrap();
        let outcome = |x: u32, y: u32| map.outcome[(y * 160 + x) as usize];
        let share = |x: u32, y: u32, reason: Outcome| {
            let pixels = (0..144).filter(|k| outcome(x + k % 12, y + k / 12) == reason);
            pixels.count() as f64 / 144.0
        };
        assert!(share(49, 19, Outcome::NoTexture) > 0.99, "{method:?}");
        assert!(share(49, 64, Outcome::Outside) > 0.99, "{method:?}");
        assert!(share(99, 64, Outcome::Found) < 0.5, "{method:?}: {}", share(99, 64, Outcome::Found));
        assert!(share(140, 40, Outcome::Found) > 0.99, "{method:?}");
        let at_border = (0..96).filter(|y| (0..8).all(|x| outcome(x, *y) != Outcome::Found)).count();
        assert!(
            at_border > 86,
            "{method:?}: {at_border} rows have no answer where the right eye sees nothing"
        );
        for (disparity, outcome) in map.disparity_px.iter().zip(&map.outcome) {
            assert_eq!(disparity.is_finite(), *outcome == Outcome::Found);
        }
    }
}

#[test]
fn what_repeats_along_the_row_is_not_unique() {
    let wave = |x: u32| Luma([0.5 + 0.3 * (std::f32::consts::TAU * x as f32 / 9.0).sin()]);
    let image = GrayImage::from_fn(160, 60, |x, _| wave(x));
    let method = StereoMethod::BlockMatching;
    let settings = StereoSettings { method, disparity_count: 32, ..StereoSettings::default() };
    let map = disparities([&image, &image], &settings).unwrap();
    let inside = (0..160 * 60).filter(|at| (40..150).contains(&(at % 160)));
    assert!(
        inside.clone().all(|at| map.outcome[at] == Outcome::NotUnique),
        "{:?}",
        map.outcome[30 * 160 + 80]
    );
    // With a range of less than one period it is unique.
    let map = disparities([&image, &image], &StereoSettings { disparity_count: 8, ..settings }).unwrap();
    assert!(inside.into_iter().all(|at| map.disparity_px[at] == 0.0));
}

#[test]
fn a_surface_behind_an_edge_is_left_out_where_the_right_eye_cannot_see_it() {
    // A board at 24 px in front of a wall at 8 px: 16 columns to its left are occluded in the right image.
    let wall = |x: u32, y: u32| texture(f64::from(x), f64::from(y));
    let board = |x: u32, y: u32| texture(f64::from(x) + 777.0, f64::from(y) - 345.0);
    let left = GrayImage::from_fn(240, 80, |x, y| Luma([if x >= 120 { board(x, y) } else { wall(x, y) }]));
    let right = GrayImage::from_fn(240, 80, |x, y| {
        Luma([if x + 24 >= 120 { board(x + 24, y) } else { wall(x + 8, y) }])
    });
    let settings = StereoSettings { disparity_count: 48, ..StereoSettings::default() };
    let map = disparities([&left, &right], &settings).unwrap();
    let hidden = (0..80 * 240).filter(|at| (106..118).contains(&(at % 240)));
    let answered = hidden.filter(|at| map.outcome[*at] == Outcome::Found).count();
    assert!(answered < 80 * 12 / 5, "{answered} of {}", 80 * 12);
    for (columns, expected) in [(30..100, 8.0), (130..230, 24.0)] {
        let right = (0..80 * 240).filter(|at| columns.contains(&(at % 240)));
        let good = right.filter(|at| (map.disparity_px[*at] - expected).abs() < 0.3).count();
        assert!(good as f64 > 0.97 * (80 * columns.len()) as f64, "{good}");
    }
}

#[test]
fn patches_are_kept_from_their_least_size_on() {
    let mut map = vec![f32::NAN; 12 * 8];
    // A ring of 12 pixels, a bar of 5 that touches it by a corner only, and a step of 2 px inside a bar of 6.
    for (x, y) in (1..5).flat_map(|x| [(x, 1), (x, 4)]).chain([(1, 2), (1, 3), (4, 2), (4, 3)]) {
        map[y * 12 + x] = 7.0;
    }
    for y in 2..7 {
        map[y * 12 + 7] = 7.4;
    }
    for x in 5..11 {
        map[7 * 12 + x] = if x < 8 { 3.0 } else { 5.0 };
    }
    let small =
        |least| -> usize { speckle::small_patches(&map, 12, least, 1.0).into_iter().map(|r| r.len()).sum() };
    assert_eq!([small(3), small(4), small(5), small(6), small(12), small(13)], [0, 6, 6, 11, 11, 23]);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let [left, right] = pair([150, 300], |x, y| 9.3 + 0.031 * x + 0.017 * y);
    for method in [StereoMethod::SemiGlobal, StereoMethod::BlockMatching] {
        let settings = StereoSettings { method, disparity_count: 48, ..StereoSettings::default() };
        let bits = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let map = pool.install(|| disparities([&left, &right], &settings)).unwrap();
            map.disparity_px.iter().map(|disparity| disparity.to_bits()).collect::<Vec<_>>()
        };
        let one = bits(1);
        assert!(bits(2) == one && bits(3) == one, "{method:?}");
    }
}

#[test]
fn settings_and_images_that_cannot_be_used_are_refused() {
    let image = GrayImage::from_pixel(20, 20, Luma([0.5]));
    let usable = StereoSettings { disparity_count: 8, ..StereoSettings::default() };
    let refused =
        |settings: StereoSettings| disparities([&image, &image], &settings).unwrap_err().to_string();
    assert!(refused(StereoSettings { window_px: 8, ..usable.clone() }).contains("window_px"));
    assert!(refused(StereoSettings { large_step: 200, ..usable.clone() }).contains("large_step"));
    assert!(refused(StereoSettings { disparity_count: 600, ..usable.clone() }).contains("disparity_count"));
    let other = GrayImage::from_pixel(20, 21, Luma([0.5]));
    assert!(disparities([&image, &other], &usable).is_err());
    // Smaller than a window, a block and the reach of the census.
    let small = GrayImage::from_fn(3, 2, |x, y| Luma([hash(x, y)]));
    for method in [StereoMethod::SemiGlobal, StereoMethod::BlockMatching] {
        let map = disparities([&small, &small], &plain(method, 0, 8)).unwrap();
        assert_eq!(map.disparity_px.len(), 6);
    }
}

#[test]
fn cancelled_matching_returns_no_disparities() {
    let [left, right] = pair([75, 33], |_, _| 6.0);
    let cancelled = std::sync::atomic::AtomicBool::new(true);
    for method in [StereoMethod::SemiGlobal, StereoMethod::BlockMatching] {
        let settings = plain(method, 0, 20);
        let found = disparities_until([&left, &right], &settings, Cancel::from(&cancelled));
        assert!(matches!(found, Err(Error::Cancelled)), "{method:?}");
        let mut rows = 0;
        let scene = Scene::new(&left, &right, &settings, Cancel::from(&cancelled));
        match method {
            StereoMethod::SemiGlobal => semi_global::match_rows::<1>(&scene, |_, _| rows += 1),
            StereoMethod::BlockMatching => {
                let mut band = block_matching::Band::new(&scene);
                block_matching::match_rows::<1>(&scene, &mut band, 0..33, |_, _| rows += 1);
            }
        }
        assert_eq!(rows, 0, "{method:?}");
    }
}
