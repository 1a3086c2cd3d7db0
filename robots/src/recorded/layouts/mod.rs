//! Layouts in which recordings are published, recognised by the contents of a folder.
//!
//! A layout gives frames as its files state them; units and conventions are resolved in
//! [`reading`](crate::recorded::reading).

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
pub use crate::recorded::stated::{Asked, Files, Images, Stated, StatedFrame};
use std::path::Path;

/// A published layout.
pub struct Layout {
    /// Name on the command line.
    pub name: &'static str,
    /// Description of the files by which the layout is recognised.
    pub files: &'static str,
    /// True if a folder or file has this layout.
    is: fn(&Path) -> bool,
    read: fn(&Path, &Asked) -> Result<Stated, InputError>,
}

/// All layouts, the most specific first.
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

/// Published layout of a folder or file; `None` if no known layout fits.
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
