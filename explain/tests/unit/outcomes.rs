//! Tests of `outcomes`.

use descry_domains::note::OnTheFloor;
use descry_explain::outcomes::*;

#[test]
fn what_is_far_away_is_counted() {
    let things = [("this at (1.00, 2.00) m: 1 scan", false), ("thing-2 at (3.00, 1.00) m", true)]
        .map(|(text, is_far)| OnTheFloor::Thing { text: text.into(), is_far });
    assert_eq!(swept(&things), "2 things on the floor: this at (1.00, 2.00) m: 1 scan; 1 seen from afar.");
    assert_eq!(swept(&things[..1]), "1 thing on the floor: this at (1.00, 2.00) m: 1 scan.");
}
