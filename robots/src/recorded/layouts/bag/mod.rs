//! Bags of ROS 2 in MCAP and SQLite: depth images, camera, colour, and the tree of frames.

mod cdr;
mod frames;
mod mcap;
mod sqlite;
mod transforms;

use super::{Asked, Images, Stated, StatedFrame};
use crate::input::InputError;
use crate::recorded::folder::{names, shown};
use crate::recorded::picture::RawDepth;
use crate::recorded::reading::Reading;
use crate::recorded::settings::CameraSettings;
use cdr::{CameraInfo, Cdr};
use image::RgbImage;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use transforms::Transforms;

const IMAGE: &str = "sensor_msgs/msg/Image";
const COMPRESSED: &str = "sensor_msgs/msg/CompressedImage";
const CAMERA: &str = "sensor_msgs/msg/CameraInfo";
const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";
/// Greatest difference of the stamps of depth and colour, seconds. From: chosen, a frame at 20 Hz.
const BESIDE_S: f64 = 0.05;
/// Frames in which z is up. From: REP 105.
const UPRIGHT: [&str; 3] = ["map", "odom", "world"];

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq)]
struct Topic {
    name: String,
    /// Type of its messages.
    kind: String,
    encoding: String,
}

/// Place of a message in its file.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place(u64, u64);

/// A message as it is met.
struct Message<'a> {
    topic: &'a Topic,
    place: Place,
    data: &'a [u8],
}

/// A file of a bag.
trait Messages: Send {
    fn topics(&self) -> Vec<Topic>;

    /// Shows all messages of some topics.
    fn each(
        &mut self,
        wanted: &dyn Fn(&Topic) -> bool,
        see: &mut dyn FnMut(Message<'_>) -> Result<(), InputError>,
    ) -> Result<(), InputError>;

    /// Data of the message at a place.
    fn at(&mut self, place: Place) -> Result<Vec<u8>, InputError>;
}

/// Stamped image of a topic: the file that holds it, and its place there.
#[derive(Clone, Debug)]
struct Stored {
    stamp_s: f64,
    file: usize,
    place: Place,
}

/// What one walk through a bag gathers.
#[derive(Default)]
struct Gathered {
    transforms: Transforms,
    /// By topic: the first camera.
    cameras: BTreeMap<String, CameraInfo>,
    /// By topic: its images.
    images: BTreeMap<String, Shown>,
}

/// Images of a topic.
struct Shown {
    kind: frames::Kind,
    frame: String,
    size: Option<(usize, usize)>,
    compressed: bool,
    stored: Vec<Stored>,
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
        reading: Reading::usual(scale),
        whole: is_whole,
        registered,
        up,
        notes,
    })
}

fn gather(bags: &mut [(PathBuf, Box<dyn Messages>)]) -> Result<Gathered, InputError> {
    let mut gathered = Gathered::default();
    for (file, (path, bag)) in bags.iter_mut().enumerate() {
        let used = |t: &Topic| [IMAGE, COMPRESSED, CAMERA, TRANSFORMS].contains(&t.kind.as_str());
        if let Some(other) = bag.topics().iter().find(|t| used(t) && t.encoding != "cdr") {
            let problem = format!("{} is encoded as {}, expected cdr", other.name, other.encoding);
            return Err(InputError::whole(shown(path), problem, "is this a bag of ROS 2?"));
        }
        bag.each(&used, &mut |message| {
            let topic = message.topic;
            gathered.hear(file, &message).map_err(|fault| {
                let place = format!("{}, a message of {}", shown(path), topic.name);
                InputError::whole(place, fault, "the message is damaged, or of another version of its type")
            })
        })?;
    }
    gathered.transforms.sort();
    for shown in gathered.images.values_mut() {
        shown.stored.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
    }
    Ok(gathered)
}

impl Gathered {
    fn hear(&mut self, file: usize, message: &Message<'_>) -> Result<(), cdr::Fault> {
        let (topic, body) = (message.topic, Cdr::new(message.data)?);
        match topic.kind.as_str() {
            TRANSFORMS => {
                let fixed = topic.name.ends_with("tf_static");
                body.transforms()?.into_iter().for_each(|t| self.transforms.add(fixed, t));
            }
            CAMERA if !self.cameras.contains_key(&topic.name) => {
                self.cameras.insert(topic.name.clone(), body.camera_info()?);
            }
            IMAGE => {
                let image = body.image()?;
                if let Some(kind) = frames::kind_of(&image.encoding) {
                    let size = Some((image.width, image.height));
                    self.store(topic, kind, image.header, size, (file, message.place), false);
                }
            }
            COMPRESSED => {
                let image = body.compressed()?;
                let kind = frames::kind_of_compressed(&image.format);
                self.store(topic, kind, image.header, None, (file, message.place), true);
            }
            _ => {}
        }
        Ok(())
    }

    fn store(
        &mut self,
        topic: &Topic,
        kind: frames::Kind,
        header: cdr::Header,
        size: Option<(usize, usize)>,
        (file, place): (usize, Place),
        compressed: bool,
    ) {
        let new = || Shown { kind, frame: header.frame.clone(), size, compressed, stored: Vec::new() };
        let shown = self.images.entry(topic.name.clone()).or_insert_with(new);
        shown.stored.push(Stored { stamp_s: header.stamp_s, file, place });
    }
}

/// The topic of depth images: the one that was asked for, or the only one.
fn choose<'a>(
    path: &Path,
    gathered: &'a Gathered,
    topic: Option<&str>,
) -> Result<(&'a str, &'a Shown), InputError> {
    let all = gathered.images.iter().filter(|(_, shown)| shown.kind != frames::Kind::Colour);
    let (raw, packed): (Vec<_>, Vec<_>) = all.partition(|(_, shown)| !shown.compressed);
    let all = if raw.is_empty() || topic.is_some() { [raw, packed].concat() } else { raw };
    let listed: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    let whole = |problem: String, mend: String| Err(InputError::whole(shown(path), problem, mend));
    match (topic, &all[..]) {
        (Some(topic), _) => match all.iter().find(|(name, _)| *name == topic) {
            Some((name, shown)) => Ok((name, shown)),
            None => whole(
                format!("{topic} holds no depth images"),
                format!("--topic is one of: {}", listed.join(", ")),
            ),
        },
        (None, [(name, shown)]) => Ok((name, shown)),
        (None, []) => whole(
            "no depth images: no topic holds sensor_msgs/Image of 16UC1 or 32FC1, or compressedDepth".into(),
            "record the topic of the depth camera".into(),
        ),
        (None, _) => whole(
            format!("several topics hold depth images: {}", listed.join(", ")),
            "say which with --topic".into(),
        ),
    }
}

/// The camera of a topic: that of `camera_info` beside it, or the only one of its frame.
fn camera(
    path: &Path,
    gathered: &Gathered,
    topic: &str,
    depth: &Shown,
    asked: &Asked,
    notes: &mut Vec<String>,
) -> Result<CameraSettings, InputError> {
    if let Some(camera) = asked.camera {
        return Ok(camera);
    }
    let above = |name: &'_ str| name.rsplit_once('/').map_or(String::new(), |(above, _)| above.to_string());
    let beside = [above(topic), above(&above(topic))].map(|above| format!("{above}/camera_info"));
    let of_topic = beside.iter().find_map(|name| gathered.cameras.get_key_value(name));
    let fits = |info: &CameraInfo| depth.size.is_none_or(|size| size == (info.width, info.height));
    let of_frame =
        || gathered.cameras.iter().find(|(_, info)| info.header.frame == depth.frame && fits(info));
    let Some((name, info)) = of_topic.filter(|(_, info)| fits(info)).or_else(of_frame) else {
        let problem = format!("no camera_info belongs to {topic}");
        return Err(InputError::whole(
            shown(path),
            problem,
            format!("record {}, or give --camera FX,FY,CX,CY", beside[0]),
        ));
    };
    if info.distortion.iter().any(|d| d.abs() > 1e-6) {
        notes
            .push(format!("the distortion that {name} states is not corrected: a rectified topic is better"));
    }
    let k = &info.matrix;
    let camera = CameraSettings { fx: k[0], fy: k[4], cx: k[2], cy: k[5] };
    super::pieces::fitting(camera, (info.width, info.height), &format!("{}, {name}", shown(path)))
}

fn nearest(stored: &[Stored], stamp_s: f64) -> Option<&Stored> {
    let after = stored.partition_point(|s| s.stamp_s < stamp_s);
    let beside = [after.checked_sub(1), Some(after)].into_iter().flatten().filter_map(|i| stored.get(i));
    let apart = |s: &Stored| (s.stamp_s - stamp_s).abs();
    beside.filter(|s| apart(s) <= BESIDE_S).min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

struct BagImages {
    bags: Mutex<Vec<(PathBuf, Box<dyn Messages>)>>,
    /// Depth and colour of each frame.
    stored: Vec<(Stored, Option<Stored>)>,
    /// True for those that are compressed: depth, colour.
    compressed: (bool, bool),
}

impl BagImages {
    /// The place of a message for people, and its data.
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
