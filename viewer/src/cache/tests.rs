//! Requests, eviction and retries of the cache.

use crate::cache::*;

fn key(step: usize) -> Key {
    Key::Image { traverse: "t".to_owned(), step, side: ImageSide::Left, camera: None }
}

fn at_most(n: usize) -> impl FnMut(&Key) -> bool {
    let mut left = n;
    move |_| {
        let is_place = left > 0;
        left = left.saturating_sub(1);
        is_place
    }
}

fn raster(side: u32) -> Item {
    let values = sightline_vision::image::GrayImage::new(side, side);
    let bytes = sightline_vision::image::npy::encode(&values).unwrap();
    Item::Raster(Arc::new(Raster::from_npy(&egui::Context::default(), ArrayName::SURFACE, &bytes).unwrap()))
}

fn problem(status: u16) -> Problem {
    Problem {
        code: "x".to_owned(),
        title: String::new(),
        status,
        detail: "no".to_owned(),
        hint: None,
        nearest_pixel: None,
        received: None,
    }
}

#[test]
fn missing_items_are_requested_once_and_in_order() {
    let mut cache = Cache::default();
    assert_eq!(cache.request(&[key(3), key(4), key(5)], at_most(2), 0.0), vec![key(3), key(4)]);
    assert_eq!(cache.request(&[key(3), key(4), key(5)], at_most(2), 0.0), vec![key(5)]);
    assert!(matches!(cache.raster(&key(3)), Slot::Loading));
    cache.store(key(3), Ok(raster(2)), 0.0);
    assert!(cache.raster(&key(3)).ready().is_some());
}

#[test]
fn a_refusal_is_final_and_an_unready_item_is_retried() {
    let mut cache = Cache::default();
    cache.request(&[key(1), key(2)], |_| true, 0.0);
    cache.store(key(1), Err(problem(404)), 0.0);
    cache.store(key(2), Err(problem(503)), 0.0);
    assert!(matches!(cache.raster(&key(1)), Slot::Failed(_)));
    assert_eq!(cache.next_retry(), Some(RETRY_S));
    assert!(cache.request(&[key(1), key(2)], |_| true, 1.0).is_empty());
    assert_eq!(cache.request(&[key(1), key(2)], |_| true, 2.5), vec![key(2)]);
    cache.retry(|_| true);
    assert_eq!(cache.request(&[key(1), key(2)], |_| true, 2.5), vec![key(1)]);
}

#[test]
fn memory_keeps_its_limit_and_what_is_wanted_stays() {
    let mut cache = Cache::default();
    for step in 0..4 {
        cache.request(&[key(step)], |_| true, 0.0);
        cache.store(key(step), Ok(raster(16)), 0.0);
    }
    let one = 16 * 16 * 8;
    assert_eq!(cache.bytes(), 4 * one);
    cache.request(&[key(0), key(3)], |_| false, 0.0);
    cache.evict(2 * one);
    assert_eq!(cache.bytes(), 2 * one);
    assert!(cache.raster(&key(0)).ready().is_some() && cache.raster(&key(3)).ready().is_some());
    cache.evict(0);
    assert_eq!(cache.bytes(), 2 * one);
}

#[test]
fn an_array_comes_with_all_arrays_of_its_step() {
    let mut cache = Cache::default();
    let step = |step: usize| StepKey { session: "s1".to_owned(), target: 0, run: 0, step };
    let (all, one) = (Key::Arrays(step(1)), Key::Array(step(1), ArrayName::SURFACE));
    let other = Key::Array(step(1), ArrayName::MATCHED);
    assert_eq!(cache.request(&[all.clone(), all.clone()], |_| true, 0.0), vec![all.clone()], "once");
    assert!(cache.request(std::slice::from_ref(&one), |_| true, 0.0).is_empty(), "it comes with the others");
    assert!(matches!(cache.raster(&one), Slot::Loading));
    let arrays = [(ArrayName::SURFACE, raster(4))].into();
    cache.store(all.clone(), Ok(Item::Arrays(arrays)), 0.0);
    assert_eq!(cache.raster(&one).ready().unwrap().size(), [4, 4]);
    assert!(matches!(cache.raster(&other), Slot::Absent), "the step did not come to it");
    assert!(cache.is_settled(&one) && cache.rasters().count() == 1);
    assert_eq!(cache.bytes(), 4 * 4 * 8);
    // Wanting an array keeps the arrays that were loaded with it.
    cache.request(std::slice::from_ref(&one), |_| true, 0.0);
    cache.evict(0);
    assert!(cache.raster(&one).ready().is_some());
    cache.request(&[], |_| true, 0.0);
    cache.evict(0);
    assert!(matches!(cache.raster(&one), Slot::Absent));
    assert_eq!(cache.request(std::slice::from_ref(&one), |_| true, 0.0), vec![all], "with the others");
}
