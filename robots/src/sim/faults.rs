//! Injected faults of the simulated room: declared, seeded, and the same in every run of a seed.
//!
//! ```toml
//! [[fault]]
//! kind = "dropped_frame"      # blocked_path, unreachable_pose, timed_out_drive, bad_localisation, object_moved, object_taken,
//!                             # object_relocated, object_dropped, door_shut, grasp_slips
//! at = 2                      # the second frame (`grasp_slips`: grasp; the others: drive); or
//! chance = 0.1                # of each
//!
//! [[fault]]
//! kind = "object_moved"
//! at = 3
//! object = "cup A"            # the seed chooses if left out
//! by_m = 0.2
//!
//! [[fault]]
//! kind = "object_relocated"
//! chance = 0.05
//! object = "cup A"
//! to = "desk"                 # the surface; the seed chooses if left out
//!
//! [[fault]]
//! kind = "door_shut"          # as that drive begins: at = 1 is before the body has moved
//! at = 1
//! door = "kitchen door"       # the seed chooses if left out
//! ```

use crate::input::{self, InputError, Objection, Step};
use crate::sim::noise::{mix, share};
use serde::{Deserialize, Serialize};

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// A person stands in the way, and the drive ends early.
    BlockedPath,
    /// The goal of the drive cannot be reached, now or later, although the map shows a route.
    UnreachablePose,
    /// The drive uses up its time limit and ends early.
    TimedOutDrive,
    /// A frame is lost.
    DroppedFrame,
    /// After the drive the estimated pose is wrong by 10 cm and 6°.
    BadLocalisation,
    /// During the drive someone moves an object on its surface.
    ObjectMoved,
    /// During the drive someone takes an object away.
    ObjectTaken,
    /// During the drive someone puts an object on another surface.
    ObjectRelocated,
    /// During the drive the held object falls to the floor.
    ObjectDropped,
    /// At the start of the drive someone shuts a door.
    DoorShut,
    /// The grasp slips.
    GraspSlips,
}

impl FaultKind {
    /// Every kind.
    pub const ALL: [FaultKind; 11] = [
        FaultKind::BlockedPath,
        FaultKind::UnreachablePose,
        FaultKind::TimedOutDrive,
        FaultKind::DroppedFrame,
        FaultKind::BadLocalisation,
        FaultKind::ObjectMoved,
        FaultKind::ObjectTaken,
        FaultKind::ObjectRelocated,
        FaultKind::ObjectDropped,
        FaultKind::DoorShut,
        FaultKind::GraspSlips,
    ];
}

/// A fault: its kind, its time or probability, and the object, surface or door concerned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Number of the drive (or frame, or grasp) at which the fault happens, from 1.
    #[serde(default)]
    pub at: Option<u64>,
    /// Probability of the fault at each drive (or frame, or grasp), in place of a number.
    #[serde(default)]
    pub chance: Option<f64>,
    /// Name of the object to move or take; drawn by the seed if left out.
    #[serde(default)]
    pub object: Option<String>,
    /// Name of the surface to put the object on; drawn by the seed if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// Name of the door to shut; drawn by the seed if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub door: Option<String>,
    /// Distance by which the object is moved, metres.
    #[serde(default = "default_by_m")]
    pub by_m: f64,
}

fn default_by_m() -> f64 {
    0.2
}

/// All faults of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultPlan {
    /// Faults, in the order in which they are applied.
    #[serde(default, rename = "fault")]
    pub faults: Vec<Fault>,
}

impl FaultPlan {
    /// Parses `[[fault]]` entries. `file` is the name for messages.
    ///
    /// # Errors
    /// The first error, with its place in the text and a fix.
    pub fn parse(file: &str, text: &str) -> Result<FaultPlan, InputError> {
        let plan: FaultPlan = input::parse_toml(file, text)?;
        plan.check().map_err(|objection| input::draw(file, text, objection))?;
        Ok(plan)
    }

    /// Checks that every fault has a number or a probability that is valid.
    ///
    /// # Errors
    /// The first objection, with its path in the document.
    pub fn check(&self) -> Result<(), Objection> {
        for (i, fault) in self.faults.iter().enumerate() {
            let objection = |key, problem: &str, mend: &str| Objection {
                path: vec![Step::Key("fault"), Step::Index(i), Step::Key(key)],
                problem: problem.into(),
                mend: mend.into(),
            };
            match (fault.at, fault.chance) {
                (None, None) => {
                    return Err(objection("kind", "it is not said when", "add `at = 1` or `chance = 0.1`"));
                }
                (Some(_), Some(_)) => {
                    return Err(objection("chance", "both `at` and `chance` are given", "keep one of them"));
                }
                (Some(0), _) => {
                    return Err(objection("at", "there is no drive, frame or grasp 0", "count from 1"));
                }
                (_, Some(chance)) if !(0.0..=1.0).contains(&chance) => {
                    return Err(objection("chance", "this is no chance", "a number between 0 and 1"));
                }
                _ => {}
            }
            if fault.to.is_some() && fault.kind != FaultKind::ObjectRelocated {
                return Err(objection("to", "nothing is put anywhere", "kind = \"object_relocated\""));
            }
            if fault.door.is_some() && fault.kind != FaultKind::DoorShut {
                return Err(objection("door", "no door is shut", "kind = \"door_shut\""));
            }
            if !(fault.by_m.is_finite() && fault.by_m > 0.0) {
                return Err(objection("by_m", "this is no distance", "metres above zero, such as 0.2"));
            }
        }
        Ok(())
    }

    /// The faults of a kind that happen at the drive (or frame, or grasp) `number`, from 1.
    pub fn strike(&self, kind: FaultKind, number: u64, seed: u64) -> impl Iterator<Item = &Fault> {
        let of_kind = self.faults.iter().enumerate().filter(move |(_, f)| f.kind == kind);
        let happens = move |(i, fault): &(usize, &Fault)| {
            let drawn = mix(mix(mix(seed ^ 0xfa17) ^ *i as u64) ^ number);
            match (fault.at, fault.chance) {
                (Some(at), _) => at == number,
                (None, Some(chance)) => share(drawn) < chance,
                (None, None) => false,
            }
        };
        of_kind.filter(happens).map(|(_, fault)| fault)
    }
}
