//! Bags of ROS 2 in MCAP and SQLite: depth images, camera, colour, and the tree of frames.

mod cdr;
mod frames;
mod gather;
mod mcap;
mod sqlite;
mod transforms;

use crate::input::InputError;
use crate::recorded::folder::{names, shown};
use crate::recorded::picture::RawDepth;
use crate::recorded::reading::Conventions;
use crate::recorded::stated::{Asked, Images, Stated, StatedFrame};
use gather::{Stored, camera, choose, gather};
use image::RgbImage;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Maximum difference between the stamps of depth and colour images, seconds. From: chosen, a frame at 20 Hz.
const BESIDE_S: f64 = 0.05;
/// Names of frames in which z is up. From: REP 105.
const UPRIGHT: [&str; 3] = ["map", "odom", "world"];

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq)]
struct Topic {
    name: String,
    /// Message type, such as `sensor_msgs/msg/Image`.
    kind: String,
    encoding: String,
}

/// Place of a message in its file, as two numbers that only the reader of the file's format interprets.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place(u64, u64);

/// A message during a pass through a bag.
struct Message<'a> {
    topic: &'a Topic,
    place: Place,
    data: &'a [u8],
}

/// Reader of one file of a bag.
trait Messages: Send {
    fn topics(&self) -> Vec<Topic>;

    /// Passes every message of the wanted topics to `see`.
    fn each(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        see: &mut dyn FnMut(Message<'_>) -> Result<(), InputError>,
    ) -> Result<(), InputError>;

    /// Data of the message at a place.
    fn at(&mut self, place: Place) -> Result<Vec<u8>, InputError>;
}

pub(super) fn is(path: &Path) -> bool {
    !files(path).is_empty()
}

/// Files of a bag: the path itself, or those in the folder, in natural order.
fn files(path: &Path) -> Vec<PathBuf> {
    let of_bag = |p: &Path| p.extension().is_some_and(|e| e == "mcap" || e == "db3");
    if path.is_file() {
        return if of_bag(path) { vec![path.into()] } else { Vec::new() };
    }
    let inside = names(path).unwrap_or_default().into_iter().map(|name| path.join(name));
    inside.filter(|p| of_bag(p) && p.is_file()).collect()
}

pub(super) fn read(path: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let mut bags: Vec<(PathBuf, Box<dyn Messages>)> = Vec::new();
    for file in files(path) {
        let bag: Box<dyn Messages> = match file.extension().is_some_and(|e| e == "db3") {
            true => Box::new(sqlite::Sqlite::open(&file)?),
            false => Box::new(mcap::Mcap::open(&file)?),
        };
        bags.push((file, bag));
    }
    let gathered = gather(&mut bags)?;
    let whole = |problem: String, mend: &str| InputError::whole(shown(path), problem, mend);
    let (name, depth) = choose(path, &gathered, asked.topic.as_deref())?;
    let mut notes = vec![format!("depth images are those of {name}")];
    let camera = camera(path, &gathered, name, depth, asked, &mut notes)?;
    let frame = depth.frame.as_str();
    let Some(root) = gathered.transforms.root(frame) else {
        let problem = format!(
            "no transform leads from the camera's frame {frame} to a fixed one; the frames of tf are: {}",
            gathered.transforms.frames().join(", ")
        );
        return Err(whole(problem, "record /tf and /tf_static beside the images"));
    };
    let colour = gathered
        .images
        .iter()
        .filter(|(_, shown)| shown.kind == frames::Kind::Colour)
        .max_by_key(|(_, shown)| (shown.frame == depth.frame, !shown.compressed));
    let registered =
        colour.is_some_and(|(_, c)| c.frame == depth.frame && c.size.is_none_or(|s| Some(s) == depth.size));
    let (mut kept, mut stored, mut unposed) = (Vec::new(), Vec::new(), 0);
    for (i, image) in depth.stored.iter().enumerate() {
        let Some(pose) = gathered.transforms.root_from(frame, image.stamp_s) else {
            unposed += 1;
            continue;
        };
        kept.push(StatedFrame { name: format!("frame-{i:06}"), camera, pose });
        let beside = colour.and_then(|(_, c)| nearest(&c.stored, image.stamp_s));
        stored.push((image.clone(), beside.cloned()));
    }
    if unposed > 0 {
        notes.push(format!(
            "{unposed} frames are left out: a transform from {frame} to {root} of their time is missing"
        ));
    }
    if kept.is_empty() {
        let problem = format!(
            "none of the {} depth images has a transform from {frame} to {root} of its time",
            depth.stored.len()
        );
        return Err(whole(problem, "are images and tf stamped by one clock?"));
    }
    let up = UPRIGHT.contains(&root).then_some([0.0, 0.0, 1.0]);
    let scale = if depth.kind == frames::Kind::DepthMillimetres { 1000.0 } else { 1.0 };
    let is_whole = depth.kind == frames::Kind::DepthMillimetres;
    let compressed = (depth.compressed, colour.is_some_and(|(_, c)| c.compressed));
    let images = BagImages { bags: Mutex::new(bags), stored, compressed };
    Ok(Stated {
        frames: kept,
        images: Box::new(images),
        reading: Conventions::usual(scale),
        whole: is_whole,
        registered,
        up,
        notes,
    })
}

fn nearest(stored: &[Stored], stamp_s: f64) -> Option<&Stored> {
    let after = stored.partition_point(|s| s.stamp_s < stamp_s);
    let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| stored.get(i));
    let apart = |s: &Stored| (s.stamp_s - stamp_s).abs();
    beside.filter(|s| apart(s) <= BESIDE_S).min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

struct BagImages {
    bags: Mutex<Vec<(PathBuf, Box<dyn Messages>)>>,
    /// Places of the depth image of each frame, and of the colour image nearest in time, if any.
    stored: Vec<(Stored, Option<Stored>)>,
    /// True if the depth images are compressed, and true if the colour images are.
    compressed: (bool, bool),
}

impl BagImages {
    /// Name for people of a stored image, and the data of its message.
    fn message(&self, stored: &Stored) -> Result<(String, Vec<u8>), InputError> {
        let mut bags = self.bags.lock().unwrap_or_else(PoisonError::into_inner);
        let (path, bag) = &mut bags[stored.file];
        Ok((format!("{}, image of {:.3} s", shown(path), stored.stamp_s), bag.at(stored.place)?))
    }
}

impl Images for BagImages {
    fn depth(&self, frame: usize) -> Result<RawDepth, InputError> {
        let (place, data) = self.message(&self.stored[frame].0)?;
        frames::depth(&place, &data, self.compressed.0)
    }

    fn colour(&self, frame: usize) -> Result<Option<RgbImage>, InputError> {
        let Some(stored) = &self.stored[frame].1 else { return Ok(None) };
        let (place, data) = self.message(stored)?;
        frames::colour(&place, &data, self.compressed.1).map(Some)
    }

    fn coloured(&self) -> bool {
        self.stored.iter().any(|(_, colour)| colour.is_some())
    }
}
