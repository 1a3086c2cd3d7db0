//! Layouts in which recordings are published, told apart by the contents of a folder.
//!
//! A layout yields frames as its files state them; units and conventions are settled in [`reading`](crate::recorded::reading).

mod bag;
mod bop;
mod pcds;
mod pieces;
mod redwood;
mod replica;
mod scannet;
mod seven_scenes;
mod tum;

use crate::input::InputError;
use crate::recorded::folder::{CAMERA_FILE, SETTINGS_FILE, names, shown};
use crate::recorded::picture::{self, RawDepth};
use crate::recorded::reading::Conventions;
use crate::recorded::settings::CameraSettings;
use image::RgbImage;
use nalgebra::Isometry3;
use std::path::{Path, PathBuf};

/// A published layout.
pub struct Layout {
    /// Name as an option's value.
    pub name: &'static str,
    /// Files by which it is known.
    pub files: &'static str,
    /// True if a folder or file has this layout.
    is: fn(&Path) -> bool,
    read: fn(&Path, &Asked) -> Result<Stated, InputError>,
}

/// All layouts, the most telling first.
pub const LAYOUTS: [Layout; 8] = [
    Layout {
        name: "rosbag",
        files: "*.mcap or *.db3 of ROS 2: depth, camera_info, tf",
        is: bag::is,
        read: bag::read,
    },
    Layout { name: "bop", files: "scene_camera.json, depth/, rgb/", is: bop::is, read: bop::read },
    Layout {
        name: "scannet",
        files: "depth/N.png, pose/N.txt, intrinsic/ as exported",
        is: scannet::is,
        read: scannet::read,
    },
    Layout { name: "replica", files: "results/depthN.png, traj.txt", is: replica::is, read: replica::read },
    Layout {
        name: "tum",
        files: "groundtruth.txt, depth.txt or depth/, rgb.txt",
        is: tum::is,
        read: tum::read,
    },
    Layout {
        name: "redwood",
        files: "depth/, a trajectory .log or .json of Open3D",
        is: redwood::is,
        read: redwood::read,
    },
    Layout {
        name: "7-scenes",
        files: "frame-N.depth.png, frame-N.pose.txt, six digits",
        is: seven_scenes::is,
        read: seven_scenes::read,
    },
    Layout { name: "pcd", files: "*.pcd, each with its VIEWPOINT", is: pcds::is, read: pcds::read },
];

/// Choices of the user about what a folder does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// Name of the layout.
    pub layout: Option<String>,
    /// The depth camera.
    pub camera: Option<CameraSettings>,
    /// Topic of the depth images in a bag.
    pub topic: Option<String>,
}

/// A frame as its layout states it.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedFrame {
    /// Name, for the station.
    pub name: String,
    /// The depth camera.
    pub camera: CameraSettings,
    /// Pose in the units and the convention of the files.
    pub pose: Isometry3<f64>,
}

/// A recording as its layout states it.
pub struct Stated {
    /// Frames whose pose is known, in their order.
    pub frames: Vec<StatedFrame>,
    /// Images of these frames.
    pub images: Box<dyn Images>,
    /// Units and conventions of the layout.
    pub reading: Conventions,
    /// True if depths are whole numbers of 16 bits.
    pub whole: bool,
    /// True if pixels of colour and depth are the same.
    pub registered: bool,
    /// Upward direction in the world of the poses, if the layout defines it.
    pub up: Option<[f64; 3]>,
    /// Notes for people: what was assumed or left out.
    pub notes: Vec<String>,
}

/// Images of a recording, by frame.
pub trait Images: Send + Sync {
    /// Depth image of a frame.
    ///
    /// # Errors
    /// If it cannot be read.
    fn depth(&self, frame: usize) -> Result<RawDepth, InputError>;

    /// Colour image of a frame, if there is one.
    ///
    /// # Errors
    /// If it cannot be read.
    fn colour(&self, frame: usize) -> Result<Option<RgbImage>, InputError>;

    /// Files of a frame's depth and colour that may be copied as they are.
    fn files(&self, _frame: usize) -> Option<(&Path, Option<&Path>)> {
        None
    }

    /// True if any frame has colour.
    fn coloured(&self) -> bool;
}

/// Images in files of their own: depth, and colour if there is some.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Files(pub Vec<(PathBuf, Option<PathBuf>)>);

impl Images for Files {
    fn depth(&self, frame: usize) -> Result<RawDepth, InputError> {
        picture::depth(&self.0[frame].0)
    }

    fn colour(&self, frame: usize) -> Result<Option<RgbImage>, InputError> {
        self.0[frame].1.as_deref().map(picture::colour).transpose()
    }

    fn files(&self, frame: usize) -> Option<(&Path, Option<&Path>)> {
        let (depth, colour) = &self.0[frame];
        Some((depth, colour.as_deref()))
    }

    fn coloured(&self) -> bool {
        self.0.iter().any(|(_, colour)| colour.is_some())
    }
}

/// The layout of a folder or file, if it is one of those that are known.
pub fn layout_of(path: &Path) -> Option<&'static Layout> {
    LAYOUTS.iter().find(|layout| (layout.is)(path))
}

/// Reads a recording in a published layout.
///
/// # Errors
/// If the layout is unknown, or a part is missing or broken: with the file, the line, the expectation and a fix.
pub fn read(path: &Path, asked: &Asked) -> Result<(&'static Layout, Stated), InputError> {
    let layout = match &asked.layout {
        Some(name) => LAYOUTS.iter().find(|layout| layout.name == name).ok_or_else(|| {
            let known: Vec<&str> = LAYOUTS.iter().map(|layout| layout.name).collect();
            InputError::whole(
                shown(path),
                format!("no layout is called {name}"),
                format!("one of: {}", known.join(", ")),
            )
        })?,
        None => layout_of(path).ok_or_else(|| unknown(path))?,
    };
    let stated = (layout.read)(path, asked)?;
    if stated.frames.is_empty() {
        let problem = "no frame has both a depth image and a pose";
        return Err(InputError::whole(shown(path), problem, "is the folder complete?"));
    }
    Ok((layout, stated))
}

fn unknown(path: &Path) -> InputError {
    if !path.exists() {
        return InputError::whole(
            shown(path),
            "there is no such file or folder",
            "give the folder of a recording",
        );
    }
    if [CAMERA_FILE, SETTINGS_FILE].iter().any(|file| path.join(file).is_file()) {
        let problem = "is in descry's own layout";
        return InputError::whole(shown(path), problem, "take it as it is: --robot recorded:DIR");
    }
    let children: Vec<String> = names(path).unwrap_or_default();
    let inside = children.iter().find(|name| layout_of(&path.join(name)).is_some());
    if let Some(inside) = inside {
        let problem = "holds recordings and is none itself";
        return InputError::whole(
            shown(path),
            problem,
            format!("give one of them, such as {}", path.join(inside).display()),
        );
    }
    let known: Vec<String> = LAYOUTS.iter().map(|l| format!("\n  {:<10} {}", l.name, l.files)).collect();
    InputError::whole(shown(path), "its layout is not known", format!("expected one of:{}", known.concat()))
}
