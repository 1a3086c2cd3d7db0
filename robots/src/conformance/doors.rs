//! Conformance of bodies with doors in their map.

use super::{Breach, done, ensure, places};
use crate::body::{CancellationToken, Place, Pose2, Robot, Watch};
use crate::failure::Failure;
use nalgebra::Vector2;

/// Distance of the base from the middle of a door from which the test opens the door, metres.
const BEFORE_M: f64 = 0.7;
/// Maximum number of tries to open a door, since the hand may slip.
const TRIES: usize = 8;

pub(super) async fn check_doors(robot: &dyn Robot) -> Result<(), Breach> {
    let answer = robot.open_door("there is no door of this name", &Watch::default()).await;
    ensure(
        matches!(answer, Err(Failure::Unreachable { .. } | Failure::Unable { .. })),
        "a door that is none cannot be opened",
        || format!("{answer:?}"),
    )?;
    check_map(robot)?;
    check_shut_routes(robot).await?;
    check_opening(robot).await
}

fn check_map(robot: &dyn Robot) -> Result<(), Breach> {
    let rooms = robot.rooms();
    for (i, room) in rooms.iter().enumerate() {
        let double = rooms[..i].iter().any(|other| other.name == room.name);
        ensure(!double, "rooms have names of their own", || format!("two are called \"{}\"", room.name))?;
        ensure(room.outline_m.len() >= 3, "a room has an outline", || room.name.clone())?;
    }
    let known = |name: &String| rooms.iter().any(|r| &r.name == name);
    for surface in robot.surfaces() {
        ensure(surface.room.as_ref().is_none_or(known), "a surface is in a room of the map", || {
            format!("{surface:?}")
        })?;
    }
    let doors = robot.doors();
    for (i, door) in doors.iter().enumerate() {
        let double = doors[..i].iter().any(|other| other.name == door.name);
        ensure(!double, "doors have names of their own", || format!("two are called \"{}\"", door.name))?;
        ensure(door.width_m.is_finite() && door.width_m > 0.0, "a door has a width", || format!("{door:?}"))?;
        ensure(door.between.iter().all(known), "a door is between rooms of the map", || format!("{door:?}"))?;
    }
    Ok(())
}

/// Checks that shut doors make no route shorter.
async fn check_shut_routes(robot: &dyn Robot) -> Result<(), Breach> {
    let here = done(robot.pose().await, "a body knows where it is")?.place();
    let to = places(robot);
    let open = robot.travel(&here, &to, &[]);
    let names: Vec<String> = robot.doors().iter().map(|d| d.name.clone()).collect();
    let shut = robot.travel(&here, &to, &names);
    for (place, (open, shut)) in to.iter().zip(open.iter().zip(&shut)) {
        let longer = match (open, shut) {
            (Ok(open), Ok(shut)) => shut.duration_s >= open.duration_s - 0.05 * open.duration_s,
            (Err(_), Ok(_)) => false,
            (_, Err(_)) => true,
        };
        ensure(longer, "no way is shorter because doors are shut", || {
            format!("{place}: {open:?} open, {shut:?} shut")
        })?;
    }
    Ok(())
}

async fn check_opening(robot: &dyn Robot) -> Result<(), Breach> {
    let here = done(robot.pose().await, "a body knows where it is")?.place();
    let stands = robot.doors().iter().flat_map(|door| {
        let across = Vector2::new(-door.along_rad.sin(), door.along_rad.cos()) * BEFORE_M;
        [-1.0, 1.0].map(|side| {
            let at = door.centre_m + across * side;
            (door.name.clone(), Place::Pose(Pose2::facing(at.x, at.y, &door.centre_m)))
        })
    });
    let near = stands
        .into_iter()
        .find(|(_, place)| robot.travel(&here, std::slice::from_ref(place), &[]).iter().all(Result::is_ok));
    let Some((door, place)) = near else { return Ok(()) };
    let watch = Watch::default();
    done(robot.drive_to(&place, &watch).await, "a body drives where a route leads")?;
    for _ in 0..TRIES {
        let before_ns = robot.now_ns();
        match robot.open_door(&door, &watch).await {
            Err(Failure::Unable { .. }) => return Ok(()),
            Err(Failure::Slipped { .. }) => {}
            Err(other) => {
                let promise = "a body before a door opens it, slips, or says that it opens none";
                return Err(Breach { promise, found: other.to_string() });
            }
            Ok(opened) => {
                let passed_s = (robot.now_ns() - before_ns) as f64 * 1e-9;
                let as_said = (passed_s - opened.duration_s).abs() < 0.01;
                ensure(as_said, "opening takes the time that it says", || {
                    format!("{passed_s} s, {opened:?}")
                })?;
                return check_stops(robot, &door).await;
            }
        }
    }
    Err(Breach { promise: "a hand slips now and then, not always", found: format!("off \"{door}\"") })
}

async fn check_stops(robot: &dyn Robot, door: &str) -> Result<(), Breach> {
    let cancel = CancellationToken::new();
    cancel.cancel();
    let answer = robot.open_door(door, &Watch { cancel, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::Cancelled { .. })), "opening a door can be stopped", || {
        format!("{answer:?}")
    })?;
    let answer = robot.open_door(door, &Watch { time_limit_s: 0.01, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::TimedOut { .. })), "opening a door has a limit", || {
        format!("{answer:?}")
    })
}
