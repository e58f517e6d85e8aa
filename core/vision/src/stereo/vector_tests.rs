//! Code with instructions for one vector width gives the same result with every width: the processor's, half of it, and
//! scalar.

use pulp::{Arch, Scalar, Simd, WithSimd};

use super::lanes::{Block, LANES, at_most, least_u8, least_u16, moved_down, moved_up};
use super::row::Pixel;
use super::winner::{rival_share, winner};

/// Runs the same work with vectors of every width that the processor has.
fn with_every_width<W: WithSimd + Copy>(work: W) -> Vec<W::Output> {
    let mut found = vec![Arch::new().dispatch(work), work.with_simd(Scalar)];
    #[cfg(target_arch = "x86_64")]
    found.extend(pulp::x86::V3::try_new().map(|narrow| Simd::vectorize(narrow, work)));
    found
}

/// Pseudo-random numbers.
fn number(k: usize) -> u16 {
    ((k as u32 + 1).wrapping_mul(0x9E37_79B1) >> 13) as u16
}

#[derive(Clone, Copy)]
struct Helpers<'a>(&'a [Block<u8>; 2], &'a Block<u16>, u16);

impl WithSimd for Helpers<'_> {
    type Output = ([Block<u8>; 2], u64, [u16; 2]);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self([a, b], words, limit) = self;
        let moved = [moved_up(simd, a, b), moved_down(simd, a, b)];
        let least = [u16::from(least_u8(simd, a)), least_u16(simd, words)];
        (moved, at_most(simd, words, limit), least)
    }
}

#[test]
fn bytes_move_by_one_and_the_least_and_the_low_are_found() {
    for turn in 0..50 {
        let bytes: [u8; 2 * LANES] = std::array::from_fn(|k| number(k + 1000 * turn) as u8);
        let words: Block<u16> = std::array::from_fn(|k| number(k + 777 * turn));
        let limit = words[turn];
        let up: Block<u8> = std::array::from_fn(|k| bytes[LANES - 1 + k]);
        let down: Block<u8> = std::array::from_fn(|k| bytes[1 + k]);
        let bits = (0..LANES).map(|k| u64::from(words[k] <= limit) << k).sum::<u64>();
        let least = [bytes[..LANES].iter().min().map(|least| u16::from(*least)), words.iter().min().copied()];
        for found in with_every_width(Helpers(&bytemuck::cast(bytes), &words, limit)) {
            assert_eq!(found.0, [up, down]);
            assert_eq!((found.1, found.2.map(Some)), (bits, least));
        }
    }
}

#[derive(Clone, Copy)]
struct Winning<'a>(&'a [Block<u16>; 2], u64);

impl WithSimd for Winning<'_> {
    type Output = Pixel;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Pixel {
        winner(simd, self.0, self.1)
    }
}

#[test]
fn a_winner_is_unique_where_all_but_its_neighbours_cost_more_by_the_share_that_is_asked_for() {
    let share = rival_share(0.05);
    for at in [0, 1, 31, 32, 63, 64, 65, 126, 127_usize] {
        // 1000 / 0.95 is 1052.6: sums from 1053 on are no rivals; neighbours never are, and of equal sums the first one
        // wins.
        for (rival, is_unique) in [(1000, false), (1052, false), (1053, true)] {
            for rival_at in (0..128_usize).filter(|rival_at| rival_at.abs_diff(at) > 1) {
                let mut cells = [2000_u16; 128];
                let beside = [at.wrapping_sub(1), at + 1];
                beside.into_iter().filter(|at| *at < 128).for_each(|beside| cells[beside] = 1001);
                cells[at] = 1000;
                cells[rival_at] = if rival_at < at { rival.max(1001) } else { rival };
                for pixel in with_every_width(Winning(&bytemuck::cast(cells), share)) {
                    assert_eq!(
                        (pixel.index(), pixel.is_unique()),
                        (at, is_unique),
                        "{at} {rival_at} {rival}"
                    );
                    let has_both = (1..127).contains(&at);
                    assert_eq!(pixel.three(), has_both.then_some([1001, 1000, 1001]));
                }
            }
        }
    }
}
