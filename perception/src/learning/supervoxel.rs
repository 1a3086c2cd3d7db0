//! Supervoxels: small surface patches, whose mean normal is more reliable than a pixel's (section
//! V-A, b).
//!
//! Seeded by cubes; then each pixel joins the best of its own and the adjacent supervoxels by position and normal, as
//! superpixels do (Achanta et al. 2012; Papon et al. 2013).

use super::error::LearningError;
use super::frame::Frame;
use super::mask::Mask;
use crate::voxel;
use nalgebra::{Point3, Vector3};

/// Division of a frame's nearby pixels into supervoxels.
pub(super) struct Supervoxels {
    /// Supervoxel index by pixel; [`voxel::NONE`] for none.
    of: Vec<u32>,
    count: usize,
}

const ROUNDS: usize = 2;
/// Weight of the normal in the squared distance: a right angle adds this many squared supervoxel sides.
const NORMAL_WEIGHT: f32 = 2.0;

#[derive(Clone, Default)]
struct Piece {
    at: Vector3<f32>,
    normal: Vector3<f32>,
    points: f32,
}

impl Supervoxels {
    /// Divides the nearby points into supervoxels about `side_m` metres wide; replaces the frame's normals by the mean
    /// normals of their supervoxels.
    pub fn of(frame: &mut Frame, side_m: f32) -> Result<Supervoxels, LearningError> {
        let points: Vec<Point3<f32>> = frame.near.iter().map(|&i| frame.points[i as usize]).collect();
        let seeds = voxel::assign(&points, side_m)?;
        let mut all = Supervoxels { of: vec![voxel::NONE; frame.points.len()], count: seeds.voxels };
        for (&pixel, &voxel) in frame.near.iter().zip(&seeds.voxel) {
            all.of[pixel as usize] = voxel;
        }
        let mut pieces = all.pieces(frame);
        for _ in 0..ROUNDS {
            all.reassign(frame, &pieces, side_m);
            pieces = all.pieces(frame);
        }
        for &pixel in &frame.near {
            frame.normals[pixel as usize] = pieces[all.of[pixel as usize] as usize].normal;
        }
        Ok(all)
    }

    fn pieces(&self, frame: &Frame) -> Vec<Piece> {
        let mut pieces = vec![Piece::default(); self.count];
        for &pixel in &frame.near {
            let piece = &mut pieces[self.of[pixel as usize] as usize];
            piece.at += frame.points[pixel as usize].coords;
            piece.normal += frame.normals[pixel as usize];
            piece.points += 1.0;
        }
        for piece in &mut pieces {
            piece.at /= piece.points.max(1.0);
            piece.normal = piece.normal.try_normalize(1e-6).unwrap_or_else(Vector3::z);
        }
        pieces
    }

    fn reassign(&mut self, frame: &Frame, pieces: &[Piece], side_m: f32) {
        let (width, before) = (frame.grid.width, self.of.clone());
        for &pixel in &frame.near {
            let pixel = pixel as usize;
            let (at, normal) = (&frame.points[pixel].coords, &frame.normals[pixel]);
            let off = |piece: &Piece| {
                (at - piece.at).norm_squared() / (side_m * side_m)
                    + NORMAL_WEIGHT * (1.0 - normal.dot(&piece.normal))
            };
            let mut best = (off(&pieces[before[pixel] as usize]), before[pixel]);
            for beside in [pixel.wrapping_sub(1), pixel + 1, pixel.wrapping_sub(width), pixel + width] {
                let Some(&piece) = before.get(beside).filter(|p| **p != voxel::NONE && **p != best.1) else {
                    continue;
                };
                let candidate = (off(&pieces[piece as usize]), piece);
                if candidate.0 < best.0 {
                    best = candidate;
                }
            }
            self.of[pixel] = best.1;
        }
    }

    /// Removes from a mask the supervoxels of which it holds less than `share` of the pixels.
    pub fn drop_unsupported(&self, mask: &mut Mask, share: f64) {
        let (mut all, mut held) = (vec![0_u32; self.count], vec![0_u32; self.count]);
        for (piece, set) in self.of.iter().zip(&mask.set).filter(|(p, _)| **p != voxel::NONE) {
            all[*piece as usize] += 1;
            held[*piece as usize] += u32::from(*set);
        }
        for (piece, set) in self.of.iter().zip(&mut mask.set) {
            *set &= *piece != voxel::NONE
                && f64::from(held[*piece as usize]) >= share * f64::from(all[*piece as usize]);
        }
    }
}
