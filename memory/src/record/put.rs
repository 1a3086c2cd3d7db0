//! Writing of sensor data, transforms, documents and log lines.

use super::{Image, Record, kind};
use crate::clouds::{self, Sensing};
use crate::document::{Blob, Draft, Form, Meta, RecordId};
use crate::error::Error;
use crate::flusher::Group;
use crate::foxglove::LogLevel;
use crate::scans;
use crate::transforms::{self, Sample};
use crate::viewer;
use descry_perception::Cloud;
use descry_perception::laser::Scan;
use nalgebra::Isometry3;
use serde_json::{Value, json};
use std::sync::PoisonError;

impl Record {
    /// Records a cloud, in `frame` (a camera's optical frame, for [`Record::view_at`]).
    ///
    /// # Errors
    /// [`Error::Input`] if the parts of the cloud do not fit together; [`Error::Full`].
    pub fn put_cloud(
        &self,
        stamp_ns: i64,
        frame: &str,
        cloud: &Cloud,
        sensing: &Sensing,
        meta: Meta,
    ) -> Result<RecordId, Error> {
        cloud.check().map_err(|e| Error::Input { what: e.to_string(), mend: "mend the cloud".into() })?;
        let camera = sensing.intrinsics.as_ref().map(|camera| viewer::calibration(stamp_ns, frame, camera));
        let blobs = std::iter::once(clouds::encode(cloud, sensing)).chain(camera).collect();
        self.put(Draft { frame: frame.into(), meta, blobs, ..Draft::new(kind::CLOUD, stamp_ns) })
    }

    /// Records a laser sweep in `frame`; the transforms of its time give its pose.
    ///
    /// # Errors
    /// [`Error::Input`] if the sweep is inconsistent, or its angles are not evenly spaced; [`Error::Full`].
    pub fn put_scan(&self, stamp_ns: i64, frame: &str, scan: &Scan, meta: Meta) -> Result<RecordId, Error> {
        let blobs = vec![scans::encode(scan)?];
        self.put(Draft { frame: frame.into(), meta, blobs, ..Draft::new(kind::SCAN, stamp_ns) })
    }

    /// Records an image, in `frame`.
    ///
    /// # Errors
    /// [`Error::Input`] if the pixels do not fit the size of the image; [`Error::Full`].
    pub fn put_image(&self, stamp_ns: i64, frame: &str, image: Image, meta: Meta) -> Result<RecordId, Error> {
        self.put(image_draft(stamp_ns, frame, image, meta)?)
    }

    /// Enqueues an image to be written with the next record; see [`Record::put_soon`].
    ///
    /// # Errors
    /// As [`Record::put_image`].
    pub fn put_image_soon(&self, stamp_ns: i64, frame: &str, image: Image, meta: Meta) -> Result<(), Error> {
        let Draft { kind, end_ns, frame, kept, meta, blobs, .. } = image_draft(stamp_ns, frame, image, meta)?;
        let blobs =
            blobs.into_iter().map(|blob| Blob { data: blob.data.into_owned().into(), ..blob }).collect();
        self.put_soon(Draft { kind, stamp_ns, end_ns, frame, kept, meta, blobs })
    }

    /// Records a transform. Lookups see the transform at once; it reaches the disk when its group is full or
    /// at [`Record::sync`].
    ///
    /// # Errors
    /// [`transforms::TransformError::Invalid`], or the failure of an earlier group to reach the disk; then
    /// this transform was not accepted.
    pub fn put_transform(
        &self,
        stamp_ns: i64,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), Error> {
        if self.flusher.has_failed() {
            self.flusher.drain()?;
        }
        let sample = Sample { stamp_ns, parent_from_child: *parent_from_child };
        if !self.is_news(parent, child, &sample)? {
            return Ok(());
        }
        let span = stamp_ns / self.options.group_ns.max(1);
        let mut groups = self.groups.lock().unwrap_or_else(PoisonError::into_inner);
        // Stamps of several sources interleave; only a later span closes the open one.
        if span > groups.span {
            self.flusher.send(groups.take());
            groups.span = span;
        }
        groups.open.entry((child.into(), parent.into())).or_default().push(sample);
        Ok(())
    }

    /// Enqueues a transform to be written with the next record; see [`Record::put_soon`].
    ///
    /// # Errors
    /// As [`Record::put_transform`].
    pub fn put_transform_soon(
        &self,
        stamp_ns: i64,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), Error> {
        let sample = Sample { stamp_ns, parent_from_child: *parent_from_child };
        if !self.is_news(parent, child, &sample)? {
            return Ok(());
        }
        let group = Group { parent: parent.into(), child: child.into(), samples: vec![sample] };
        // What is there already was told by its stamp, not by its turn.
        self.hold_back(group.draft(kind::TRANSFORMS));
        Ok(())
    }

    /// True if a transform is not yet in the record.
    ///
    /// # Errors
    /// If the transform is invalid, or contradicts a recorded one.
    fn is_news(&self, parent: &str, child: &str, sample: &Sample) -> Result<bool, Error> {
        let stamp_ns = sample.stamp_ns;
        transforms::check(stamp_ns, parent, child, &sample.parent_from_child)?;
        if stamp_ns < 0 {
            return Err(Error::Input {
                what: format!("the stamp {stamp_ns} ns is negative"),
                mend: "count from the start of the recording".into(),
            });
        }
        Ok(!self.is_measured(parent, child, sample)?)
    }

    /// Records a static transform, which holds at all times without a measured one.
    ///
    /// # Errors
    /// [`transforms::TransformError::Invalid`], [`Error::Full`].
    pub fn put_static_transform(
        &self,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<RecordId, Error> {
        transforms::check(0, parent, child, parent_from_child)?;
        let sample = Sample { stamp_ns: 0, parent_from_child: *parent_from_child };
        let group = Group { parent: parent.into(), child: child.into(), samples: vec![sample] };
        self.put(group.draft(kind::STATIC_TRANSFORM))
    }

    /// Records a document of any kind, with its blobs.
    ///
    /// # Errors
    /// [`Error::Input`] for content that could not be found again; [`Error::Full`].
    pub fn put_document(
        &self,
        kind: &str,
        stamp_ns: i64,
        body: Value,
        blobs: Vec<Blob>,
    ) -> Result<RecordId, Error> {
        self.put(Draft { meta: Meta { body, ..Meta::default() }, blobs, ..Draft::new(kind, stamp_ns) })
    }

    /// Records a line of the log from the source `name`.
    ///
    /// # Errors
    /// [`Error::Full`].
    pub fn put_log(
        &self,
        stamp_ns: i64,
        level: LogLevel,
        name: &str,
        message: &str,
    ) -> Result<RecordId, Error> {
        let meta = Meta {
            body: json!({ "level": format!("{level:?}").to_lowercase(), "name": name, "message": message }),
            ..Meta::default()
        };
        let blobs = vec![viewer::log(stamp_ns, level, name, message)];
        self.put(Draft { meta, blobs, ..Draft::new(kind::LOG, stamp_ns) })
    }
}

/// Converts an image to the draft of a record.
fn image_draft<'a>(stamp_ns: i64, frame: &str, image: Image<'a>, meta: Meta) -> Result<Draft<'a>, Error> {
    let (form, layout, data) = match image {
        Image::Compressed { format, data } => (Form::CompressedImage, json!({ "format": format }), data),
        Image::Raw { width, height, encoding, data } => {
            let step = data.len() / height.max(1) as usize;
            if width == 0
                || step == 0
                || step * height as usize != data.len()
                || !step.is_multiple_of(width as usize)
            {
                return Err(Error::Input {
                    what: format!("{} bytes are no image of {width} x {height} pixels", data.len()),
                    mend: "give every row the same number of bytes, and each pixel as well".into(),
                });
            }
            (
                Form::RawImage,
                json!({ "width": width, "height": height, "encoding": encoding, "step": step }),
                data,
            )
        }
    };
    let blobs = vec![Blob { name: "image".into(), form, layout, data: data.into() }];
    Ok(Draft { frame: frame.into(), meta, blobs, ..Draft::new(kind::IMAGE, stamp_ns) })
}
