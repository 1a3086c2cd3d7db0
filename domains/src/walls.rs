//! Occlusion by the walls of the map: a line of sight leads from room to room through open doors only.

use descry_robots::nalgebra::{Point2, Vector2};
use descry_robots::{Door, Room};

use crate::situation::Situation;

/// Distance from the end of a line of sight within which a point stands before the wall behind it, metres.
const BEFORE_M: f64 = 0.05;
/// A wall is at most so thick, metres: the outlines of two rooms lie so far from the middle of the door between them.
const THICK_M: f64 = 0.3;

impl Situation {
    /// True if a wall of the map, or a door that is believed to be shut, stands between two places.
    pub(crate) fn is_walled_off(&self, from: &Point2<f64>, to: &Point2<f64>) -> bool {
        let is_open = |n: &usize| !self.shut.contains(n);
        let open = (0..self.doors.len()).filter(is_open).map(|n| &self.doors[n].door);
        crosses_a_wall(self.robot.rooms(), open, from, to)
    }
}

/// True if the way between two places leads through the outline of a room anywhere but at one of the doors.
pub fn crosses_a_wall<'a>(
    rooms: &[Room],
    doors: impl Iterator<Item = &'a Door> + Clone,
    from: &Point2<f64>,
    to: &Point2<f64>,
) -> bool {
    let way = to - from;
    let far = way.norm() - BEFORE_M;
    let Some(ahead) = way.try_normalize(1e-9) else { return false };
    let crossing = |a: &Point2<f64>, b: &Point2<f64>| {
        let wall = b - a;
        let turn = ahead.perp(&wall);
        let (along, share) = ((a - from).perp(&wall) / turn, (a - from).perp(&ahead) / turn);
        let is_met = turn != 0.0 && (0.0..=1.0).contains(&share) && (0.0..far).contains(&along);
        is_met.then(|| from + ahead * along)
    };
    // Most rooms lie aside of the way, and their walls need not be asked.
    let is_aside = |room: &Room| {
        let beyond = |c: usize| {
            let (low, high) = (from[c].min(to[c]), from[c].max(to[c]));
            room.outline_m.iter().all(|p| p[c] < low) || room.outline_m.iter().all(|p| p[c] > high)
        };
        beyond(0) || beyond(1)
    };
    rooms.iter().filter(|room| room.outline_m.len() >= 3 && !is_aside(room)).any(|room| {
        let corners = &room.outline_m;
        let walls = (0..corners.len()).map(|n| (&corners[n], &corners[(n + 1) % corners.len()]));
        walls
            .filter_map(|(a, b)| crossing(a, b))
            .any(|at| !doors.clone().any(|door| leads_through(door, &at)))
    })
}

fn leads_through(door: &Door, at: &Point2<f64>) -> bool {
    let along = Vector2::new(door.along_rad.cos(), door.along_rad.sin());
    let aside = at - door.centre_m;
    aside.dot(&along).abs() <= door.width_m / 2.0 && aside.perp(&along).abs() <= THICK_M
}
