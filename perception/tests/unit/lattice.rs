//! Tests of `lattice`.

use descry_perception::lattice::*;
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

fn lattice() -> Lattice {
    Lattice::over(&Point3::new(-1.0, -0.5, 0.2), &Point3::new(0.7, 0.5, 0.9), 0.05)
}

proptest! {
    #[test]
    fn a_walk_finds_what_a_search_of_all_finds(
        places in prop::collection::vec((-1.0..0.7_f64, -0.5..0.5_f64, 0.2..0.9_f64), 1..1000)
    ) {
        let lattice = lattice();
        let voxel = |p: &(f64, f64, f64)| [p.0, p.1, p.2].map(|c| (c / 0.05).floor() as i64);
        let mut entries: Vec<(u64, u32)> = (0..).zip(&places)
            .map(|(i, p)| (lattice.key(&Vector3::new(p.0, p.1, p.2)), i))
            .collect();
        let mut expected = entries.clone();
        expected.sort();
        lattice.sort(&mut entries, &mut Vec::new());
        prop_assert_eq!(&entries, &expected);
        entries.dedup_by_key(|e| e.0);
        let keys: Vec<u64> = entries.iter().map(|e| e.0).collect();
        let first = keys.len() / 3;
        let mut around = NeighbourSweep::from(&lattice, &keys, first);
        for (key, own) in entries.iter().skip(first) {
            let own = voxel(&places[*own as usize]);
            let near = |other: &[i64; 3]| (0..3).all(|k| (own[k] - other[k]).abs() <= 1);
            let expected: Vec<usize> = entries.iter().enumerate()
                .filter(|(_, e)| near(&voxel(&places[e.1 as usize])))
                .map(|(at, _)| at)
                .collect();
            let mut found = Vec::new();
            around.visit(*key, |at| found.push(at));
            prop_assert_eq!(found, expected);
        }
    }
}

#[test]
fn a_box_beyond_all_numbers_gets_wider_voxels() {
    let far = 1e9;
    let lattice = Lattice::over(&Point3::new(-far, -far, -far), &Point3::new(far, far, far), 0.003);
    assert!(lattice.per_m < 1.0 / 0.003 && lattice.bits < 64);
}
