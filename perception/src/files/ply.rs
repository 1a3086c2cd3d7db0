//! PLY (`ascii`, `binary_little_endian`, `binary_big_endian`) with arbitrary elements and
//! properties; only vertices are used.

use super::columns::to_origin;
use super::error::{FileError, Place};
use super::loaded::{Loaded, finish, is_padding};
use crate::cloud::{Cloud, Grid};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Encoding of the vertices for [`write()`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlyEncoding {
    /// Text, one vertex per line.
    Ascii,
    /// Binary, little endian.
    Binary,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stored {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Scalar> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Value stored in `raw`, little endian and extended with zeros.
    fn value(self, raw: [u8; 8]) -> f64 {
        let low = u64::from_le_bytes(raw);
        match self {
            Scalar::I8 => f64::from(low as i8),
            Scalar::I16 => f64::from(low as i16),
            Scalar::I32 => f64::from(low as i32),
            Scalar::U8 | Scalar::U16 | Scalar::U32 => low as f64,
            Scalar::F32 => f64::from(f32::from_bits(low as u32)),
            Scalar::F64 => f64::from_bits(low),
        }
    }
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    scalar: Scalar,
    /// Type of the list's length; `None` for a scalar property.
    list: Option<Scalar>,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
    line: usize,
}

impl Element {
    /// Minimum number of bytes of a row.
    fn least_bytes(&self, stored: Stored) -> usize {
        match stored {
            Stored::Ascii => 2 * self.properties.len(),
            _ => self.properties.iter().map(|p| p.list.unwrap_or(p.scalar).size()).sum(),
        }
    }
}

/// Reads the vertices of a PLY file: `x y z`, `red green blue` (or `diffuse_red` …; whole numbers to 255 or floats to
/// 1), `nx ny nz`, `label`.
///
/// # Errors
/// If the header or the data are damaged, with the line or byte, what was expected, and what to do.
pub fn read(bytes: &[u8]) -> Result<Loaded, FileError> {
    let (stored, elements, mut cursor) = header(bytes)?;
    let (mut vertices, mut camera) = (None, None);
    for element in &elements {
        let table = cursor.rows(stored, element)?;
        match element.name.as_str() {
            "vertex" => vertices = Some((element, table)),
            "camera" => camera = Camera::of(element, &table),
            _ => {}
        }
    }
    let (Some((element, table)), Some(last)) = (vertices, elements.last()) else {
        return Err(FileError::new(
            Place::Line(cursor.line),
            "an element \"vertex\"",
            "none",
            "a cloud is the vertices of a PLY file",
        ));
    };
    cursor.ends_with(stored, last)?;
    let mut notes = Vec::new();
    let (mut cloud, offset) = cloud(element, &table, &mut notes)?;
    let mut viewpoint = Isometry3::identity();
    if let Some(camera) = camera {
        viewpoint = camera.viewpoint;
        viewpoint.translation.vector -= Vector3::from(offset);
        cloud.grid = camera.grid.filter(|g| g.width.checked_mul(g.height) == Some(cloud.len()));
    }
    finish(cloud, viewpoint, notes, Place::Line(element.line))
}

/// Element `camera` of the Point Cloud Library: sensor pose and image size.
struct Camera {
    viewpoint: Isometry3<f64>,
    grid: Option<Grid>,
}

impl Camera {
    /// Camera in the first row of an element; `None` if the element is not of this kind.
    fn of(element: &Element, values: &[f64]) -> Option<Camera> {
        let flat: Vec<&str> =
            element.properties.iter().filter(|p| p.list.is_none()).map(|p| p.name.as_str()).collect();
        let number = |name: &str| values.get(flat.iter().position(|n| *n == name)?).copied();
        let triple = |names: [&str; 3]| Some([number(names[0])?, number(names[1])?, number(names[2])?]);
        let eye = triple(["view_px", "view_py", "view_pz"])?;
        let rows = [
            triple(["x_axisx", "x_axisy", "x_axisz"])?,
            triple(["y_axisx", "y_axisy", "y_axisz"])?,
            triple(["z_axisx", "z_axisy", "z_axisz"])?,
        ];
        let turn = Matrix3::from_fn(|r, c| rows[r][c]);
        let off = (turn * turn.transpose() - Matrix3::identity()).abs().max();
        if !(off < 0.01 && turn.determinant() > 0.0 && eye.iter().all(|c| c.is_finite())) {
            return None;
        }
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let size = [number("viewportx"), number("viewporty")].map(|n| n.map_or(0, |n| n.max(0.0) as usize));
        let grid = (size[1] > 1).then_some(Grid { width: size[0], height: size[1] });
        Some(Camera { viewpoint: Isometry3::from_parts(eye.into(), rotation), grid })
    }
}

/// Reading position: byte offset and number of the last line read.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Cursor<'a> {
    fn text_line(&mut self) -> Option<(usize, &'a str)> {
        let rest = self.bytes.get(self.at..).filter(|r| !r.is_empty())?;
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += (end + 1).min(rest.len());
        self.line += 1;
        Some((self.line, std::str::from_utf8(&rest[..end]).unwrap_or("\u{fffd}")))
    }

    /// Rejects data after the last element, as the header then declares too few rows; padding is allowed.
    fn ends_with(&self, stored: Stored, last: &Element) -> Result<(), FileError> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let more = match stored {
            Stored::Ascii => rest.split(|&b| b == b'\n').filter(|l| !l.trim_ascii().is_empty()).count(),
            _ => rest.len() / last.least_bytes(stored).max(1),
        };
        if more == 0 || is_padding(rest) {
            return Ok(());
        }
        let what = if stored == Stored::Ascii { "lines" } else { "rows" };
        Err(FileError::new(
            Place::Byte(self.at),
            format!("the end of {} rows of element {}, as the header declares", last.count, last.name),
            format!("{} bytes more, up to {more} {what}", rest.len()),
            format!("set the count of element {} to what is there, or write the file again", last.name),
        ))
    }

    /// Reads all scalar values of an element, row by row; lists are skipped.
    fn rows(&mut self, stored: Stored, element: &Element) -> Result<Vec<f64>, FileError> {
        let least = element.least_bytes(stored);
        let left = self.bytes.len() - self.at;
        if element.count.saturating_mul(least.max(1)) > left.saturating_add(1) {
            return Err(FileError::new(
                Place::Byte(self.bytes.len()),
                format!("{} rows of element {}", element.count, element.name),
                format!("the end of the file after {left} bytes"),
                "the file was cut: write it again",
            ));
        }
        let columns = element.properties.iter().filter(|p| p.list.is_none()).count();
        let mut values = Vec::with_capacity(element.count.saturating_mul(columns));
        for _ in 0..element.count {
            match stored {
                Stored::Ascii => self.text_row(element, &mut values)?,
                _ => self.binary_row(stored, element, &mut values)?,
            }
        }
        Ok(values)
    }

    /// Number and text of the next line that is not blank; `None` at the end of the file.
    fn filled_line(&mut self) -> Option<(usize, &'a str)> {
        std::iter::from_fn(|| self.text_line()).find(|(_, text)| !text.trim().is_empty())
    }

    fn short_of(&self, element: &Element) -> FileError {
        let expected = format!("{} rows of element {}", element.count, element.name);
        let mend = "the file was cut: write it again";
        FileError::new(Place::Line(self.line), expected, "the end of the file", mend)
    }

    fn text_row(&mut self, element: &Element, values: &mut Vec<f64>) -> Result<(), FileError> {
        let (begin, text) = self.filled_line().ok_or_else(|| self.short_of(element))?;
        let mut line = begin;
        let mut words = text.split_ascii_whitespace();
        for property in &element.properties {
            let mut number = || -> Result<f64, FileError> {
                // A row may go on in the next line.
                let word = match words.next() {
                    Some(word) => word,
                    None => {
                        let (next, text) = self.filled_line().ok_or_else(|| self.short_of(element))?;
                        line = next;
                        words = text.split_ascii_whitespace();
                        words.next().unwrap_or_default()
                    }
                };
                word.parse().map_err(|_| {
                    let expected = format!("a number for {}", property.name);
                    let mend = "write the numbers of each row, and each row on a line of its own";
                    FileError::new(Place::Line(line), expected, format!("{word:?}"), mend)
                })
            };
            let first = number()?;
            if property.list.is_none() {
                values.push(first);
                continue;
            }
            for _ in 0..first.max(0.0) as u64 {
                number()?;
            }
        }
        match words.next() {
            None => Ok(()),
            Some(extra) => {
                let last = element.properties.last().map_or("", |p| p.name.as_str());
                let expected = format!("the end of the line behind {last}");
                let found =
                    if line == begin { format!("{extra:?}") } else { format!("{extra:?} in line {line}") };
                let mend = "the properties of the element must name every column";
                Err(FileError::new(Place::Line(begin), expected, found, mend))
            }
        }
    }

    fn binary_row(
        &mut self,
        stored: Stored,
        element: &Element,
        values: &mut Vec<f64>,
    ) -> Result<(), FileError> {
        for property in &element.properties {
            let Some(count) = property.list else {
                values.push(self.scalar(stored, property.scalar, &property.name)?);
                continue;
            };
            let entries = self.scalar(stored, count, &property.name)?.max(0.0) as usize;
            let skip = entries.saturating_mul(property.scalar.size());
            if skip > self.bytes.len() - self.at {
                return Err(self.cut(&property.name));
            }
            self.at += skip;
        }
        Ok(())
    }

    fn scalar(&mut self, stored: Stored, scalar: Scalar, name: &str) -> Result<f64, FileError> {
        let size = scalar.size();
        let found = self.bytes.get(self.at..self.at + size).ok_or_else(|| self.cut(name))?;
        let mut raw = [0; 8];
        raw[..size].copy_from_slice(found);
        if stored == Stored::Big {
            raw[..size].reverse();
        }
        self.at += size;
        Ok(scalar.value(raw))
    }

    fn cut(&self, name: &str) -> FileError {
        let place = Place::Byte(self.at);
        FileError::new(
            place,
            format!("a value of {name}"),
            "the end of the file",
            "the file was cut: write it again",
        )
    }
}

fn header(bytes: &[u8]) -> Result<(Stored, Vec<Element>, Cursor<'_>), FileError> {
    let mut cursor = Cursor { bytes, at: 0, line: 0 };
    let mut stored = None;
    let mut elements: Vec<Element> = Vec::new();
    while let Some((line, text)) = cursor.text_line() {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let bad = |expected: &str, mend: &str| {
            let shown: String = text.chars().take(60).collect();
            Err(FileError::new(Place::Line(line), expected, format!("{shown:?}"), mend))
        };
        match words.as_slice() {
            ["ply"] if line == 1 => {}
            _ if line == 1 => return bad("\"ply\"", "is this a PLY file?"),
            [] | ["comment", ..] | ["obj_info", ..] => {}
            ["format", ..] if stored.is_some() => {
                return bad("one line format", "leave out the one that is wrong");
            }
            ["element", name, ..] if elements.iter().any(|e| e.name == *name) => {
                return bad("one element of each name", "leave out the one that is wrong");
            }
            ["format", "ascii", ..] => stored = Some(Stored::Ascii),
            ["format", "binary_little_endian", ..] => stored = Some(Stored::Little),
            ["format", "binary_big_endian", ..] => stored = Some(Stored::Big),
            ["element", name, count] => {
                let Ok(count) = count.parse::<u32>() else {
                    return bad("element NAME COUNT", "the count is a whole number below 2^32");
                };
                elements.push(Element {
                    name: name.to_string(),
                    count: count as usize,
                    properties: vec![],
                    line,
                });
            }
            ["property", rest @ ..] => match (property(rest), elements.last_mut()) {
                (Some(property), Some(element)) => element.properties.push(property),
                (_, None) => {
                    return bad("an element before its properties", "move the line below its element");
                }
                _ => {
                    return bad(
                        "property TYPE NAME or property list TYPE TYPE NAME",
                        "check the type's name",
                    );
                }
            },
            ["end_header"] => {
                let Some(stored) = stored else { return bad("a line format before end_header", "add it") };
                return Ok((stored, elements, cursor));
            }
            _ => return bad("a line of a PLY header", "see the PLY format: element, property, end_header"),
        }
    }
    let place = Place::Line(cursor.line + 1);
    Err(FileError::new(place, "end_header", "the end of the file", "the header is cut"))
}

fn property(words: &[&str]) -> Option<Property> {
    match words {
        ["list", count, of, name] => Some(Property {
            name: name.to_string(),
            scalar: Scalar::named(of)?,
            list: Some(Scalar::named(count)?),
        }),
        [of, name] => Some(Property { name: name.to_string(), scalar: Scalar::named(of)?, list: None }),
        _ => None,
    }
}

/// Cloud of the vertices, and the offset that was subtracted from each, metres.
fn cloud(element: &Element, values: &[f64], notes: &mut Vec<String>) -> Result<(Cloud, [f64; 3]), FileError> {
    let flat: Vec<&Property> = element.properties.iter().filter(|p| p.list.is_none()).collect();
    let find = |name: &str| flat.iter().position(|p| p.name == name);
    let triple = |names: [&str; 3]| Some([find(names[0])?, find(names[1])?, find(names[2])?]);
    let rows = || values.chunks_exact(flat.len().max(1));
    let Some([x, y, z]) = triple(["x", "y", "z"]) else {
        let found = flat.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(" ");
        return Err(FileError::new(
            Place::Line(element.line),
            "properties x, y and z of the vertices",
            found,
            "a cloud needs all three",
        ));
    };
    let mut positions: Vec<[f64; 3]> = rows().map(|r| [r[x], r[y], r[z]]).collect();
    let moved = to_origin(&mut positions);
    let points = positions.into_iter().map(|p| Point3::from(p.map(|c| c as f32))).collect();
    let colour = triple(["red", "green", "blue"])
        .or_else(|| triple(["diffuse_red", "diffuse_green", "diffuse_blue"]))
        .or_else(|| triple(["r", "g", "b"]));
    let colours = colour.map(|at| {
        let scale = at.map(|i| if matches!(flat[i].scalar, Scalar::F32 | Scalar::F64) { 255.0 } else { 1.0 });
        rows().map(|r| [0, 1, 2].map(|k| (r[at[k]] * scale[k]).round() as u8)).collect()
    });
    let normal = triple(["nx", "ny", "nz"]);
    let normals =
        normal.map(|[a, b, c]| rows().map(|r| Vector3::new(r[a] as f32, r[b] as f32, r[c] as f32)).collect());
    let label = find("label");
    let labels = label.map(|at| rows().map(|r| r[at] as u32).collect());
    let used: Vec<usize> =
        [Some([x, y, z]), colour, normal].into_iter().flatten().flatten().chain(label).collect();
    let left: Vec<&str> =
        (0..flat.len()).filter(|i| !used.contains(i)).map(|i| flat[i].name.as_str()).collect();
    if !left.is_empty() {
        notes.push(format!("properties left out: {}", left.join(" ")));
    }
    let offset = moved.as_ref().map_or([0.0; 3], |(offset, _)| *offset);
    notes.extend(moved.map(|(_, note)| note));
    Ok((Cloud { points, grid: None, colours, normals, labels }, offset))
}

/// Encodes the finite points of a cloud as PLY (float coordinates, uchar colours, float normals,
/// uint label), without grid.
pub fn write(cloud: &Cloud, encoding: PlyEncoding) -> Vec<u8> {
    let finite = cloud.finite();
    let format = match encoding {
        PlyEncoding::Ascii => "ascii",
        PlyEncoding::Binary => "binary_little_endian",
    };
    let mut head = format!("ply\nformat {format} 1.0\nelement vertex {}\n", finite.len());
    let mut declare = |kind: &str, names: &[&str]| {
        names.iter().for_each(|name| head.push_str(&format!("property {kind} {name}\n")));
    };
    declare("float", &["x", "y", "z"]);
    if finite.colours.is_some() {
        declare("uchar", &["red", "green", "blue"]);
    }
    if finite.normals.is_some() {
        declare("float", &["nx", "ny", "nz"]);
    }
    if finite.labels.is_some() {
        declare("uint", &["label"]);
    }
    head.push_str("end_header\n");
    let mut out = head.into_bytes();
    for i in 0..finite.len() {
        match encoding {
            PlyEncoding::Ascii => text_vertex(&finite, i, &mut out),
            PlyEncoding::Binary => binary_vertex(&finite, i, &mut out),
        }
    }
    out
}

fn text_vertex(cloud: &Cloud, i: usize, out: &mut Vec<u8>) {
    let mut words: Vec<String> = cloud.points[i].iter().map(f32::to_string).collect();
    words.extend(cloud.colours.iter().flat_map(|c| c[i].map(|v| v.to_string())));
    words.extend(cloud.normals.iter().flat_map(|n| n[i].iter().map(f32::to_string).collect::<Vec<_>>()));
    words.extend(cloud.labels.iter().map(|l| l[i].to_string()));
    out.extend_from_slice(words.join(" ").as_bytes());
    out.push(b'\n');
}

fn binary_vertex(cloud: &Cloud, i: usize, out: &mut Vec<u8>) {
    cloud.points[i].iter().for_each(|c| out.extend_from_slice(&c.to_le_bytes()));
    if let Some(colours) = &cloud.colours {
        out.extend_from_slice(&colours[i]);
    }
    if let Some(normals) = &cloud.normals {
        normals[i].iter().for_each(|c| out.extend_from_slice(&c.to_le_bytes()));
    }
    if let Some(labels) = &cloud.labels {
        out.extend_from_slice(&labels[i].to_le_bytes());
    }
}
