//! Nearest descriptors compared with a loop over all pairs.

use super::*;

/// Pseudo-random descriptors, with mostly small elements as in those of images.
fn descriptors(count: usize, seed: u32) -> Vec<Descriptor> {
    let hash = |i: u32| {
        let h = (i ^ seed.wrapping_mul(0x9E37_79B1)).wrapping_mul(0x85EB_CA77);
        let h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h ^ (h >> 13)
    };
    let number = |i: u32| (hash(i) & 0xFF).min(hash(i + 1_000_000) & 0xFF) as u8;
    (0..count).map(|one| std::array::from_fn(|k| number((one * 128 + k) as u32))).collect()
}

/// By the definition, in 64 bits.
fn naive(
    query: &[Descriptor],
    train: &[Descriptor],
    allowed: impl Fn(usize, usize) -> bool,
) -> Vec<Option<Neighbours>> {
    let distance = |a: &Descriptor, b: &Descriptor| -> u32 {
        let sum: i64 = a.iter().zip(b).map(|(&a, &b)| (i64::from(a) - i64::from(b)).pow(2)).sum();
        sum.try_into().unwrap()
    };
    let of_one = |(q, descriptor)| {
        let mut all: Vec<(u32, u32)> = (0..train.len())
            .filter(|&t| allowed(q, t))
            .map(|t| (distance(descriptor, &train[t]), t as u32))
            .collect();
        all.sort_unstable();
        let &(distance2, nearest) = all.first()?;
        Some(Neighbours { nearest, distance2, second_distance2: all.get(1).map(|second| second.0) })
    };
    query.iter().enumerate().map(of_one).collect()
}

#[test]
fn neighbours_are_those_of_the_naive_loop_for_any_numbers_of_descriptors() {
    for (queries, trains) in
        [(1, 1), (1, 2), (2, 1), (5, 3), (7, 16), (17, 33), (64, 100), (130, 515), (3, 2100)]
    {
        let (query, train) = (descriptors(queries, 1), descriptors(trains, 2));
        let expected = naive(&query, &train, |_, _| true);
        assert_eq!(nearest(&query, &train), expected, "{queries} × {trains}");
        let odd = |q: usize, t: usize| (q + t) % 3 == 1;
        assert_eq!(nearest_where(&query, &train, odd), naive(&query, &train, odd), "{queries} × {trains}");
    }
}

#[test]
fn the_greatest_distances_are_exact() {
    let (black, white) = ([0; 128], [255; 128]);
    let mut almost = white;
    almost[77] = 254;
    let found = nearest(&[black, white], &[white, almost]);
    assert_eq!(
        found[0],
        Some(Neighbours {
            nearest: 1,
            distance2: 127 * 65_025 + 64_516,
            second_distance2: Some(128 * 65_025)
        })
    );
    assert_eq!(found[1], Some(Neighbours { nearest: 0, distance2: 0, second_distance2: Some(1) }));
}

#[test]
fn of_equal_descriptors_the_first_is_nearest() {
    let one = descriptors(1, 3)[0];
    for count in [2, 15, 16, 17, 40] {
        let found = nearest(&[one], &vec![one; count]);
        assert_eq!(found[0], Some(Neighbours { nearest: 0, distance2: 0, second_distance2: Some(0) }));
        let mut others = descriptors(count, 4);
        others.push(one);
        others.extend(descriptors(20, 5));
        others.push(one);
        let expected = Neighbours { nearest: count as u32, distance2: 0, second_distance2: Some(0) };
        assert_eq!(nearest(&[one], &others)[0], Some(expected));
    }
}

#[test]
fn empty_sets_have_no_neighbours() {
    let some = descriptors(3, 6);
    assert_eq!(nearest(&[], &some), []);
    assert_eq!(nearest(&some, &[]), [None, None, None]);
    assert_eq!(nearest_where(&some, &some, |q, _| q == 1)[0], None);
    assert!(matches(&some, &[], &MatchSettings { ratio_max: Some(0.8), mutual: true }).is_empty());
}

#[test]
fn a_single_train_descriptor_is_matched_whatever_the_ratio() {
    let (query, train) = (descriptors(2, 7), descriptors(1, 8));
    let found = matches(&query, &train, &MatchSettings { ratio_max: Some(0.1), mutual: false });
    assert_eq!(found.len(), 2);
    assert!(found.iter().all(|found| found.ratio.is_none() && found.train == 0));
}

#[test]
fn the_ratio_is_that_of_the_distances() {
    let mut train = vec![[0; 128]; 2];
    (train[0][0], train[1][0]) = (40, 150);
    let query = [[0; 128]];
    let at = |ratio_max| matches(&query, &train, &MatchSettings { ratio_max, mutual: false });
    assert_eq!(at(None), [Match { query: 0, train: 0, distance: 40.0, ratio: Some(40.0 / 150.0) }]);
    assert_eq!(at(Some(0.27)).len(), 1);
    assert!(at(Some(0.26)).is_empty());
}

#[test]
fn mutual_matches_are_each_others_nearest() {
    let (query, train) = (descriptors(50, 9), descriptors(60, 10));
    let settings = MatchSettings { ratio_max: None, mutual: true };
    let (there, back) = (nearest(&query, &train), nearest(&train, &query));
    let expected: Vec<u32> = (0..50)
        .filter(|&q| back[there[q as usize].unwrap().nearest as usize].unwrap().nearest == q)
        .collect();
    let found: Vec<u32> = matches(&query, &train, &settings).iter().map(|found| found.query).collect();
    assert!(expected.len() < 50 && !expected.is_empty());
    assert_eq!(found, expected);
    let upper = |q: usize, t: usize| t > q;
    let constrained = matches_where(&query, &train, &settings, upper);
    assert!(!constrained.is_empty() && constrained.iter().all(|found| found.train > found.query));
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let (query, train) = (descriptors(300, 11), descriptors(400, 12));
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| nearest(&query, &train))
    };
    assert_eq!(with_threads(1), with_threads(3));
}
