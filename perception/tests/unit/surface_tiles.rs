//! Tests of `surface::tiles`.

use descry_perception::surface::tiles::*;
use proptest::prelude::*;
use std::collections::BTreeMap;

proptest! {
    #[test]
    fn tiles_hold_what_a_map_holds(
        near in prop::collection::vec(prop::array::uniform2(-20..20_i32), 0..300),
        far in prop::collection::vec(prop::array::uniform2(any::<i32>()), 0..9),
    ) {
        let (mut tiles, mut map) = (Tiles::new(), BTreeMap::new());
        for cell in near.into_iter().chain(far).chain([[i32::MIN; 2], [i32::MAX; 2]]) {
            *tiles.at(cell) += 1;
            *map.entry(cell).or_default() += 1;
        }
        for cell in (-25..25).flat_map(|x| (-25..25).map(move |y| [x, y])) {
            prop_assert_eq!(tiles.get(cell), map.get(&cell).copied().unwrap_or_default());
        }
        let all: Vec<([i32; 2], u32)> = tiles.all().into_iter().filter(|(_, count)| *count > 0).collect();
        prop_assert_eq!(all, map.into_iter().collect::<Vec<_>>());
    }
}
