//! Tests of `walls`.

use std::collections::BTreeSet;

use descry_domains::walls::*;
use descry_robots::nalgebra::{Point2, Vector2};
use descry_robots::{Door, Room};

fn room(name: &str, west: f64, south: f64) -> Room {
    let corners = [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0), (0.0, 4.0)];
    Room { name: name.into(), outline_m: corners.map(|(x, y)| Point2::new(west + x, south + y)).to_vec() }
}

fn door(name: String, x: f64, y: f64, along_rad: f64) -> Door {
    Door {
        name,
        centre_m: Point2::new(x, y),
        along_rad,
        width_m: 0.9,
        between: ["kitchen".into(), "study".into()],
    }
}

/// Checks the line of sight between two rooms beside each other, with a door in the wall of 10 cm between
/// them.
fn check(from: (f64, f64), to: (f64, f64), open: bool, hidden: bool) {
    let doors = [door("door".into(), 3.05, 1.0, std::f64::consts::FRAC_PI_2)];
    let walls = Walls::new(&[room("kitchen", 0.0, 0.0), room("study", 3.1, 0.0)], &doors);
    let shut: BTreeSet<usize> = (!open).then_some(0).into_iter().collect();
    let [from, to] = [from, to].map(|(x, y)| Point2::new(x, y));
    assert_eq!(walls.stand_between(&shut, &from, &to), hidden, "{from} to {to}, door open: {open}");
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

/// True if any wall of any room stands in the way: each is asked.
fn stands_between(rooms: &[Room], open: &[&Door], from: &Point2<f64>, to: &Point2<f64>) -> bool {
    let far = (to - from).norm() - 0.05;
    let ahead = (to - from).normalize();
    let leads_through = |door: &Door, at: &Point2<f64>| {
        let along = Vector2::new(door.along_rad.cos(), door.along_rad.sin());
        let aside = at - door.centre_m;
        aside.dot(&along).abs() <= door.width_m / 2.0 && aside.perp(&along).abs() <= 0.3
    };
    let sides = rooms.iter().flat_map(|r| (0..4).map(|n| (r.outline_m[n], r.outline_m[(n + 1) % 4])));
    sides.into_iter().any(|(a, b)| {
        let (side, out) = (b - a, a - from);
        let turn = ahead.perp(&side);
        let (along, share) = (out.perp(&side) / turn, out.perp(&ahead) / turn);
        let is_met = turn != 0.0 && (0.0..=1.0).contains(&share) && (0.0..far).contains(&along);
        is_met && !open.iter().any(|door| leads_through(door, &(from + ahead * along)))
    })
}

#[test]
fn walls_found_by_place_are_those_that_stand_in_the_way() {
    // Multiples of square roots of primes fill the interval from zero to one evenly.
    let spread = |n: u32, prime: f64| (f64::from(n) * prime.sqrt()).fract();
    let places = (0..8).flat_map(|x| (0..4).map(move |y| (f64::from(x) * 3.1, f64::from(y) * 4.1)));
    let rooms: Vec<Room> = places.clone().map(|(x, y)| room("room", x, y)).collect();
    let upright = std::f64::consts::FRAC_PI_2;
    let doors: Vec<Door> =
        places.enumerate().map(|(n, (x, y))| door(format!("door {n}"), x + 3.05, y + 1.5, upright)).collect();
    let walls = Walls::new(&rooms, &doors);
    let shut: BTreeSet<usize> = (0..doors.len()).filter(|n| n % 3 == 0).collect();
    let open: Vec<&Door> = (0..doors.len()).filter(|n| n % 3 != 0).map(|n| &doors[n]).collect();
    let mut seen = [0, 0];
    for n in 1..20_000 {
        let from = Point2::new(27.0 * spread(n, 2.0) - 1.0, 18.0 * spread(n, 3.0) - 1.0);
        let aim = Vector2::new(2.0 * spread(n, 5.0) - 1.0, 2.0 * spread(n, 7.0) - 1.0);
        let to = from + aim * (0.1 + 8.0 * spread(n, 11.0));
        let expected = stands_between(&rooms, &open, &from, &to);
        seen[usize::from(expected)] += 1;
        assert_eq!(walls.stand_between(&shut, &from, &to), expected, "{from} to {to}");
    }
    assert!(seen.iter().all(|&n| n > 2_000), "{seen:?}");
}
