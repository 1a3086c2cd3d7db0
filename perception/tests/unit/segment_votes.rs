//! Tests of `segment::votes`.

use descry_perception::segment::votes::*;
use proptest::prelude::*;
use std::collections::BTreeMap;

proptest! {
    #[test]
    fn peaks_are_those_of_a_map(
        votes in prop::collection::vec((-3..30_i32, 40..60_i32, -2..3_i32, -2..3_i32), 1..100)
    ) {
        let mut map: BTreeMap<[i32; 3], u32> = BTreeMap::new();
        let none = || Votes::over([-3, 40], [29, 59]);
        let (mut counted, mut others) = (none(), none());
        // Each a line of cells; what would leave those that are named stays at their edge.
        let line = |&(x, y, i, j): &(i32, i32, i32, i32)| -> [[i32; 2]; RADII] {
            std::array::from_fn(|k| [(x + i * k as i32).clamp(-3, 29), (y + j * k as i32).clamp(40, 59)])
        };
        for (n, cells) in votes.iter().map(line).enumerate() {
            (0..).zip(cells).for_each(|(k, [x, y])| *map.entry([x, y, k]).or_default() += 1);
            let some = if n % 2 == 0 { &mut counted } else { &mut others };
            some.add(&cells);
        }
        counted.join(&others);
        for cells in votes.iter().step_by(3).map(line) {
            (0..).zip(cells).for_each(|(k, [x, y])| *map.entry([x, y, k]).or_default() -= 1);
            counted.take_back(&cells);
        }
        let near = |a: &[i32; 3], b: &[i32; 3]| (0..3).all(|i| (a[i] - b[i]).abs() <= 1);
        let around = |cell| map.iter().filter(|(other, _)| near(cell, other)).map(|(_, n)| *n).sum::<u32>();
        let peaks = map.iter().filter(|(_, n)| **n > 1).map(|(cell, _)| (around(cell), *cell));
        let mut expected: Vec<_> = peaks.filter(|(n, _)| *n >= 5).collect();
        let mut found = counted.peaks(1, 5);
        expected.sort_unstable();
        found.sort_unstable();
        prop_assert_eq!(found, expected);
    }
}
