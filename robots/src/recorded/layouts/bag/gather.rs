//! One pass through a bag that collects its messages, and the choice of topics.

use super::cdr::{self, CameraInfo, Cdr};
use super::transforms::Transforms;
use super::{Message, Messages, Place, Topic, frames};
use crate::input::InputError;
use crate::recorded::folder::shown;
use crate::recorded::layouts::pieces;
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::Asked;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const IMAGE: &str = "sensor_msgs/msg/Image";
const COMPRESSED: &str = "sensor_msgs/msg/CompressedImage";
const CAMERA: &str = "sensor_msgs/msg/CameraInfo";
const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

/// A stored image: its time stamp, the index of the file that holds it, and its place in that file.
#[derive(Clone, Debug)]
pub(super) struct Stored {
    pub(super) stamp_s: f64,
    pub(super) file: usize,
    pub(super) place: Place,
}

/// Transforms, cameras and images that one pass through a bag collects.
#[derive(Default)]
pub(super) struct Gathered {
    pub(super) transforms: Transforms,
    /// First `CameraInfo` of each topic, by topic.
    pub(super) cameras: BTreeMap<String, CameraInfo>,
    /// Images of each topic, by topic.
    pub(super) images: BTreeMap<String, Shown>,
}

/// Images of one topic: content, coordinate frame, size in columns and rows, and where each is stored.
pub(super) struct Shown {
    pub(super) kind: frames::Kind,
    pub(super) frame: String,
    pub(super) size: Option<(usize, usize)>,
    pub(super) compressed: bool,
    pub(super) stored: Vec<Stored>,
}

pub(super) fn gather(bags: &mut [(PathBuf, Box<dyn Messages>)]) -> Result<Gathered, InputError> {
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

/// Chooses the topic of depth images: the requested one, or else the only one; uncompressed topics go first.
pub(super) fn choose<'a>(
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

/// Camera of a depth topic: the one that the user gives, or that of `camera_info` beside the topic, or one
/// with the same coordinate frame and size.
pub(super) fn camera(
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
    pieces::fitting(camera, (info.width, info.height), &format!("{}, {name}", shown(path)))
}
