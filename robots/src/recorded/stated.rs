//! Recording as its files state it, before units and conventions are resolved.

use crate::input::InputError;
use crate::recorded::picture::{self, RawDepth};
use crate::recorded::reading::{Conventions, Pair, StatedView};
use crate::recorded::settings::CameraSettings;
use image::RgbImage;
use nalgebra::Isometry3;
use std::path::{Path, PathBuf};

/// Maximum number of frames for each of which a second view is sought. From: chosen.
const ANCHORS: usize = 24;

/// Facts that the user gives because a folder does not state them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// Name of the layout.
    pub layout: Option<String>,
    /// The depth camera.
    pub camera: Option<CameraSettings>,
    /// Topic of the depth images in a bag.
    pub topic: Option<String>,
}

/// Frame as its files state it.
#[derive(Clone, Debug, PartialEq)]
pub struct StatedFrame {
    /// Name, for the station.
    pub name: String,
    /// The depth camera.
    pub camera: CameraSettings,
    /// Pose in the units and the convention of the files.
    pub pose: Isometry3<f64>,
}

/// Recording as its files state it.
pub struct Stated {
    /// Frames whose pose is known, in the order of the recording.
    pub frames: Vec<StatedFrame>,
    /// Images of the frames.
    pub images: Box<dyn Images>,
    /// Units and conventions that the layout defines.
    pub reading: Conventions,
    /// True if depths are 16-bit integers.
    pub whole: bool,
    /// True if colour and depth image show the same point at the same pixel.
    pub registered: bool,
    /// Upward direction in the world of the poses, if the layout defines one.
    pub up: Option<[f64; 3]>,
    /// Notes for people: what was assumed or left out.
    pub notes: Vec<String>,
}

/// Images of a recording, by frame.
pub trait Images: Send + Sync {
    /// Depth image of a frame.
    ///
    /// # Errors
    /// If the image cannot be read.
    fn depth(&self, frame: usize) -> Result<RawDepth, InputError>;

    /// Colour image of a frame, if there is one.
    ///
    /// # Errors
    /// If the image cannot be read.
    fn colour(&self, frame: usize) -> Result<Option<RgbImage>, InputError>;

    /// Paths of a frame's depth and colour image, if they are files that may be copied as they are.
    fn files(&self, _frame: usize) -> Option<(&Path, Option<&Path>)> {
        None
    }

    /// True if any frame has colour.
    fn coloured(&self) -> bool;
}

/// Paths of the image files of each frame: depth, and colour if there is some.
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

/// Pairs of views that show much of the same from different places, spread over the recording.
pub(crate) fn pairs(stated: &Stated) -> Result<Vec<Pair>, InputError> {
    let view = |i: usize| -> Result<StatedView, InputError> {
        let frame = &stated.frames[i];
        Ok(StatedView { pose: frame.pose, camera: frame.camera, depth: stated.images.depth(i)? })
    };
    let count = stated.frames.len();
    let mut pairs = Vec::new();
    for anchor in (0..count).step_by(count.div_ceil(ANCHORS).max(1)) {
        let first = view(anchor)?;
        let mut stride = 1;
        while anchor + stride < count {
            let pair = Pair(first.clone(), view(anchor + stride)?);
            if pair.tells() {
                pairs.push(pair);
                break;
            }
            stride *= 2;
        }
    }
    Ok(pairs)
}
