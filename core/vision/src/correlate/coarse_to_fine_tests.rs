//! The coarse-to-fine search compared with the exhaustive one.

use image::Luma;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::*;
use crate::correlate::sdog::Sdog;
use crate::image::sample::Kernel;

const DESCENT: Descent = Descent { levels: 2, candidates: 5, reach_px: 2 };

/// Noise smoothed to detail of about six pixels, with detector noise.
fn rough(seed: u64, width: u32, height: u32) -> GrayImage {
    let mut random = Pcg64::seed_from_u64(seed);
    let white = GrayImage::from_fn(width, height, |_, _| Luma([random.random::<f32>()]));
    let mut image = patch::blurred(&white, 2.0);
    image.iter_mut().for_each(|v| *v = 0.5 + (*v - 0.5) * 3.0 + 0.01 * (random.random::<f32>() - 0.5));
    image
}

/// The image moved by a fraction of a pixel and slightly magnified.
fn moved(image: &GrayImage) -> GrayImage {
    GrayImage::from_fn(image.width(), image.height(), |x, y| {
        let at = Pixel::new((f64::from(x) - 3.3) / 1.02, (f64::from(y) + 2.4) / 1.02);
        Luma([Kernel::Bicubic.sample(image, at).unwrap_or(0.5)])
    })
}

fn search(seed: u64, similarity: &Similarity, region: PixelRect) -> Comparison {
    let image = rough(seed, 220, 200);
    let margin = DESCENT.margin_px(similarity, 21);
    let wide = patch::extract(&moved(&image), Pixel::new(101.0, 93.0), 10 + margin, Kernel::Bicubic);
    compare(similarity, &wide, 21, &image, region, &DESCENT).unwrap()
}

#[test]
fn the_same_pixel_is_found_as_by_the_exhaustive_search_with_a_tenth_of_the_comparisons() {
    for seed in 0..20 {
        let found = search(seed, &Similarity::Ncc, PixelRect::new(25, 31, 143, 141));
        assert!(found.is_same, "seed {seed}: {:?} {:?}", found.exhaustive, found.coarse_to_fine);
        assert!(found.exhaustive.pixel.distance(found.coarse_to_fine.pixel) < 1e-3, "seed {seed}");
        assert!((found.exhaustive.score - found.coarse_to_fine.score).abs() < 1e-4);
        assert!(found.search.comparisons * 10 < found.exhaustive_comparisons, "{}", found.search.comparisons);
        assert!(found.search.candidates.len() == 5 && found.search.factor == 4);
    }
}

#[test]
fn every_measure_descends() {
    let sdog = Similarity::Sdog(Sdog { sigma_px: 1.5, ratio: 1.6 });
    for similarity in [Similarity::Sad, Similarity::Ssd, sdog] {
        let found = search(3, &similarity, PixelRect::new(25, 31, 143, 141));
        assert!(found.is_same, "{similarity:?}: {:?} {:?}", found.exhaustive, found.coarse_to_fine);
    }
}

#[test]
fn a_region_that_begins_anywhere_and_ends_at_the_border_is_searched_whole() {
    for (x, y) in [(37, 40), (38, 41), (39, 42), (40, 43)] {
        let found = search(5, &Similarity::Ncc, PixelRect::new(x, y, 400, 400));
        assert!(found.is_same, "({x}, {y}): {:?} {:?}", found.exhaustive, found.coarse_to_fine);
    }
}

#[test]
fn positions_that_were_not_visited_have_no_score() {
    let image = rough(1, 160, 150);
    let wide = patch::extract(&image, Pixel::new(80.0, 70.0), 30, Kernel::Bicubic);
    let all = PixelRect::whole(160, 150);
    let (surface, search) = coarse_to_fine(&Similarity::Ncc, &wide, 21, &image, all, &DESCENT).unwrap();
    let visited = surface.valid_positions();
    assert!((25..=6 * 25).contains(&visited), "{visited}");
    assert!((surface.maximum().unwrap().2 - 1.0).abs() < 1e-5);
    let coarse = search.coarse.as_ref().unwrap();
    assert_eq!((coarse.width, coarse.template_size), (36, 5));
}
