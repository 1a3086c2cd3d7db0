//! Deterministic pseudo-random numbers (SplitMix64: Steele, Lea, Flood 2014), equal on every
//! machine and in every version.

/// Deterministic pseudo-random generator, fixed by its seed.
#[derive(Clone, Debug)]
pub struct Draws(u64);

impl Draws {
    pub fn new(seed: u64) -> Draws {
        Draws(seed)
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let a = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let b = (a ^ (a >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        b ^ (b >> 31)
    }

    /// Uniform whole number below `end` (Lemire's multiplication; the bias of `end / 2^64` is
    /// negligible).
    pub(crate) fn below(&mut self, end: usize) -> usize {
        ((u128::from(self.next()) * end as u128) >> 64) as usize
    }

    /// `N` distinct numbers below `end`; `None` if `end` is smaller than `N`.
    pub(crate) fn distinct<const N: usize>(&mut self, end: usize) -> Option<[usize; N]> {
        if end < N {
            return None;
        }
        let mut drawn = [usize::MAX; N];
        for i in 0..N {
            loop {
                let candidate = self.below(end);
                if !drawn[..i].contains(&candidate) {
                    drawn[i] = candidate;
                    break;
                }
            }
        }
        Some(drawn)
    }

    /// Numbers below `end` in random order (Fisher and Yates).
    pub(crate) fn order(&mut self, end: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..end as u32).collect();
        for i in (1..end).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}
