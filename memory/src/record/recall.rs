//! Reading of recorded sensor data: clouds and laser sweeps, with the poses at their time.

use super::{Record, kind};
use crate::clouds::{self, CLOUD, Sensing};
use crate::document::{Document, Form, Query, RecordId};
use crate::error::Error;
use crate::foxglove;
use crate::scans::{self, SCAN};
use crate::stores::no_blob;
use crate::transforms::{Sample, Transforms};
use descry_perception::laser::Scan;
use descry_perception::{Cloud, View};
use nalgebra::{Isometry2, Isometry3, Vector3};
use serde_json::Value;
use std::sync::PoisonError;

impl Record {
    /// Reads a cloud, and the camera behind it.
    ///
    /// # Errors
    /// [`Error::Missing`], [`Error::NoBlob`], [`Error::Damaged`].
    pub fn cloud(&self, document: &Document) -> Result<(Cloud, Sensing), Error> {
        let info = document.blobs.iter().find(|b| b.name == CLOUD && b.form == Form::PointCloud);
        let info = info.ok_or_else(|| no_blob(document, CLOUD))?;
        let data = self.store.blob(document.id, CLOUD)?;
        clouds::decode(info, &data).map_err(|what| Error::Damaged {
            place: format!("record {}", document.id).into(),
            at: 0,
            what,
        })
    }

    /// Reads the camera behind a cloud, without the cloud.
    ///
    /// # Errors
    /// [`Error::NoBlob`], [`Error::Damaged`].
    pub fn sensing(&self, document: &Document) -> Result<Sensing, Error> {
        let info = document.blobs.iter().find(|b| b.name == CLOUD && b.form == Form::PointCloud);
        let info = info.ok_or_else(|| no_blob(document, CLOUD))?;
        clouds::sensing(info).map_err(|what| Error::Damaged {
            place: format!("record {}", document.id).into(),
            at: 0,
            what,
        })
    }

    /// View of the cloud nearest to a time in nanoseconds, with the camera's pose in `world` at the cloud's
    /// stamp (paper 004, section V, step 0).
    ///
    /// # Errors
    /// [`Error::NotNear`] without a cloud within [`view_tolerance_ns`](crate::Options::view_tolerance_ns); a missing link or gap of the transforms of that time.
    pub fn view_at(&self, stamp_ns: i64, world: &str) -> Result<View, Error> {
        let document = self.nearest(kind::CLOUD, stamp_ns, self.options.view_tolerance_ns)?;
        self.view(&document, world)
    }

    /// Laser sweep at a time in nanoseconds, with the laser's pose in `world`.
    ///
    /// # Errors
    /// [`Error::NotNear`] without a sweep of that very time; a missing link or gap of the transforms of that time; [`Error::Damaged`].
    pub fn scan_at(&self, stamp_ns: i64, world: &str) -> Result<Scan, Error> {
        let document = self.nearest(kind::SCAN, stamp_ns, 0)?;
        let info = document.blobs.iter().find(|b| b.name == SCAN && b.form == Form::LaserScan);
        let info = info.ok_or_else(|| no_blob(&document, SCAN))?;
        let data = self.store.blob(document.id, SCAN)?;
        let world_from_laser = self.pose_of(&document, world)?;
        let heading = world_from_laser.rotation * Vector3::x();
        let turn = heading.y.atan2(heading.x);
        let on_floor = Isometry2::new(world_from_laser.translation.vector.xy(), turn);
        scans::decode(info, &data, on_floor).map_err(|what| Error::Damaged {
            place: format!("record {}", document.id).into(),
            at: 0,
            what,
        })
    }

    /// View of a recorded cloud, with the camera's pose in `world`.
    ///
    /// # Errors
    /// As [`Record::view_at`].
    pub fn view(&self, document: &Document, world: &str) -> Result<View, Error> {
        let (cloud, sensing) = self.cloud(document)?;
        let world_from_camera = self.pose_of(document, world)?;
        Ok(View {
            stamp_ns: document.stamp_ns,
            cloud,
            intrinsics: sensing.intrinsics,
            world_from_camera,
            pose_sigma_m: sensing.pose_sigma_m,
            pose_sigma_rad: sensing.pose_sigma_rad,
        })
    }

    /// Pose of a document's frame in `world` at the document's time, by the transforms of the robot that
    /// recorded the document.
    ///
    /// # Errors
    /// An error that names the missing link, or the gap.
    pub fn pose_of(&self, document: &Document, world: &str) -> Result<Isometry3<f64>, Error> {
        let around = self.transforms_of(&document.robot, document.stamp_ns)?;
        Ok(around.lookup(world, &document.frame, document.stamp_ns, self.options.reach)?)
    }

    /// Transform from `origin` to `target` at a time in nanoseconds, interpolated.
    ///
    /// # Errors
    /// An error that names the missing link, or the gap.
    pub fn transform(&self, target: &str, origin: &str, stamp_ns: i64) -> Result<Isometry3<f64>, Error> {
        Ok(self.transforms_around(stamp_ns)?.lookup(target, origin, stamp_ns, self.options.reach)?)
    }

    /// All transforms that matter at a time in nanoseconds: those measured around it, and the static ones.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn transforms_around(&self, stamp_ns: i64) -> Result<Transforms, Error> {
        self.transforms_of(&self.options.robot, stamp_ns)
    }

    /// Transforms that matter at a time, of one robot, or of all robots if `robot` is empty.
    fn transforms_of(&self, robot: &str, stamp_ns: i64) -> Result<Transforms, Error> {
        self.flusher.drain()?;
        let of = |kind: &str| Query { robot: named(robot), ..Query::of_kind(kind) };
        let mut around = Transforms::default();
        for document in self.store.find(&of(kind::STATIC_TRANSFORM))? {
            let (parent, samples) = self.samples(&document)?;
            for sample in samples {
                around.insert_static(&parent, &document.frame, &sample.parent_from_child)?;
            }
        }
        let reach_ns = self.options.reach.max_gap_ns.max(self.options.reach.hold_ns);
        for child in self.store.frames(kind::TRANSFORMS)? {
            let of_child = Query { frame: Some(child), ..of(kind::TRANSFORMS) };
            let near = Query {
                from_ns: Some(stamp_ns.saturating_sub(reach_ns)),
                to_ns: Some(stamp_ns.saturating_add(reach_ns)),
                ..of_child.clone()
            };
            let mut groups = self.store.find(&near)?;
            if groups.is_empty() {
                // Not to be used, but to say how far off it is.
                groups.extend(self.store.nearest(&of_child, stamp_ns)?);
            }
            for document in groups {
                let (parent, samples) = self.samples(&document)?;
                for sample in samples {
                    around.insert(sample.stamp_ns, &parent, &document.frame, &sample.parent_from_child)?;
                }
            }
        }
        let groups = self.groups.lock().unwrap_or_else(PoisonError::into_inner);
        for ((child, parent), samples) in &groups.open {
            for sample in samples {
                around.insert(sample.stamp_ns, parent, child, &sample.parent_from_child)?;
            }
        }
        Ok(around)
    }

    /// These records, and for each cloud or laser sweep also the transforms up to its time and the images of
    /// its time, which are needed to place and to colour it.
    pub(super) fn with_their_place(&self, ids: &[RecordId]) -> Result<Vec<RecordId>, Error> {
        let mut all = ids.to_vec();
        for id in ids {
            let document = self.store.get(*id)?;
            if ![kind::CLOUD, kind::SCAN].contains(&document.kind.as_str()) {
                continue;
            }
            let of = |kind: &str| Query { robot: named(&document.robot), ..Query::of_kind(kind) };
            let near = Query {
                from_ns: Some(document.stamp_ns.saturating_sub(self.options.group_ns)),
                to_ns: Some(document.stamp_ns),
                ..of(kind::TRANSFORMS)
            };
            let beside = Query {
                frame: Some(document.frame.clone()),
                from_ns: Some(document.stamp_ns),
                to_ns: Some(document.stamp_ns),
                ..of(kind::IMAGE)
            };
            for query in [near, of(kind::STATIC_TRANSFORM), beside] {
                all.extend(self.store.find(&query)?.iter().map(|d| d.id));
            }
        }
        all.sort_unstable();
        all.dedup();
        Ok(all)
    }

    /// Parent frame and samples of a document of transforms.
    fn samples(&self, document: &Document) -> Result<(String, Vec<Sample>), Error> {
        let damaged = |what: &str| Error::Damaged {
            place: format!("record {}", document.id).into(),
            at: 0,
            what: what.into(),
        };
        let parent = document
            .body
            .get("parent")
            .and_then(Value::as_str)
            .ok_or_else(|| damaged("transforms without a parent"))?;
        let bytes = self.store.blob(document.id, "tf")?;
        let samples =
            foxglove::read_frame_transforms(&bytes).ok_or_else(|| damaged("these are no transforms"))?;
        Ok((parent.to_owned(), samples))
    }

    /// True if the record that is being repeated holds this transform already.
    ///
    /// # Errors
    /// [`Error::Input`] if the record holds a different transform at that time: data placed by one would be
    /// misplaced by the other.
    pub(super) fn is_measured(&self, parent: &str, child: &str, sample: &Sample) -> Result<bool, Error> {
        let stamp_ns = sample.stamp_ns;
        if self.retrace.as_ref().is_none_or(|r| stamp_ns > r.newest_ns) {
            return Ok(false);
        }
        let at = Query {
            frame: Some(child.into()),
            from_ns: Some(stamp_ns),
            to_ns: Some(stamp_ns),
            ..self.own(kind::TRANSFORMS)
        };
        for document in self.store.find(&at)? {
            let (of, samples) = self.samples(&document)?;
            let Some(found) = samples.iter().find(|s| of == parent && s.stamp_ns == stamp_ns) else {
                continue;
            };
            let (here, there) = (&sample.parent_from_child, &found.parent_from_child);
            if (here.to_homogeneous() - there.to_homogeneous()).amax() > SAME_TRANSFORM {
                return Err(Error::Input {
                    what: format!("{child} stood elsewhere in {parent} at {stamp_ns} ns, as record {} has it", document.id),
                    mend: "what was recorded of that moment does not go with what is recorded now; begin a new record".into(),
                });
            }
            return Ok(true);
        }
        Ok(false)
    }
}

/// Maximum difference between entries of transform matrices that count as equal, after writing and reading.
const SAME_TRANSFORM: f64 = 1e-6;

/// Condition of a query on the robot; `None` for an empty name.
pub(super) fn named(robot: &str) -> Option<String> {
    (!robot.is_empty()).then(|| robot.to_owned())
}
