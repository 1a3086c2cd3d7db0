//! Messages of the protocol, with their checks.

use crate::body::{Grasp, Grasped, Opened, Place, Placed, Placing, Poured, Pouring, Push, Pushed, Stamp};
use crate::failure::Failure;
use crate::request::{Answer, Request};
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Maximum time stamp of a program, nanoseconds, which leaves headroom for arithmetic.
const LATEST_NS: Stamp = 4_000_000_000_000_000_000;
/// Maximum deviation of a quaternion's length from 1.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// A request, as sent to a program in one line.
#[derive(Serialize)]
pub(super) struct Ask<'a> {
    pub id: u64,
    pub request: &'static str,
    pub with: Arguments<'a>,
    pub time_limit_s: f64,
}

/// Arguments of a request, as sent to a program.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Arguments<'a> {
    Nothing {},
    DriveTo { to: &'a Place, route_m: &'a [Point2<f64>] },
    LookAt { point_m: &'a Point3<f64> },
    Sense { sense: &'a str },
    Push(&'a Push),
    Door { door: &'a str },
    Grasp(&'a Grasp),
    Place(&'a Placing),
    Pour(&'a Pouring),
}

impl<'a> Arguments<'a> {
    /// Arguments of a request; `route_m` is the route on the map and is sent with a drive only.
    pub fn of(request: &'a Request, route_m: &'a [Point2<f64>]) -> Self {
        match request {
            Request::Pose | Request::Sense | Request::Scan | Request::Hand | Request::Wait(_) => {
                Arguments::Nothing {}
            }
            Request::DriveTo(to) => Arguments::DriveTo { to, route_m },
            Request::LookAt(point_m) => Arguments::LookAt { point_m },
            Request::Read(sense) => Arguments::Sense { sense },
            Request::PushAside(push) => Arguments::Push(push),
            Request::OpenDoor(door) => Arguments::Door { door },
            Request::Grasp(grasp) => Arguments::Grasp(grasp),
            Request::Place(placing) => Arguments::Place(placing),
            Request::Pour(pouring) => Arguments::Pour(pouring),
        }
    }
}

/// Cancellation of a request, as sent to a program.
#[derive(Serialize)]
pub(super) struct Cancel {
    pub cancel: u64,
}

/// A message of a program after its hello (the first message).
#[derive(Debug, Deserialize)]
pub(super) struct Said {
    /// Number of the request that this message is about.
    pub id: u64,
    /// Time on the body's clock, nanoseconds; never decreases.
    pub now_ns: Stamp,
    #[serde(flatten)]
    pub what: What,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum What {
    /// The request is understood and begins.
    Accepted(serde::de::IgnoredAny),
    /// The request is in progress.
    Feedback(Feedback),
    /// The request is completed; the content depends on the request.
    Done(serde_json::Value),
    /// The request failed.
    Failed(Failure),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Feedback {
    /// Completed fraction, 0 to 1.
    pub fraction: f64,
    /// Distance driven so far, metres.
    #[serde(default)]
    pub distance_m: f64,
}

impl Said {
    /// Checks what holds for every message: the clock is not before `before_ns`, and the values of feedback
    /// are in range.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn check(&self, before_ns: Stamp) -> Result<(), String> {
        if self.now_ns < before_ns || self.now_ns > LATEST_NS {
            return Err(format!("its clock went from {before_ns} to {} ns", self.now_ns));
        }
        match &self.what {
            What::Feedback(f)
                if !(0.0..=1.0).contains(&f.fraction) || !(0.0..1e9).contains(&f.distance_m) =>
            {
                Err(format!("feedback of {} done after {} m", f.fraction, f.distance_m))
            }
            _ => Ok(()),
        }
    }
}

/// Answer to `pose`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PoseSaid {
    /// Estimated pose of the base in the map.
    pub map_from_base: Isometry3<f64>,
    /// Standard deviation along each axis, metres; if left out, the value in the hello holds.
    pub sigma_m: Option<f64>,
    /// Standard deviation of the heading, radians; if left out, the value in the hello holds.
    pub sigma_rad: Option<f64>,
    /// Name of the current station, if the body has stations.
    pub station: Option<String>,
}

/// Answer to `drive_to`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DrivenSaid {
    /// Distance by odometry, metres.
    pub distance_m: f64,
    /// Estimated pose of the base in the map.
    pub map_from_base: Isometry3<f64>,
}

/// Answer to `look_at`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LookedSaid {
    /// Angle between the camera's axis and the point that remains because of the head's limits, radians.
    pub miss_rad: f64,
}

/// Answer to `sense`; the pixels follow as bytes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensedSaid {
    /// Time stamp of the frame, nanoseconds on the body's clock; the answer's `now_ns` if left out.
    pub stamp_ns: Option<Stamp>,
    /// Pose of the base in the map at that time.
    pub map_from_base: Isometry3<f64>,
    /// Pose of the camera in the base frame at that time.
    pub base_from_camera: Isometry3<f64>,
}

/// Answer to `scan`; the ranges follow as bytes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScannedSaid {
    /// Time stamp of the sweep, nanoseconds on the body's clock; the answer's `now_ns` if left out.
    pub stamp_ns: Option<Stamp>,
    /// Pose of the base in the map at that time.
    pub map_from_base: Isometry3<f64>,
}

/// Answer to `read`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReadSaid {
    /// Time stamp of the reading, nanoseconds on the body's clock; the answer's `now_ns` if left out.
    pub stamp_ns: Option<Stamp>,
    /// Measured value, any JSON.
    pub said: serde_json::Value,
}

/// Answer to `push_aside`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PushedSaid {
    /// Distance that the object was moved, metres.
    pub moved_m: f64,
}

/// Answer to `grasp`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GraspedSaid {
    /// Opening of the hand around the object, metres.
    pub width_m: f64,
}

/// Answer to `pour`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PouredSaid {
    /// Volume that went over, litres.
    pub litres: f64,
}

/// Empty answer to `open_door` and `place`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NothingSaid {}

/// Parses the answer to a request of the arm, which took `duration_s` seconds.
///
/// # Errors
/// If a part is missing or malformed, or a length is negative.
pub(super) fn manipulated(request: &Request, said: Value, duration_s: f64) -> Result<Answer, String> {
    let name = request.name();
    Ok(match request {
        Request::PushAside(_) => {
            let PushedSaid { moved_m } = answer(name, said)?;
            Answer::Pushed(Pushed { moved_m: amount("moved_m", moved_m)?, duration_s })
        }
        Request::OpenDoor(_) => {
            let NothingSaid {} = answer(name, said)?;
            Answer::Opened(Opened { duration_s })
        }
        Request::Grasp(_) => {
            let GraspedSaid { width_m } = answer(name, said)?;
            Answer::Grasped(Grasped { width_m: amount("width_m", width_m)?, duration_s })
        }
        Request::Place(_) => {
            let NothingSaid {} = answer(name, said)?;
            Answer::Placed(Placed { duration_s })
        }
        Request::Pour(_) => {
            let PouredSaid { litres } = answer(name, said)?;
            Answer::Poured(Poured { litres: amount("litres", litres)?, duration_s })
        }
        other => return Err(format!("{other} is nothing for an arm")),
    })
}

/// Parses the answer to a request.
///
/// # Errors
/// If a part is missing or malformed.
pub(super) fn answer<T: DeserializeOwned>(request: &str, value: serde_json::Value) -> Result<T, String> {
    serde_json::from_value(value).map_err(|e| format!("its answer to {request} is none: {e}"))
}

/// Checks a transform and normalises its rotation.
///
/// # Errors
/// If a number is not finite, or the quaternion is not a rotation.
pub(super) fn transform(said: &Isometry3<f64>) -> Result<Isometry3<f64>, String> {
    let quaternion = said.rotation.into_inner();
    let length = quaternion.norm();
    let finite = said.translation.vector.iter().all(|x| x.is_finite()) && length.is_finite();
    if !finite || (length - 1.0).abs() > QUATERNION_TOLERANCE {
        return Err(format!("a transform with the quaternion {:?}", quaternion.coords.as_slice()));
    }
    Ok(Isometry3::from_parts(said.translation, UnitQuaternion::new_normalize(quaternion)))
}

/// Checks a length or an angle, named `what` in messages.
///
/// # Errors
/// If it is negative or not finite.
pub(super) fn amount(what: &str, x: f64) -> Result<f64, String> {
    if x.is_finite() && x >= 0.0 { Ok(x) } else { Err(format!("{what} is {x}, expected a number from 0")) }
}
