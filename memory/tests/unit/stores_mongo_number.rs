//! Tests of `stores::mongo::number`.

use descry_memory::document::RecordId;
use descry_memory::stores::mongo::number::Name;

#[test]
fn own_numbers_are_short_and_all_are_told_apart() {
    let [a, b] = [1, 2].map(|index| Name { robot: "x".into(), index: Some(index) });
    let nobody = Name { robot: String::new(), index: Some(0) };
    for name in [&a, &b, &nobody] {
        assert_eq!(name.outward(name.inward(RecordId(7))), RecordId(7));
    }
    let seen_by_a = a.outward(b.inward(RecordId(7)));
    assert_ne!(seen_by_a, RecordId(7));
    assert_eq!(a.inward(seen_by_a), b.inward(RecordId(7)));
    assert_eq!(nobody.inward(nobody.outward(b.inward(RecordId(7)))), b.inward(RecordId(7)));
}
