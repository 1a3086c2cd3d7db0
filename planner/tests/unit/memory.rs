//! Tests of `memory`.

use descry_planner::memory::{Heap, MemoryLimit, Rows};

#[test]
fn rows_are_found_again_in_every_piece() {
    for width in [0, 1, 3, 70_000] {
        let mut rows = Rows::<u64>::new(width);
        let count = if width > 1000 { 9 } else { 300_000 };
        for row in 0..count {
            rows.push_row(&vec![row as u64; width]);
        }
        assert_eq!(rows.len(), count);
        assert!((0..count).all(|row| rows.row(row).iter().all(|&item| item == row as u64)), "{width}");
        assert!(rows.bytes() <= count * width * 8 + (2 << 20), "{width}: {}", rows.bytes());
    }
}

#[test]
fn a_heap_gives_the_least_first() {
    let mut heap = Heap::default();
    let mixed = |n: u64| (n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40, n);
    (0..200_000).for_each(|n| heap.push(mixed(n)));
    let mut expected: Vec<_> = (0..200_000).map(mixed).collect();
    expected.sort_unstable();
    assert!(expected.iter().all(|&item| heap.pop() == Some(item)));
    assert!(heap.pop().is_none() && heap.is_empty());
}

#[test]
fn a_limit_asks_the_process_where_it_can() {
    let counted = MemoryLimit::new(Some(3200), None);
    assert!(counted.has_room(|| 3000, 100) && !counted.has_room(|| 3000, 101));
    assert!(!counted.beside(1).has_room(|| 3000, 100));
    let told = MemoryLimit::new(Some(3200), Some(|| 1000));
    assert!(told.beside(3000).has_room(|| 9000, 2100) && !told.has_room(|| 0, 2101));
    assert!(MemoryLimit::new(None, Some(|| 1000)).has_room(|| 0, usize::MAX / 2));
}
