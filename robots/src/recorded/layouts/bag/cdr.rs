//! Decoder of CDR, the encoding of ROS 2 messages, and the message types that are read from a bag.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Reason for which a message cannot be decoded.
pub(super) type Fault = String;

/// Bytes of a message, read from front to back.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
}

/// Time stamp and coordinate frame of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub stamp_s: f64,
    pub frame: String,
}

/// `sensor_msgs/Image`; its pixels are borrowed from the message.
pub(super) struct Image<'a> {
    pub header: Header,
    pub width: usize,
    pub height: usize,
    pub encoding: String,
    pub big_endian: bool,
    /// Length of a row, bytes.
    pub step: usize,
    pub data: &'a [u8],
}

/// `sensor_msgs/CompressedImage`.
pub(super) struct Compressed<'a> {
    pub header: Header,
    pub format: String,
    pub data: &'a [u8],
}

/// `sensor_msgs/CameraInfo`, as far as needed here.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CameraInfo {
    pub header: Header,
    pub width: usize,
    pub height: usize,
    pub distortion: Vec<f64>,
    /// Camera matrix, row by row.
    pub matrix: [f64; 9],
}

/// `geometry_msgs/TransformStamped`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Transform {
    pub header: Header,
    pub child: String,
    pub parent_from_child: Isometry3<f64>,
}

impl<'a> Cdr<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Result<Cdr<'a>, Fault> {
        match bytes {
            [0, kind @ (0 | 1), _, _, rest @ ..] => Ok(Cdr { bytes: rest, at: 0, little: *kind == 1 }),
            _ => Err("expected a message in CDR".into()),
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let found = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        let found = found
            .ok_or_else(|| format!("it ends after {} bytes, expected {count} more", self.bytes.len()))?;
        self.at += count;
        Ok(found)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.at = self.at.next_multiple_of(N);
        let mut raw: [u8; N] = self.take(N)?.try_into().map_err(|_| "no number".to_string())?;
        if !self.little {
            raw.reverse();
        }
        Ok(raw)
    }

    fn u8(&mut self) -> Result<u8, Fault> {
        Ok(self.take(1)?[0])
    }

    fn u32(&mut self) -> Result<u32, Fault> {
        Ok(u32::from_le_bytes(self.number()?))
    }

    fn f64(&mut self) -> Result<f64, Fault> {
        Ok(f64::from_le_bytes(self.number()?))
    }

    fn bytes(&mut self) -> Result<&'a [u8], Fault> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    fn text(&mut self) -> Result<String, Fault> {
        let bytes = self.bytes()?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| "expected text in UTF-8".into())
    }

    fn header(&mut self) -> Result<Header, Fault> {
        let seconds = i32::from_le_bytes(self.number()?);
        let nanoseconds = self.u32()?;
        let stamp_s = f64::from(seconds) + f64::from(nanoseconds) * 1e-9;
        // Old drivers write frames as ROS 1 did, with a slash before them.
        Ok(Header { stamp_s, frame: self.text()?.trim_start_matches('/').into() })
    }

    pub(super) fn image(mut self) -> Result<Image<'a>, Fault> {
        let header = self.header()?;
        let (height, width) = (self.u32()? as usize, self.u32()? as usize);
        let encoding = self.text()?;
        let big_endian = self.u8()? != 0;
        let step = self.u32()? as usize;
        let data = self.bytes()?;
        if step.checked_mul(height).is_none_or(|all| all > data.len()) {
            return Err(format!("{} bytes of pixels for {height} rows of {step}", data.len()));
        }
        Ok(Image { header, width, height, encoding, big_endian, step, data })
    }

    pub(super) fn compressed(mut self) -> Result<Compressed<'a>, Fault> {
        Ok(Compressed { header: self.header()?, format: self.text()?, data: self.bytes()? })
    }

    pub(super) fn camera_info(mut self) -> Result<CameraInfo, Fault> {
        let header = self.header()?;
        let (height, width) = (self.u32()? as usize, self.u32()? as usize);
        self.text()?;
        let count = self.u32()?;
        let distortion = (0..count).map(|_| self.f64()).collect::<Result<_, _>>()?;
        let mut matrix = [0.0; 9];
        for entry in &mut matrix {
            *entry = self.f64()?;
        }
        Ok(CameraInfo { header, width, height, distortion, matrix })
    }

    pub(super) fn transforms(mut self) -> Result<Vec<Transform>, Fault> {
        let count = self.u32()?;
        (0..count).map(|_| self.transform()).collect()
    }

    fn transform(&mut self) -> Result<Transform, Fault> {
        let header = self.header()?;
        let child = self.text()?.trim_start_matches('/').into();
        let shift_m = [self.f64()?, self.f64()?, self.f64()?];
        let xyzw = [self.f64()?, self.f64()?, self.f64()?, self.f64()?];
        let quaternion = Quaternion::from(xyzw);
        let is_rotation = (quaternion.norm() - 1.0).abs() < 0.01;
        if !is_rotation || !shift_m.iter().all(|v| v.is_finite()) {
            return Err(format!("the transform to {child} is none: shift {shift_m:?}, quaternion {xyzw:?}"));
        }
        let rotation = UnitQuaternion::from_quaternion(quaternion);
        let parent_from_child = Isometry3::from_parts(Translation3::from(shift_m), rotation);
        Ok(Transform { header, child, parent_from_child })
    }
}
