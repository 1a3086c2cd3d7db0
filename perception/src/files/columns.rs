//! Clouds from a table of numbers, whose columns are identified by names or by their values.

use crate::cloud::{Cloud, Grid};
use nalgebra::{Point3, Vector3};

/// Extent of a cloud relative to its distance from the origin, below which coordinates are map coordinates. From:
/// chosen.
const NARROW: f64 = 0.01;
/// Distance from the origin beyond which map coordinates are moved to the origin, metres, because
/// single precision blurs them. From: chosen.
const FAR_M: f64 = 1000.0;
/// Maximum deviation of a normal's length from 1. From: chosen.
const NORMAL: f64 = 0.05;

/// Meaning of a table's columns, as column indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Columns {
    pub position: [usize; 3],
    /// Red, green and blue, from 0 to 255.
    pub colour: Option<[usize; 3]>,
    pub normal: Option<[usize; 3]>,
    pub label: Option<usize>,
}

impl Columns {
    /// Finds the columns by name; `None` without x, y and z.
    pub(super) fn named(names: &[String]) -> Option<Columns> {
        let find = |name: &str| names.iter().position(|n| n == name);
        let triple = |all: [&str; 3]| Some([find(all[0])?, find(all[1])?, find(all[2])?]);
        let either = |of: &[[&str; 3]]| of.iter().find_map(|names| triple(*names));
        Some(Columns {
            position: either(&[["x", "y", "z"], ["x_m", "y_m", "z_m"]])?,
            colour: either(&[["red", "green", "blue"], ["r", "g", "b"]]),
            normal: either(&[["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]]),
            label: find("label"),
        })
    }

    /// Columns of a table without names: x, y, z, then colours or normals if the values of all rows allow it. Seven
    /// columns have an intensity in between.
    pub(super) fn unnamed(values: &[f64], width: usize) -> Columns {
        let mut columns = Columns { position: [0, 1, 2], colour: None, normal: None, label: None };
        let rest = match width {
            6 => [3, 4, 5],
            7 => [4, 5, 6],
            _ => return columns,
        };
        let rows = || values.chunks_exact(width).map(|row| rest.map(|k| row[k]));
        let is_byte = |v: &f64| (0.0..=255.0).contains(v) && v.fract() == 0.0;
        let is_normal = |r: [f64; 3]| (r.iter().map(|v| v * v).sum::<f64>().sqrt() - 1.0).abs() < NORMAL;
        if rows().all(is_normal) {
            columns.normal = Some(rest);
        } else if rows().flatten().all(|v| is_byte(&v)) {
            columns.colour = Some(rest);
        }
        columns
    }

    /// Number of columns with a known meaning.
    pub(super) fn used(&self) -> usize {
        3 + 3 * (usize::from(self.colour.is_some()) + usize::from(self.normal.is_some()))
            + usize::from(self.label.is_some())
    }

    /// Cloud of a table with `width` columns, whose `values` are given row by row.
    pub(super) fn cloud(
        &self,
        values: &[f64],
        width: usize,
        grid: Option<Grid>,
        notes: &mut Vec<String>,
    ) -> Cloud {
        let rows = || values.chunks_exact(width.max(1));
        let of = |at: [usize; 3]| move |row: &[f64]| at.map(|k| row[k]);
        let mut positions: Vec<[f64; 3]> = rows().map(of(self.position)).collect();
        notes.extend(to_origin(&mut positions).map(|(_, note)| note));
        let normal = |at| rows().map(of(at)).map(|v| Vector3::from(v.map(|c| c as f32))).collect();
        Cloud {
            points: positions.into_iter().map(|p| Point3::from(p.map(|c| c as f32))).collect(),
            grid,
            colours: self.colour.map(|at| rows().map(of(at)).map(|c| c.map(|v| v as u8)).collect()),
            normals: self.normal.map(normal),
            labels: self.label.map(|at| rows().map(|row| row[at] as u32).collect()),
        }
    }
}

/// Moves map coordinates to the origin by whole metres before they are rounded to single precision; returns the offset
/// and a note, or `None` if nothing is moved. Positions in another unit are also far from the origin, but the cloud
/// then is as wide as it is far.
pub(super) fn to_origin(positions: &mut [[f64; 3]]) -> Option<([f64; 3], String)> {
    let finite = |p: &&[f64; 3]| p.iter().all(|c| c.is_finite());
    let first = *positions.iter().find(finite)?;
    let (low, high) = positions.iter().filter(finite).fold((first, first), |(l, h), p| {
        ([0, 1, 2].map(|k| l[k].min(p[k])), [0, 1, 2].map(|k| h[k].max(p[k])))
    });
    let middle = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    let length = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let far = length(middle);
    if far <= FAR_M || length([0, 1, 2].map(|k| high[k] - low[k])) >= NARROW * far {
        return None;
    }
    let offset = middle.map(f64::round);
    positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|k| p[k] - offset[k]));
    let note = format!(
        "coordinates far from the origin are recentred: {} {} {} is taken off each point",
        offset[0], offset[1], offset[2]
    );
    Some((offset, note))
}
