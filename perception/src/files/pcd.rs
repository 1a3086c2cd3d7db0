//! PCD 0.5 to 0.7 of the Point Cloud Library: `ascii`, `binary` and `binary_compressed`, with fields in any order, type
//! and count.

mod header;

use super::error::{FileError, Place};
use super::loaded::{Loaded, finish};
use super::lzf;
use crate::cloud::{Cloud, Grid};
pub use header::PcdEncoding;
use header::{Field, Header};
use nalgebra::{Point3, Vector3};
use std::borrow::Cow;

/// Reads a PCD file. Fields used: `x y z`, `rgb` or `rgba` (packed), `normal_x normal_y normal_z`, `label`; a note
/// lists the ignored ones.
///
/// # Errors
/// If the header or the data are damaged, with the line or byte, what was expected, and what to do.
pub fn read(bytes: &[u8]) -> Result<Loaded, FileError> {
    let header = header::parse(bytes)?;
    let data = &bytes[header.data_at..];
    let place = Place::Byte(header.data_at);
    let table = match header.encoding {
        PcdEncoding::Ascii => Table::from_text(&header, data)?,
        PcdEncoding::Binary => Table::from_rows(&header, data)?,
        PcdEncoding::BinaryCompressed => Table::from_columns(&header, data)?,
    };
    let mut notes = header.notes.clone();
    let cloud = table.cloud(&header, &mut notes)?;
    finish(cloud, header.viewpoint, notes, place)
}

/// Bytes of all points. A field of point `i` begins at `offset + i * step`.
struct Table<'a> {
    bytes: Cow<'a, [u8]>,
    /// Offset and step of each field, bytes.
    layout: Vec<(usize, usize)>,
}

impl<'a> Table<'a> {
    fn from_rows(header: &Header, data: &'a [u8]) -> Result<Table<'a>, FileError> {
        let stride = header.stride();
        let needed = header.points.saturating_mul(stride);
        let bytes = data.get(..needed).ok_or_else(|| header.too_short(data.len(), needed))?;
        header.ends_with(data, needed)?;
        let layout = header.offsets().map(|offset| (offset, stride)).collect();
        Ok(Table { bytes: bytes.into(), layout })
    }

    fn from_columns(header: &Header, data: &[u8]) -> Result<Table<'a>, FileError> {
        let needed = header.points.saturating_mul(header.stride());
        let word = |at: usize| -> Option<usize> {
            Some(u32::from_le_bytes(data.get(at..at + 4)?.try_into().ok()?) as usize)
        };
        let (Some(packed), Some(unpacked)) = (word(0), word(4)) else {
            return Err(header.too_short(data.len(), 8));
        };
        if unpacked != needed {
            return Err(FileError::new(
                Place::Byte(header.data_at + 4),
                format!("{needed} unpacked bytes for {} points", header.points),
                format!("a size of {unpacked}"),
                "header and data do not belong together: write the file again",
            ));
        }
        let stream =
            data.get(8..8usize.saturating_add(packed)).ok_or_else(|| header.too_short(data.len(), packed))?;
        header.ends_with(data, 8 + packed)?;
        let bytes = lzf::unpack(stream, needed).map_err(|e| {
            let place = Place::Byte(header.data_at + 8 + e.at());
            FileError::new(place, "an LZF stream", e.to_string(), "the file is damaged: write it again")
        })?;
        let layout =
            header.offsets().zip(&header.fields).map(|(o, f)| (o * header.points, f.bytes())).collect();
        Ok(Table { bytes: bytes.into(), layout })
    }

    fn from_text(header: &Header, data: &[u8]) -> Result<Table<'a>, FileError> {
        let stride = header.stride();
        // Each point needs at least a line.
        if header.points > data.len() {
            return Err(header.too_short(data.len(), header.points));
        }
        let mut bytes = Vec::with_capacity(header.points.saturating_mul(stride).min(data.len()));
        let mut rows = 0;
        for (number, line) in data.split(|&b| b == b'\n').enumerate() {
            let line = std::str::from_utf8(line).unwrap_or("\u{fffd}");
            if line.trim().is_empty() || line.trim_start().starts_with('#') {
                continue;
            }
            rows += 1;
            if rows > header.points {
                continue;
            }
            parse_row(&header.fields, line, Place::Line(header.data_line + number), &mut bytes)?;
        }
        if rows != header.points {
            return Err(FileError::new(
                Place::Byte(header.data_at + data.len()),
                format!("{} lines of points, as the header declares", header.points),
                format!("{rows}"),
                "set POINTS, WIDTH and HEIGHT to what is there, or write the file again",
            ));
        }
        let layout = header.offsets().map(|offset| (offset, stride)).collect();
        Ok(Table { bytes: bytes.into(), layout })
    }

    /// First `size` bytes (at most eight) of a field of a point, extended with zeros to eight.
    fn raw(&self, field: usize, size: usize, point: usize) -> [u8; 8] {
        let (begin, step) = self.layout[field];
        let at = begin + step * point;
        let mut out = [0; 8];
        out[..size].copy_from_slice(&self.bytes[at..at + size]);
        out
    }

    fn column<T>(
        &self,
        header: &Header,
        field: usize,
        convert: impl Fn([u8; 8]) -> T,
    ) -> impl Iterator<Item = T> {
        let size = header.fields[field].size;
        (0..header.points).map(move |i| convert(self.raw(field, size, i)))
    }

    fn number(&self, header: &Header, field: usize) -> impl Iterator<Item = f64> {
        let kind = header.fields[field].clone();
        self.column(header, field, move |raw| kind.number(raw))
    }

    /// First four bytes of a field, for each point.
    fn words(&self, header: &Header, field: usize) -> impl Iterator<Item = [u8; 4]> {
        let (begin, step) = self.layout[field];
        let of_points = self.bytes.get(begin..).unwrap_or_default().chunks(step).take(header.points);
        of_points.map(|bytes| bytes.first_chunk().copied().unwrap_or_default())
    }

    fn cloud(&self, header: &Header, notes: &mut Vec<String>) -> Result<Cloud, FileError> {
        let find = |name: &str| header.fields.iter().position(|f| f.name == name);
        let need = |name: &str| {
            find(name).ok_or_else(|| {
                let found = header.fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>().join(" ");
                FileError::new(
                    Place::Line(header.fields_line),
                    format!("a field {name}"),
                    found,
                    "a cloud has fields x, y and z",
                )
            })
        };
        let (x, y, z) = (need("x")?, need("y")?, need("z")?);
        let points = self.triples(header, [x, y, z], Point3::from);
        let colour = find("rgb").or_else(|| find("rgba")).filter(|&c| header.fields[c].size == 4);
        let colours =
            colour.map(|c| self.words(header, c).map(|[blue, green, red, _]| [red, green, blue]).collect());
        let normal = [find("normal_x"), find("normal_y"), find("normal_z")];
        let normals = match normal {
            [Some(a), Some(b), Some(c)] => Some(self.triples(header, [a, b, c], Vector3::from)),
            _ => None,
        };
        let label = find("label");
        let labels = label.map(|l| match (header.fields[l].kind, header.fields[l].size) {
            (b'U', 4) => self.words(header, l).map(u32::from_le_bytes).collect(),
            _ => self.number(header, l).map(|v| v as u32).collect(),
        });
        let used = [Some(x), Some(y), Some(z), colour, label];
        let left: Vec<&str> = header
            .fields
            .iter()
            .enumerate()
            .filter(|(i, f)| {
                f.name != "_"
                    && !used.contains(&Some(*i))
                    && !(normals.is_some() && normal.contains(&Some(*i)))
            })
            .map(|(_, f)| f.name.as_str())
            .collect();
        if !left.is_empty() {
            notes.push(format!("fields left out: {}", left.join(" ")));
        }
        let grid = (header.height > 1).then_some(Grid { width: header.width, height: header.height });
        Ok(Cloud { points, grid, colours, normals, labels })
    }

    /// Values combined from three fields of each point, in the order of the points.
    fn triples<T>(&self, header: &Header, fields: [usize; 3], make: impl Fn([f32; 3]) -> T) -> Vec<T> {
        let single = |f: usize| header.fields[f].kind == b'F' && header.fields[f].size == 4;
        if fields.into_iter().all(single) {
            let [a, b, c] = fields.map(|f| self.layout[f]);
            if [b, c] == [(a.0 + 4, a.1), (a.0 + 8, a.1)] && a.1 >= 12 {
                // Beside each other in each row, as nearly always.
                let rows = self.bytes.get(a.0..).unwrap_or_default().chunks(a.1).take(header.points);
                let row = |row: &[u8]| {
                    let (words, _) = row.as_chunks::<4>();
                    make(words.first_chunk().map_or([f32::NAN; 3], |words| words.map(f32::from_le_bytes)))
                };
                return rows.map(row).collect();
            }
            let [a, b, c] = fields.map(|f| self.words(header, f).map(f32::from_le_bytes));
            return a.zip(b).zip(c).map(|((a, b), c)| make([a, b, c])).collect();
        }
        let [a, b, c] = fields.map(|f| self.number(header, f));
        a.zip(b).zip(c).map(|((a, b), c)| make([a as f32, b as f32, c as f32])).collect()
    }
}

/// Appends the binary form of a text line that holds one point.
fn parse_row(fields: &[Field], line: &str, place: Place, out: &mut Vec<u8>) -> Result<(), FileError> {
    let mut tokens = line.split_ascii_whitespace();
    for field in fields {
        for _ in 0..field.count {
            let bad = |found: &str| {
                FileError::new(
                    place,
                    format!("a number for field {}", field.name),
                    found,
                    "one line holds one point, one number a field",
                )
            };
            let token = tokens.next().ok_or_else(|| bad("the end of the line"))?;
            field.encode(token, out).ok_or_else(|| bad(&format!("{token:?}")))?;
        }
    }
    match tokens.next() {
        None => Ok(()),
        Some(extra) => Err(FileError::new(
            place,
            "the end of the line",
            format!("{extra:?}"),
            "FIELDS and COUNT must name every column",
        )),
    }
}

/// Encodes a cloud as PCD 0.7: fields `x y z` (F 4), then `rgb` (U 4), `normal_x normal_y normal_z` (F 4) and `label`
/// (U 4) if the cloud has them.
pub fn write(cloud: &Cloud, encoding: PcdEncoding) -> Vec<u8> {
    let columns = columns(cloud);
    let points = cloud.len();
    let (width, height) = cloud.grid.map_or((points, 1), |g| (g.width, g.height));
    let per_field =
        |value: &dyn Fn(&Column) -> String| columns.iter().map(value).collect::<Vec<_>>().join(" ");
    let name = match encoding {
        PcdEncoding::Ascii => "ascii",
        PcdEncoding::Binary => "binary",
        PcdEncoding::BinaryCompressed => "binary_compressed",
    };
    let mut out = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\n\
         WIDTH {width}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {name}\n",
        per_field(&|c| c.name.to_string()),
        per_field(&|_| "4".to_string()),
        per_field(&|c| if c.float { "F" } else { "U" }.to_string()),
        per_field(&|_| "1".to_string()),
    )
    .into_bytes();
    match encoding {
        PcdEncoding::Ascii => write_text(&columns, points, &mut out),
        PcdEncoding::Binary => {
            for i in 0..points {
                for column in &columns {
                    out.extend_from_slice(&(column.bits)(i).to_le_bytes());
                }
            }
        }
        PcdEncoding::BinaryCompressed => {
            let raw: Vec<u8> =
                columns.iter().flat_map(|c| (0..points).flat_map(|i| (c.bits)(i).to_le_bytes())).collect();
            let packed = lzf::pack(&raw);
            out.extend_from_slice(&(packed.len() as u32).to_le_bytes());
            out.extend_from_slice(&(raw.len() as u32).to_le_bytes());
            out.extend_from_slice(&packed);
        }
    }
    out
}

/// Field to write: four bytes per point.
struct Column<'a> {
    name: &'static str,
    float: bool,
    bits: Box<dyn Fn(usize) -> u32 + 'a>,
}

fn columns(cloud: &Cloud) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        columns.push(Column { name, float: true, bits: Box::new(move |i| cloud.points[i][axis].to_bits()) });
    }
    if let Some(colours) = &cloud.colours {
        let bits = move |i: usize| {
            let [red, green, blue] = colours[i];
            u32::from_be_bytes([0, red, green, blue])
        };
        columns.push(Column { name: "rgb", float: false, bits: Box::new(bits) });
    }
    if let Some(normals) = &cloud.normals {
        for (axis, name) in ["normal_x", "normal_y", "normal_z"].into_iter().enumerate() {
            columns.push(Column { name, float: true, bits: Box::new(move |i| normals[i][axis].to_bits()) });
        }
    }
    if let Some(labels) = &cloud.labels {
        columns.push(Column { name: "label", float: false, bits: Box::new(move |i| labels[i]) });
    }
    columns
}

fn write_text(columns: &[Column], points: usize, out: &mut Vec<u8>) {
    for i in 0..points {
        for (k, column) in columns.iter().enumerate() {
            if k > 0 {
                out.push(b' ');
            }
            let bits = (column.bits)(i);
            let text = match f32::from_bits(bits) {
                _ if !column.float => bits.to_string(),
                v if v.is_nan() => "nan".to_string(),
                v => v.to_string(),
            };
            out.extend_from_slice(text.as_bytes());
        }
        out.push(b'\n');
    }
}
