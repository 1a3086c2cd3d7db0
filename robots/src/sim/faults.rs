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
use crate::sim::scene::SceneSpec;
use serde::{Deserialize, Serialize};

/// A kind of mishap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// Somebody stands in the way: the drive ends on its way.
    BlockedPath,
    /// The goal cannot be reached, now or later, though the map says so.
    UnreachablePose,
    /// The drive takes all the time it was given and ends on its way.
    TimedOutDrive,
    /// A frame does not come.
    DroppedFrame,
    /// After the drive the body is 10 cm and 6° off where it believes to be.
    BadLocalisation,
    /// During the drive somebody moves an object on its surface.
    ObjectMoved,
    /// During the drive somebody takes an object away.
    ObjectTaken,
    /// During the drive somebody puts an object on another surface.
    ObjectRelocated,
    /// During the drive what the hand holds falls to the floor.
    ObjectDropped,
    /// As the drive begins somebody shuts a door.
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

/// One mishap: which, when, to what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// At the drive (or frame, or grasp) of this number, from 1.
    #[serde(default)]
    pub at: Option<u64>,
    /// Or at each with this chance.
    #[serde(default)]
    pub chance: Option<f64>,
    /// The object that is moved or taken; the seed chooses if left out.
    #[serde(default)]
    pub object: Option<String>,
    /// The surface that it is put on; the seed chooses if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// The door that is shut; the seed chooses if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub door: Option<String>,
    /// Distance that it is moved, metres.
    #[serde(default = "default_by_m")]
    pub by_m: f64,
}

fn default_by_m() -> f64 {
    0.2
}

/// All mishaps of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaultPlan {
    /// In the order in which they are asked.
    #[serde(default, rename = "fault")]
    pub faults: Vec<Fault>,
}

impl FaultPlan {
    /// Reads `[[fault]]` entries. `file` is the name for messages.
    ///
    /// # Errors
    /// The first mistake, with its place in the text and how to mend it.
    pub fn parse(file: &str, text: &str) -> Result<FaultPlan, InputError> {
        let plan: FaultPlan = input::parse_toml(file, text)?;
        plan.check().map_err(|objection| input::draw(file, text, objection))?;
        Ok(plan)
    }

    /// Joins the faults of a scene with these, the scene's first.
    pub fn after(self, scene: &SceneSpec) -> FaultPlan {
        FaultPlan { faults: scene.faults.iter().cloned().chain(self.faults).collect() }
    }

    /// Checks that every fault says when.
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

    /// The faults of that kind that happen at drive (or frame, or grasp) `number`, from 1.
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
