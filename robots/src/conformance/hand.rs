//! Conformance of the hand; bodies without a hand must say so.

use super::{Breach, done, ensure};
use crate::body::{CancellationToken, Grasp, Place, Placing, Pouring, Robot, Watch};
use crate::failure::Failure;
use crate::parts::Gripper;
use crate::request::{Answer, Request};
use nalgebra::Point3;

/// Maximum number of tries to grasp, since the hand may slip.
const TRIES: usize = 8;
/// Point without anything to grasp, in the base frame, metres.
const THIN_AIR: [f64; 3] = [0.5, 0.0, 1.9];

/// Checks the hand, which must be empty at the start; it is empty again at the end.
pub(super) async fn check_hand(robot: &dyn Robot) -> Result<(), Breach> {
    let watch = Watch::default();
    let estimate = done(robot.pose().await, "a body knows where it is")?;
    let in_air = estimate.map_from_base * Point3::from(THIN_AIR);
    let placing = Placing { foot: in_air };
    let answer = robot.place(&placing, &watch).await;
    ensure(
        matches!(answer, Err(Failure::Unable { .. })),
        "an empty hand, or none, puts nothing down",
        || format!("{answer:?}"),
    )?;
    let (answer, _) = Request::Pour(Pouring { over: in_air }).ask(robot, &watch).await;
    ensure(
        matches!(answer, Answer::Failed(Failure::Unable { .. })),
        "an empty hand, or none, pours nothing",
        || format!("{answer:?}"),
    )?;
    let Some(Gripper { opening_m }) = robot.description().hand().copied() else { return Ok(()) };
    ensure(opening_m.is_finite() && opening_m > 0.0, "a hand opens", || format!("{opening_m} m"))?;
    feels(robot, false).await?;
    let grasp = |object, width_m| Grasp { object, width_m };
    let answer = robot.grasp(&grasp(in_air, 2.0 * opening_m), &watch).await;
    ensure(
        matches!(answer, Err(Failure::Unable { .. })),
        "what is wider than the hand opens is not grasped",
        || format!("{answer:?}"),
    )?;
    for far in [Point3::new(1e6, 0.0, 1.0), Point3::new(f64::NAN, 0.0, 1.0)] {
        let answer = robot.grasp(&grasp(far, 0.5 * opening_m), &watch).await;
        ensure(
            matches!(answer, Err(Failure::Unreachable { .. })),
            "what is out of reach is not grasped",
            || format!("{far}: {answer:?}"),
        )?;
    }
    let cancel = CancellationToken::new();
    cancel.cancel();
    let air = grasp(in_air, 0.5 * opening_m);
    let answer = robot.grasp(&air, &Watch { cancel, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::Cancelled { .. })), "a grasp can be stopped", || {
        format!("{answer:?}")
    })?;
    let answer = robot.grasp(&air, &Watch { time_limit_s: 0.01, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::TimedOut { .. })), "a grasp has a limit", || format!("{answer:?}"))?;
    let answer = robot.grasp(&air, &watch).await;
    ensure(matches!(answer, Err(Failure::Slipped { .. })), "a hand that closes on nothing says so", || {
        format!("{answer:?}")
    })?;
    feels(robot, false).await
}

async fn feels(robot: &dyn Robot, holds: bool) -> Result<(), Breach> {
    let hand = done(robot.hand().await, "a hand feels")?;
    ensure(hand.holds == holds, "a hand feels whether it holds something", || format!("{hand:?}"))
}

/// Runs the checks that need an object: at `stand`, the body must be able to carry out `grasp` and then
/// `placing`.
///
/// # Errors
/// The first violated promise, with the observation.
pub async fn check_carrying(
    robot: &dyn Robot,
    stand: &Place,
    grasp: &Grasp,
    placing: &Placing,
) -> Result<(), Breach> {
    let watch = Watch::default();
    done(robot.drive_to(stand, &watch).await, "a body drives where a route leads")?;
    feels(robot, false).await?;
    let mut held = None;
    for _ in 0..TRIES {
        let before_ns = robot.now_ns();
        match robot.grasp(grasp, &watch).await {
            Err(Failure::Slipped { .. }) => feels(robot, false).await?,
            answer => {
                let grasped = done(answer, "a hand takes what stands in reach, or slips")?;
                let passed_s = (robot.now_ns() - before_ns) as f64 * 1e-9;
                let as_said = (passed_s - grasped.duration_s).abs() < 0.01;
                ensure(as_said, "a grasp takes the time that it says", || {
                    format!("{passed_s} s, {grasped:?}")
                })?;
                held = Some(grasped);
                break;
            }
        }
    }
    let Some(grasped) = held else {
        return Err(Breach { promise: "a hand slips now and then, not always", found: "it does".into() });
    };
    let opening_m = robot.description().hand().map_or(0.0, |hand| hand.opening_m);
    ensure(grasped.width_m > 0.0 && grasped.width_m <= opening_m, "a hand is as wide as it can be", || {
        format!("{grasped:?}")
    })?;
    feels(robot, true).await?;
    let answer = robot.grasp(grasp, &watch).await;
    ensure(matches!(answer, Err(Failure::Unable { .. })), "a full hand grasps nothing", || {
        format!("{answer:?}")
    })?;
    let far = Placing { foot: Point3::new(1e6, 0.0, 0.7) };
    let answer = robot.place(&far, &watch).await;
    ensure(matches!(answer, Err(Failure::Unreachable { .. })), "nothing is put down out of reach", || {
        format!("{answer:?}")
    })?;
    let cancel = CancellationToken::new();
    cancel.cancel();
    let answer = robot.place(placing, &Watch { cancel, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::Cancelled { .. })), "placing can be stopped", || {
        format!("{answer:?}")
    })?;
    let answer = robot.place(placing, &Watch { time_limit_s: 0.01, ..Watch::default() }).await;
    ensure(matches!(answer, Err(Failure::TimedOut { .. })), "placing has a limit", || format!("{answer:?}"))?;
    feels(robot, true).await?;
    done(robot.place(placing, &watch).await, "a full hand puts down what it holds")?;
    feels(robot, false).await
}
