//! Tests of `learning::recognition::feature`.

use descry_perception::draw::Draws;
use descry_perception::learning::recognition::feature::*;
use nalgebra::{Point3, Vector3};

/// Features that are drawn, every third near to the one before.
fn drawn(kind: DescriptorKind, count: usize, seed: u64) -> Descriptors {
    let mut draws = Draws::new(seed);
    let mut features = Descriptors::none(kind);
    let mut bytes = vec![0_u8; kind.lengths().0];
    for k in 0..count {
        for byte in &mut bytes {
            let drawn = (draws.next() >> 32) as u8;
            *byte = if k % 3 == 2 { byte.saturating_add(drawn % 5) } else { drawn / (1 + k as u8 % 4) };
        }
        features.push(Feature { at: Point3::origin(), normal: Vector3::z() }, &bytes);
    }
    features
}

#[test]
fn what_is_most_alike_is_found() {
    for kind in [DescriptorKind::Shape, DescriptorKind::Pattern] {
        let (own, mut others) = (drawn(kind, 60, 1), drawn(kind, 200, 2));
        // Three of the others are made of three of these, and alike to them.
        for (k, from) in [(7, 3), (41, 20), (120, 59)] {
            let near: Vec<u8> =
                own.descriptor(from).as_flattened().iter().map(|b| b.saturating_add(3)).collect();
            let mut made = Descriptors::none(kind);
            made.push(own.all[from], &near[..kind.lengths().0]);
            replace(&mut others, k, &made);
        }
        let off = |k: usize, m: usize| distance(others.descriptor(m), own.descriptor(k));
        let nearest = |k: usize| (0..200).map(|m| (off(k, m), m)).min().expect("there are others");
        let (found, median) = own.most_alike(&others, 5);
        assert_eq!(
            found.iter().take(3).map(|a| a.own).collect::<std::collections::BTreeSet<_>>(),
            [3, 20, 59].into()
        );
        assert!(found.iter().all(|a| nearest(a.own) == (a.off, a.other)), "{kind:?} {found:?}");
        let mut all: Vec<u32> = (0..60).map(|k| nearest(k).0).collect();
        all.sort_unstable();
        assert!((all[15]..=all[45]).contains(&median), "{kind:?} {median} {all:?}");
    }
}

/// Puts the only feature of others in the place of one.
fn replace(of: &mut Descriptors, k: usize, by: &Descriptors) {
    let (each, code) = (by.blocks.len(), by.codes.len());
    of.all[k] = by.all[0];
    of.blocks[k * each..(k + 1) * each].copy_from_slice(&by.blocks);
    of.codes[k * code..(k + 1) * code].copy_from_slice(&by.codes);
}

#[test]
fn what_is_described_alike_at_the_same_place_is_one() {
    let (mut all, more) = (drawn(DescriptorKind::Pattern, 9, 1), drawn(DescriptorKind::Pattern, 9, 2));
    all.add_new(&all.clone());
    assert_eq!(all.all.len(), 9);
    all.add_new(&more);
    assert_eq!((all.all.len(), all.descriptor(17)), (18, more.descriptor(8)));
}
