//! Recordings as robots: frames of a folder or of a record ([`RecordedRobot`]), and runs in which all
//! requests to a body are stored with their answers ([`TapedRobot`]).
//!
//! A folder of depth frames with poses is a robot: it can stand where a frame was taken, and taking a frame
//! there returns that frame.
//!
//! Two layouts are descry's own. [`import`] reads the published ones in [`layouts`] and converts them:
//!
//! | | frames side by side | lists |
//! |---|---|---|
//! | depth, 16 bits | `NAME.depth.png` | `depth/NAME.pgm` or `.png` |
//! | pose (`world_from_camera`) | `NAME.pose.txt`, 4x4 | `pose.txt`, `tx ty tz qx qy qz qw` a line, in order of names |
//! | colour, may be absent | `NAME.color.jpg` or `.png` | `color/NAME.png` or `.jpg` |
//! | camera | `camera-intrinsics.txt`, 3x3 | `[camera]` in `recording.toml` |
//!
//! A depth of 0 or of the greatest value is "no return". Other facts stand in a `recording.toml` in the
//! folder, or anywhere else with a `folder` entry; the robot is opened by the folder or by that file:
//!
//! ```toml
//! name = "dining room"
//! folder = "../data/dining_room"   # where the frames are, from this file; its own folder if left out
//! depth_scale = 1000.0             # units of a depth image in a metre
//! start = "1"                      # the first station; the first frame if left out
//! up = [0.0, -1.0, 0.0]            # in the world of the poses, if known
//! registered = true                # pixels of colour and depth are the same
//! pose_sigma_m = 0.03
//! pose_sigma_deg = 1.0
//! linear_m_s = 0.3
//! angular_deg_s = 30.0
//!
//! [camera]
//! fx = 518.0
//! fy = 519.0
//! cx = 325.5
//! cy = 253.5
//! ```

mod folder;
mod footage;
pub mod import;
pub mod layouts;
pub(crate) mod outline;
mod picture;
mod pose;
pub mod reading;
mod robot;
mod settings;
mod stated;
mod tape;
mod taped;

pub use folder::{Recording, StoredFrame};
pub use footage::Footage;
pub use picture::RawDepth;
pub use robot::RecordedRobot;
pub use settings::{CameraSettings, Settings};
pub use tape::{Entry, Known, Question, Reply, Tape};
pub use taped::TapedRobot;
