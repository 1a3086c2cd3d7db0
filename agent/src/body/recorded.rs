//! Record of a run as a body: it can move to every pose from which a cloud was taken, and its
//! camera returns that cloud.

use std::collections::BTreeSet;
use std::path::Path;

use descry_memory::{Document, Record, Sensing, kind};
use descry_perception::Intrinsics;
use descry_robots::recorded::{Footage, Known, RecordedRobot, Settings};
use descry_robots::{Base, Camera, Description, Footprint, Frames, Pixels, Speeds, Station};

use super::tape;
use crate::exit::CommandError;

/// Clouds of a record, one per station (pose from which a cloud was taken).
struct Clouds {
    record: Record,
    documents: Vec<Document>,
}

impl Footage for Clouds {
    fn pixels(&self, station: usize) -> Result<Pixels, String> {
        tape::pixels(&self.record, &self.documents[station])
    }
}

/// Opens a record as a body. Clouds of a camera other than the first one's, and clouds without a
/// known pose, are left out.
///
/// # Errors
/// [`CommandError::BadInput`] if no cloud has a camera and a pose; [`CommandError::Broken`] if the
/// record cannot be read.
pub fn open(record: Record, place: &str) -> Result<RecordedRobot, CommandError> {
    let known = tape::known(&record)?;
    let frames = known.as_ref().map(|k| k.description.frames.clone()).unwrap_or_default();
    let (mut stations, mut documents, mut camera) = (Vec::new(), Vec::new(), None);
    let mut names = BTreeSet::new();
    for document in record.find(&record.own(kind::CLOUD)).map_err(CommandError::broken)? {
        let sensing = record.sensing(&document).map_err(CommandError::broken)?;
        let first = camera.as_ref().map(|(intrinsics, _)| *intrinsics);
        let Some(intrinsics) = sensing.intrinsics.filter(|c| first.is_none_or(|f| f == *c)) else {
            tracing::warn!("record {}: a cloud of another camera is no station", document.id);
            continue;
        };
        match record.pose_of(&document, &frames.map) {
            Ok(map_from_base) => {
                stations.push(Station { name: name(&document, &mut names), map_from_base });
                documents.push(document);
                camera.get_or_insert((intrinsics, sensing));
            }
            Err(e) => tracing::warn!("record {} is no station: {e}", document.id),
        }
    }
    let Some((intrinsics, sensing)) = camera else {
        let text = format!(
            "{place}: no cloud in this record has a camera and a place\n  expected the record of a run, or a folder of depth frames"
        );
        return Err(CommandError::BadInput(text));
    };
    let known = Known {
        description: description(known.as_ref(), intrinsics, &sensing, place),
        surfaces: known.as_ref().map(|k| k.surfaces.clone()).unwrap_or_default(),
        rooms: known.as_ref().map(|k| k.rooms.clone()).unwrap_or_default(),
        doors: known.map(|k| k.doors).unwrap_or_default(),
        stations: Some(stations),
        map: None,
        now_ns: 0,
    };
    Ok(RecordedRobot::of(known, 0, Box::new(Clouds { record, documents })))
}

/// True if a folder is that of a run, or contains a record.
pub fn is_record(folder: &Path) -> bool {
    crate::run::files::header(folder).is_ok()
        || [folder.to_owned(), folder.join("record")].iter().any(|f| f.join("segments").is_dir())
}

/// Name of a station: the viewpoint of the cloud, numbered if several clouds were taken there.
fn name(document: &Document, taken: &mut BTreeSet<String>) -> String {
    let from = document.body.get("from").and_then(|v| v.as_str()).unwrap_or("view");
    let numbered = (2..).map(|n| format!("{from}-{n}"));
    let free = std::iter::once(from.to_owned()).chain(numbered).find(|name| !taken.contains(name));
    let name = free.unwrap_or_default();
    taken.insert(name.clone());
    name
}

/// Description of the body that made the record, or a default one with this camera if unknown.
fn description(known: Option<&Known>, camera: Intrinsics, sensing: &Sensing, place: &str) -> Description {
    let usual = Settings::default();
    let unknown = || Description {
        name: String::new(),
        simulated: false,
        base: Some(Base {
            footprint: Footprint::Disc { radius_m: 0.0 },
            speeds: Speeds { linear_m_s: usual.linear_m_s, angular_rad_s: usual.angular_deg_s.to_radians() },
        }),
        head: None,
        arm: None,
        camera: None,
        laser: None,
        senses: Vec::new(),
        frames: Frames::default(),
        up: None,
        pose_sigma_m: sensing.pose_sigma_m,
        pose_sigma_rad: sensing.pose_sigma_rad,
    };
    let own = known.map_or_else(unknown, |k| k.description.clone());
    let usual = (usual.range_m[0], usual.range_m[1]);
    let as_made =
        Camera { frame: "camera".into(), intrinsics: camera, range_m: usual, colour: true, latency_s: 0.0 };
    let camera = Camera { intrinsics: camera, ..own.camera.unwrap_or(as_made) };
    Description { name: format!("record {place}"), simulated: false, camera: Some(camera), ..own }
}
