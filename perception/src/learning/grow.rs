//! Propagation of the object mask from view to view: points at the object's position, grown over
//! smooth surfaces (section V-B).

use super::error::LearningError;
use super::frame::Frame;
use super::mask::Mask;
use crate::neighbours::Neighbours;
use crate::outliers;
use nalgebra::Point3;

/// Usable pixels within `radius_m` of the object's points (world frame).
pub(super) fn transferred(frame: &Frame, usable: &Mask, object: &Neighbours, radius_m: f32) -> Mask {
    let near = usable.pixels().filter(|&i| object.nearest(&frame.points[i], radius_m).is_some());
    Mask::of(frame.grid, near)
}

/// Region growing: adds to the mask usable pixels within `radius_m` of its points whose normals differ by less than
/// `angle_rad` from their neighbour's, until there are none.
pub(super) fn grown(frame: &Frame, usable: &Mask, mut mask: Mask, radius_m: f32, angle_rad: f64) -> Mask {
    let along = angle_rad.cos() as f32;
    let mut open: Vec<usize> = mask.pixels().collect();
    while let Some(pixel) = open.pop() {
        let (at, normal) = (frame.points[pixel], frame.normals[pixel]);
        frame.around(pixel, radius_m, |other| {
            let smooth = usable.set[other]
                && !mask.set[other]
                && (frame.points[other] - at).norm_squared() <= radius_m * radius_m
                && frame.normals[other].dot(&normal) > along;
            if smooth {
                mask.set[other] = true;
                open.push(other);
            }
        });
    }
    mask
}

/// Parameters of the outlier filter: number of neighbours for the mean distance, and threshold in standard deviations
/// (Rusu et al. 2008).
const STRAY: (usize, f64) = (20, 2.5);

/// Mask without the pixels whose points are statistical outliers (section V-A, a).
pub(super) fn without_outliers(frame: &Frame, mask: &Mask) -> Result<Mask, LearningError> {
    let pixels: Vec<usize> = mask.pixels().collect();
    let points: Vec<Point3<f32>> = pixels.iter().map(|&i| frame.points[i]).collect();
    Ok(Mask::of(frame.grid, kept(&points)?.into_iter().map(|k| pixels[k as usize])))
}

/// Indices of the points that are no statistical outliers.
pub(super) fn kept(points: &[Point3<f32>]) -> Result<Vec<u32>, LearningError> {
    Ok(outliers::statistical(&Neighbours::new(points)?, STRAY.0, STRAY.1).indices)
}
