//! Tests of `walls`.

use descry_domains::walls::*;
use descry_robots::nalgebra::Point2;
use descry_robots::{Door, Room};

/// Checks the line of sight between two rooms beside each other, with a door in the wall of 10 cm between
/// them.
fn check(from: (f64, f64), to: (f64, f64), open: bool, hidden: bool) {
    let room = |name: &str, west: f64| Room {
        name: name.into(),
        outline_m: [(west, 0.0), (west + 3.0, 0.0), (west + 3.0, 4.0), (west, 4.0)]
            .map(|(x, y)| Point2::new(x, y))
            .to_vec(),
    };
    let door = Door {
        name: "door".into(),
        centre_m: Point2::new(3.05, 1.0),
        along_rad: std::f64::consts::FRAC_PI_2,
        width_m: 0.9,
        between: ["kitchen".into(), "study".into()],
    };
    let doors = open.then_some(&door).into_iter();
    let [from, to] = [from, to].map(|(x, y)| Point2::new(x, y));
    let rooms = [room("kitchen", 0.0), room("study", 3.1)];
    assert_eq!(crosses_a_wall(&rooms, doors, &from, &to), hidden, "{from} to {to}, door open: {open}");
}

#[test]
fn one_sees_into_the_next_room_through_an_open_door_only() {
    check((1.0, 1.0), (2.9, 3.5), false, false);
    check((1.0, 1.0), (5.0, 1.1), true, false);
    check((1.0, 1.0), (5.0, 1.1), false, true);
    check((1.0, 1.0), (5.0, 3.9), true, true);
    // What lies at the wall's foot stands before it.
    check((1.0, 1.0), (3.0, 3.0), false, false);
    check((2.9, 1.0), (1.0, 1.0), false, false);
}
