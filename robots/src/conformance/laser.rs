//! Conformance of the laser; bodies without a laser must say so.

use super::{Breach, ROUNDING, done, ensure, gap};
use crate::body::{CancellationToken, Pose2, Robot, Scanned, Watch};
use crate::failure::Failure;
use crate::parts::Laser;
use nalgebra::{Isometry3, Point3, Vector3};

pub(super) async fn check_scan(robot: &dyn Robot) -> Result<(), Breach> {
    let watch = Watch::default();
    let Some(laser) = &robot.description().laser else { return Ok(()) };
    check_part(laser)?;
    let before_ns = robot.now_ns();
    let scanned = done(robot.scan(&watch).await, "a body with a laser sweeps it")?;
    ensure(scanned.stamp_ns >= before_ns && scanned.stamp_ns <= robot.now_ns(), "a sweep is of now", || {
        format!("{} outside {before_ns} to {}", scanned.stamp_ns, robot.now_ns())
    })?;
    ensure(robot.now_ns() > before_ns, "a sweep takes time", || "the clock stood still".into())?;
    check_readings(laser, &scanned)?;
    check_chain(robot, laser, &scanned)?;
    let cancel = CancellationToken::new();
    cancel.cancel();
    let answer = robot.scan(&Watch { cancel, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::Cancelled { .. })), "a sweep can be stopped", || {
        format!("{:?}", answer.map(|s| s.stamp_ns))
    })
}

fn check_part(laser: &Laser) -> Result<(), Breach> {
    let above = |x: f64| x.is_finite() && x > 0.0;
    let span_rad = laser.step_rad * laser.readings.saturating_sub(1) as f64;
    let sound = laser.readings > 0 && above(laser.step_rad) && above(laser.reach_m);
    ensure(
        sound && span_rad <= std::f64::consts::TAU,
        "a laser has readings over a full turn at most, and a reach",
        || format!("{laser:?}"),
    )?;
    let up = laser.base_from_laser * Vector3::z();
    ensure(up.z > 1.0 - ROUNDING, "a laser sweeps level", || format!("it is tilted: {up:?}"))
}

fn check_readings(laser: &Laser, scanned: &Scanned) -> Result<(), Breach> {
    let scan = &scanned.scan;
    ensure(scan.check().is_ok(), "angles, ranges and pose of a sweep go together", || {
        format!("{:?}", scan.check())
    })?;
    let count = scan.angles_rad.len();
    let expected = |i: usize| laser.first_rad + laser.step_rad * i as f64;
    let off = (0..count).find(|&i| (scan.angles_rad[i] - expected(i)).abs() > ROUNDING);
    ensure(count == laser.readings && off.is_none(), "a sweep is of the described laser", || {
        format!("{count} readings of {}; the first at another angle: {off:?}", laser.readings)
    })?;
    let far = scan.ranges_m.iter().find(|r| r.is_finite() && **r > laser.reach_m + 1.0);
    ensure(far.is_none(), "what is beyond the reach is nothing within reach", || format!("{far:?} m"))
}

fn check_chain(robot: &dyn Robot, laser: &Laser, scanned: &Scanned) -> Result<(), Breach> {
    let frames = &robot.description().frames;
    let named = |t: &crate::body::StampedTransform| (t.parent.clone(), t.child.clone(), t.stamp_ns);
    let expected = [
        (frames.map.clone(), frames.base.clone(), scanned.stamp_ns),
        (frames.base.clone(), laser.frame.clone(), scanned.stamp_ns),
    ];
    let found: Vec<_> = scanned.transforms.iter().map(named).collect();
    ensure(found == expected, "a sweep comes with the chain map, base, laser of its time", || {
        format!("{found:?}")
    })?;
    let (base, mount) = (&scanned.transforms[0].parent_from_child, &scanned.transforms[1].parent_from_child);
    let off = gap(mount, &laser.base_from_laser);
    ensure(off < ROUNDING, "a laser does not move on its base", || format!("{off} off"))?;
    let pose = Pose2::from_isometry(&(base * mount));
    let told = &scanned.scan.map_from_laser;
    let level = Isometry3::new(
        Vector3::new(told.translation.x, told.translation.y, 0.0),
        Vector3::z() * told.rotation.angle(),
    );
    let off = gap(&pose.isometry(), &level);
    ensure(off < ROUNDING, "the chain multiplies to the laser's pose", || {
        format!("{off} off at {:?}", base * Point3::origin())
    })
}
