//! Header of a PCD file.

use crate::files::error::{FileError, Place};
use crate::files::loaded::is_padding;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Encoding of the points, the header's DATA entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PcdEncoding {
    /// Text, one point per line.
    Ascii,
    /// Binary, point after point, little endian.
    Binary,
    /// Binary, field after field, compressed with LZF.
    BinaryCompressed,
}

/// Field of a point: `count` values of `size` bytes each.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub name: String,
    pub size: usize,
    /// Type of the values: `F` (float), `I` (signed) or `U` (unsigned).
    pub kind: u8,
    pub count: usize,
}

impl Field {
    pub(super) fn bytes(&self) -> usize {
        self.size * self.count
    }

    /// Value stored in the first `size` bytes of `raw`, little endian.
    pub(super) fn number(&self, raw: [u8; 8]) -> f64 {
        let low = u64::from_le_bytes(raw);
        let unused = 64 - 8 * self.size as u32;
        match (self.kind, self.size) {
            (b'F', 4) => f64::from(f32::from_bits(low as u32)),
            (b'F', _) => f64::from_bits(low),
            (b'I', _) => ((low << unused) as i64 >> unused) as f64,
            _ => low as f64,
        }
    }

    /// Appends the binary form of a number given as text; `None` if the text is no such number. Colours of kind `F`
    /// occur both as packed integers and as floats of the same bits.
    pub(super) fn encode(&self, token: &str, out: &mut Vec<u8>) -> Option<()> {
        let colour = matches!(self.name.as_str(), "rgb" | "rgba") && self.size == 4;
        let packed = colour.then(|| token.parse::<u32>().ok()).flatten();
        let bits = match (self.kind, self.size, packed) {
            (_, _, Some(packed)) => u64::from(packed),
            (b'F', 4, _) => u64::from(token.parse::<f32>().ok()?.to_bits()),
            (b'F', _, _) => token.parse::<f64>().ok()?.to_bits(),
            (b'I', size, _) => {
                let value = token.parse::<i64>().ok()?;
                let unused = 64 - 8 * size as u32;
                ((value << unused) >> unused == value).then_some(value as u64)?
            }
            (_, size, _) => {
                let value = token.parse::<u64>().ok()?;
                (size == 8 || value >> (8 * size) == 0).then_some(value)?
            }
        };
        out.extend_from_slice(&bits.to_le_bytes()[..self.size]);
        Some(())
    }
}

#[derive(Clone, Debug)]
pub(super) struct Header {
    pub fields: Vec<Field>,
    pub fields_line: usize,
    pub width: usize,
    pub height: usize,
    pub points: usize,
    pub viewpoint: Isometry3<f64>,
    pub encoding: PcdEncoding,
    /// Offset of the first byte of data.
    pub data_at: usize,
    /// Number of the first line of data.
    pub data_line: usize,
    pub notes: Vec<String>,
}

impl Header {
    /// Number of bytes per point; the parser limits it, so that it cannot overflow.
    pub(super) fn stride(&self) -> usize {
        self.fields.iter().map(Field::bytes).sum()
    }

    /// Offset of each field within a point, bytes.
    pub(super) fn offsets(&self) -> impl Iterator<Item = usize> {
        self.fields.iter().scan(0, |at, f| {
            let begin = *at;
            *at += f.bytes();
            Some(begin)
        })
    }

    pub(super) fn too_short(&self, found: usize, needed: usize) -> FileError {
        FileError::new(
            Place::Byte(self.data_at.saturating_add(found)),
            format!("{needed} bytes of data for {} points", self.points),
            format!("the end of the file after {found}"),
            "the file was cut: write it again, or lower POINTS, WIDTH and HEIGHT",
        )
    }

    /// Rejects `data` that continue for a point or more after `needed` bytes, as the header then declares too few
    /// points; zeros are padding.
    pub(super) fn ends_with(&self, data: &[u8], needed: usize) -> Result<(), FileError> {
        let rest = data.get(needed..).unwrap_or_default();
        let more = rest.len() / self.stride();
        if more == 0 || is_padding(rest) {
            return Ok(());
        }
        Err(FileError::new(
            Place::Byte(self.data_at.saturating_add(needed)),
            format!("the end of {} points, as the header declares", self.points),
            format!("{} bytes more, as {more} points have", rest.len()),
            "set POINTS, WIDTH and HEIGHT to what is there, or write the file again",
        ))
    }
}

/// Header entries, each with its line number and its values.
#[derive(Default)]
struct Said<'a> {
    fields: Option<(usize, Vec<&'a str>)>,
    size: Option<(usize, Vec<&'a str>)>,
    kind: Option<(usize, Vec<&'a str>)>,
    count: Option<(usize, Vec<&'a str>)>,
    width: Option<(usize, Vec<&'a str>)>,
    height: Option<(usize, Vec<&'a str>)>,
    points: Option<(usize, Vec<&'a str>)>,
    viewpoint: Option<(usize, Vec<&'a str>)>,
}

/// Maximum length of a header line, bytes; guards against reading binary data as a header.
const LONGEST_LINE: usize = 1 << 16;
/// Maximum number of bytes per point.
const WIDEST_POINT: usize = 1 << 20;

pub(super) fn parse(bytes: &[u8]) -> Result<Header, FileError> {
    let mut said = Said::default();
    let mut at = 0;
    let mut number = 0;
    while at < bytes.len() {
        number += 1;
        let place = Place::Line(number);
        let line = &bytes[at..];
        let end = line.iter().take(LONGEST_LINE).position(|&b| b == b'\n').unwrap_or(line.len());
        let text = std::str::from_utf8(&line[..end.min(LONGEST_LINE)]).map_err(|_| {
            FileError::new(place, "a line of a PCD header", "bytes that are no text", "is this a PCD file?")
        })?;
        at = (at + end + 1).min(bytes.len());
        let mut words = text.split_ascii_whitespace();
        let Some(word) = words.next().filter(|w| !w.starts_with('#')) else { continue };
        let rest: Vec<&str> = words.collect();
        let slot = match word {
            "VERSION" => continue,
            "FIELDS" | "COLUMNS" => &mut said.fields,
            "SIZE" => &mut said.size,
            "TYPE" => &mut said.kind,
            "COUNT" => &mut said.count,
            "WIDTH" => &mut said.width,
            "HEIGHT" => &mut said.height,
            "POINTS" => &mut said.points,
            "VIEWPOINT" => &mut said.viewpoint,
            "DATA" => {
                let encoding = encoding(&rest, place)?;
                return said.header(encoding, at, number + 1);
            }
            other => {
                let names = "VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS or DATA";
                let shown: String = other.chars().take(40).collect();
                return Err(FileError::new(
                    place,
                    names,
                    format!("{shown:?}"),
                    "is this a PCD file? (PLY begins with \"ply\")",
                ));
            }
        };
        match slot {
            Some((first, before)) if *before != rest => {
                return Err(FileError::new(
                    place,
                    format!("one line {word}, and that is line {first}"),
                    format!("another with {:?}", rest.join(" ")),
                    "leave out the one that is wrong",
                ));
            }
            _ => *slot = Some((number, rest)),
        }
    }
    Err(FileError::new(Place::Line(number + 1), "a line DATA", "the end of the file", "the header is cut"))
}

fn encoding(rest: &[&str], place: Place) -> Result<PcdEncoding, FileError> {
    match rest.first().map(|w| w.to_ascii_lowercase()).as_deref() {
        Some("ascii") => Ok(PcdEncoding::Ascii),
        Some("binary") => Ok(PcdEncoding::Binary),
        Some("binary_compressed") => Ok(PcdEncoding::BinaryCompressed),
        other => Err(FileError::new(
            place,
            "DATA ascii, binary or binary_compressed",
            format!("{:?}", other.unwrap_or("nothing")),
            "write the file in one of the three",
        )),
    }
}

impl Said<'_> {
    fn header(self, encoding: PcdEncoding, data_at: usize, data_line: usize) -> Result<Header, FileError> {
        let last = Place::Line(data_line - 1);
        let missing = |name: &str| {
            FileError::new(last, format!("a line {name} before DATA"), "none", "complete the header")
        };
        let (fields_line, fields) = self.fields()?.ok_or_else(|| missing("FIELDS"))?;
        let stride = fields.iter().try_fold(0usize, |sum, f| sum.checked_add(f.size.checked_mul(f.count)?));
        if stride.is_none_or(|s| s == 0 || s > WIDEST_POINT) {
            return Err(FileError::new(
                Place::Line(fields_line),
                format!("points of 1 to {WIDEST_POINT} bytes"),
                "another size",
                "check SIZE and COUNT",
            ));
        }
        let mut notes = Vec::new();
        let (width, height, points) = self.size(&missing)?;
        let viewpoint = self.viewpoint(&mut notes)?;
        Ok(Header {
            fields,
            fields_line,
            width,
            height,
            points,
            viewpoint,
            encoding,
            data_at,
            data_line,
            notes,
        })
    }

    fn size(&self, missing: &dyn Fn(&str) -> FileError) -> Result<(usize, usize, usize), FileError> {
        let whole = |slot: &Option<(usize, Vec<&str>)>, name: &str| -> Result<Option<usize>, FileError> {
            let Some((line, words)) = slot else { return Ok(None) };
            let value = words.first().and_then(|w| w.parse::<u32>().ok());
            let bad = || {
                FileError::new(
                    Place::Line(*line),
                    format!("{name} and a whole number"),
                    format!("{:?}", words.join(" ")),
                    "clouds hold up to 4,294,967,295 points",
                )
            };
            value.map(|v| Some(v as usize)).ok_or_else(bad)
        };
        let points = whole(&self.points, "POINTS")?;
        let width = whole(&self.width, "WIDTH")?;
        let height = whole(&self.height, "HEIGHT")?;
        let (width, height) = match (width, height, points) {
            (Some(w), Some(h), _) => (w, h),
            (Some(w), None, _) => (w, 1),
            (None, _, Some(n)) => (n, 1),
            (None, _, None) => return Err(missing("WIDTH")),
        };
        let held = width.checked_mul(height);
        let points = points.or(held).unwrap_or(usize::MAX);
        if held != Some(points) || points > u32::MAX as usize {
            let line = self.points.as_ref().or(self.width.as_ref()).map_or(1, |(line, _)| *line);
            return Err(FileError::new(
                Place::Line(line),
                format!("POINTS to be WIDTH x HEIGHT = {width} x {height}"),
                points.to_string(),
                "make the three agree",
            ));
        }
        Ok((width, height, points))
    }

    fn fields(&self) -> Result<Option<(usize, Vec<Field>)>, FileError> {
        let Some((line, names)) = &self.fields else { return Ok(None) };
        let column = |slot: &Option<(usize, Vec<&str>)>,
                      what: &str,
                      default: &str|
         -> Result<Vec<String>, FileError> {
            let Some((line, words)) = slot else { return Ok(vec![default.to_string(); names.len()]) };
            if words.len() != names.len() {
                return Err(FileError::new(
                    Place::Line(*line),
                    format!("{} values of {what}, one a field", names.len()),
                    words.len().to_string(),
                    "FIELDS, SIZE, TYPE and COUNT have as many entries each",
                ));
            }
            Ok(words.iter().map(|w| w.to_string()).collect())
        };
        let sizes = column(&self.size, "SIZE", "4")?;
        let kinds = column(&self.kind, "TYPE", "F")?;
        let counts = column(&self.count, "COUNT", "1")?;
        let mut fields = Vec::with_capacity(names.len());
        for (i, name) in names.iter().enumerate() {
            let allowed = matches!(
                (kinds[i].as_str(), sizes[i].as_str()),
                ("F", "4" | "8") | ("I" | "U", "1" | "2" | "4" | "8")
            );
            let count = counts[i].parse::<usize>().ok().filter(|&c| c > 0 || *name == "_");
            let (true, Ok(size), Some(count)) = (allowed, sizes[i].parse(), count) else {
                return Err(FileError::new(
                    Place::Line(*line),
                    format!("field {name} of type F (4, 8 bytes), I or U (1, 2, 4, 8 bytes) and a count"),
                    format!("TYPE {} SIZE {} COUNT {}", kinds[i], sizes[i], counts[i]),
                    "mend TYPE, SIZE or COUNT",
                ));
            };
            fields.push(Field { name: name.to_string(), size, kind: kinds[i].as_bytes()[0], count });
        }
        Ok(Some((*line, fields)))
    }

    fn viewpoint(&self, notes: &mut Vec<String>) -> Result<Isometry3<f64>, FileError> {
        let Some((line, words)) = &self.viewpoint else { return Ok(Isometry3::identity()) };
        let number = |w: &&str| w.parse().ok().filter(|v: &f64| v.is_finite());
        let numbers: Option<Vec<f64>> = words.iter().map(number).collect();
        let Some(&[x, y, z, qw, qx, qy, qz]) = numbers.as_deref() else {
            return Err(FileError::new(
                Place::Line(*line),
                "VIEWPOINT tx ty tz qw qx qy qz",
                format!("{:?}", words.join(" ")),
                "give seven numbers, or drop the line",
            ));
        };
        let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-9).unwrap_or_else(|| {
            notes.push("the rotation of VIEWPOINT is zero and was taken as none".to_string());
            UnitQuaternion::identity()
        });
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }
}
