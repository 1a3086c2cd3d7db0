//! Misfit of a look under a camera and pose model, at the most likely pose error.

use super::sight::{Ray, Sight};
use super::{MapSurface, Model};
use nalgebra::{Isometry3, Matrix6, Point2, Point3, Vector2, Vector3, Vector6};

/// Standard deviation of a surface's edge, in map and view together, metres. From: chosen, two
/// pixels at 1.5 m and maps good to a centimetre.
const EDGE_SIGMA_M: f64 = 0.015;
/// Standard deviation of a surface's height in the map, metres. From: chosen.
const HEIGHT_SIGMA_M: f64 = 0.01;
/// Number of independent rays that all rays of a look together count as: for the outline, and for the height.
/// From: chosen.
const EDGES: f64 = 40.0;
const HEIGHTS: f64 = 6.0;
/// Number of independent measurements that all points of the edge in a look together count as. From: derived, offset
/// and turn of each side of a table; along a side, errors of the map are common.
const EDGE_POINTS: f64 = 8.0;
/// Maximum distance from an edge that counts in the misfit, metres; larger distances are clamped.
/// From: chosen.
const GROSS_M: f64 = 0.10;
/// Distance beside the outline from which level points may belong to another surface, metres.
/// From: chosen.
const OTHER_M: f64 = 0.4;
/// Maximum height difference of level surfaces of the map, metres. From: chosen.
const LEVEL_M: f64 = 0.05;
/// Gauss-Newton steps. From: chosen.
const STEPS: usize = 4;

/// Sides of a convex outline.
struct Sides(Vec<(Point2<f64>, Vector2<f64>)>);

impl Sides {
    fn of(surface: &MapSurface) -> Sides {
        let (corners, centre) = (&surface.outline_m, surface.centre().xy());
        let side = |n: usize| {
            let (a, b) = (corners[n], corners[(n + 1) % corners.len()]);
            let along = (b - a).try_normalize(1e-9)?;
            let across = Vector2::new(along.y, -along.x);
            Some((a, across * across.dot(&(a - centre)).signum()))
        };
        Sides((0..corners.len()).filter_map(side).collect())
    }

    /// Distance of a point outside the side that it exceeds most, and the outward direction of that
    /// side.
    fn outside(&self, p: &Point2<f64>) -> Option<(f64, Vector2<f64>)> {
        let each = self.0.iter().map(|(a, outward)| (outward.dot(&(p - a)), *outward));
        each.max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Looks with the mapped surface that they are compared with.
pub(super) struct Fit<'a> {
    sights: &'a [Sight],
    surface: &'a MapSurface,
    centre: Point3<f64>,
    sides: Sides,
    /// Other mapped surfaces of this height.
    level: Vec<Sides>,
}

impl<'a> Fit<'a> {
    pub(super) fn new(sights: &'a [Sight], map: &'a [MapSurface], asked: usize) -> Fit<'a> {
        let surface = &map[asked];
        let is_level = |(n, other): &(usize, &MapSurface)| {
            *n != asked && (other.height_m - surface.height_m).abs() < LEVEL_M
        };
        let level = map.iter().enumerate().filter(is_level).map(|(_, other)| Sides::of(other)).collect();
        Fit { sights, surface, centre: surface.centre(), sides: Sides::of(surface), level }
    }

    /// Sum of squared errors of a look in standard deviations, at its most likely pose error.
    pub(super) fn misfit(&self, n: usize, model: &Model) -> f64 {
        self.settle(n, model).0
    }

    /// Distance that a place on the surface moves at most when the model's fault is mended, metres; with
    /// `is_laid`, after the surface was laid on its outline, which takes up shift and turn along it.
    pub(super) fn displacement_m(&self, model: &Model, is_laid: bool) -> f64 {
        let ends = self.surface.outline_m.iter().map(|p| Point3::new(p.x, p.y, self.surface.height_m));
        let places: Vec<Point3<f64>> = ends.map(|p| self.centre + (p - self.centre) / 2.0).collect();
        let of_look = |n: usize| {
            let (sight, moved) = (&self.sights[n], self.settle(n, model).1);
            let mended = |p: &Point3<f64>| {
                let measured = sight.world_from_camera.inverse_transform_point(p);
                moved * Point3::from(model.point(sight, &measured.coords)) - p
            };
            let steps: Vec<Vector3<f64>> = places.iter().map(mended).collect();
            let rigid = if is_laid {
                self.planar_motion(&places, &steps)
            } else {
                vec![Vector3::zeros(); steps.len()]
            };
            steps.iter().zip(&rigid).map(|(step, rigid)| (step - rigid).norm()).fold(0.0, f64::max)
        };
        (0..self.sights.len()).map(of_look).fold(0.0, f64::max)
    }

    /// Shift and turn along the surface, by least squares, that displacements have in common: for each place.
    fn planar_motion(&self, places: &[Point3<f64>], steps: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let across = |p: &Point3<f64>| Vector3::z().cross(&(p - self.centre));
        let shift = steps.iter().sum::<Vector3<f64>>() / steps.len().max(1) as f64;
        let (moment, inertia) = places.iter().zip(steps).fold((0.0, 0.0), |(moment, inertia), (p, step)| {
            (moment + across(p).dot(step), inertia + across(p).norm_squared())
        });
        let turn_rad = if inertia > 0.0 { moment / inertia } else { 0.0 };
        places.iter().map(|p| Vector3::new(shift.x, shift.y, 0.0) + across(p) * turn_rad).collect()
    }

    /// Misfit and likeliest pose of a look under a model.
    fn settle(&self, n: usize, model: &Model) -> (f64, Isometry3<f64>) {
        let sight = &self.sights[n];
        let stated = model.pose(self.sights, n, &self.centre);
        let eye = stated.translation.vector;
        let placed = |at: &Vector3<f64>| (stated * Point3::from(model.point(sight, at))).coords;
        let rays: Vec<(Vector3<f64>, bool)> =
            sight.rays.iter().map(|Ray { at, met }| (placed(at), *met)).collect();
        let edge: Vec<Vector3<f64>> = sight.edge.iter().map(placed).collect();
        let priors = Vector6::from_fn(|k, _| (if k < 3 { sight.sigma_m } else { sight.sigma_rad }).powi(-2));
        let mut error = Vector6::<f64>::zeros();
        let (mut least, mut likeliest) = (f64::INFINITY, error);
        for _ in 0..=STEPS {
            let (misfit, normal, right) = self.linearise(&rays, &edge, &eye, &error);
            let (mut normal, mut right) = (normal, right);
            let of_pose: f64 = error.component_mul(&error).dot(&priors);
            if misfit + of_pose < least {
                (least, likeliest) = (misfit + of_pose, error);
            }
            for k in 0..6 {
                normal[(k, k)] += priors[k];
                right[k] -= priors[k] * error[k];
            }
            let Some(step) = normal.cholesky().map(|of| of.solve(&right)) else { break };
            error += step;
        }
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(likeliest.fixed_rows::<3>(3).into_owned());
        let shift = nalgebra::Translation3::from(stated.translation.vector + likeliest.fixed_rows::<3>(0));
        (least, Isometry3::from_parts(shift, turn * stated.rotation))
    }

    /// Misfit of the rays at a pose error (shift, then rotation about the camera), and the normal
    /// equations.
    fn linearise(
        &self,
        rays: &[(Vector3<f64>, bool)],
        edge: &[Vector3<f64>],
        eye: &Vector3<f64>,
        error: &Vector6<f64>,
    ) -> (f64, Matrix6<f64>, Vector6<f64>) {
        let (shift, turn) = (error.fixed_rows::<3>(0), error.fixed_rows::<3>(3));
        let mut edges = Sum::default();
        let mut ends = Sum::default();
        let mut heights = Sum::default();
        let (mut judged, mut met) = (0.0, 0.0);
        let moved = |at: &Vector3<f64>| at + shift + turn.cross(&(at - eye));
        let row = |at: &Vector3<f64>, direction: &Vector3<f64>| {
            let about = (at - eye).cross(direction);
            Vector6::new(direction.x, direction.y, direction.z, about.x, about.y, about.z)
        };
        for at in edge {
            let p = moved(at);
            let Some((out_m, outward)) = self.sides.outside(&Point2::new(p.x, p.y)) else { continue };
            ends.add(out_m, EDGE_SIGMA_M, &row(at, &Vector3::new(outward.x, outward.y, 0.0)));
        }
        for (at, is_met) in rays {
            let p = moved(at);
            let flat = Point2::new(p.x, p.y);
            let Some((out_m, outward)) = self.sides.outside(&flat) else { continue };
            if *is_met {
                if out_m > OTHER_M || out_m > 0.0 && self.is_of_other(&flat) {
                    continue;
                }
                met += 1.0;
                heights.add(p.z - self.surface.height_m, HEIGHT_SIGMA_M, &row(at, &Vector3::z()));
            } else if out_m > OTHER_M {
                continue;
            }
            judged += 1.0;
            if (out_m > 0.0) == *is_met {
                edges.add(out_m, EDGE_SIGMA_M, &row(at, &Vector3::new(outward.x, outward.y, 0.0)));
            }
        }
        let (of_edge, of_height) = (EDGES / f64::max(judged, 1.0), HEIGHTS / f64::max(met, 1.0));
        let of_end = (EDGE_POINTS / f64::max(edge.len() as f64, 1.0)).min(1.0);
        let weighed = [(edges, of_edge), (heights, of_height), (ends, of_end)];
        weighed.iter().fold(
            (0.0, Matrix6::zeros(), Vector6::zeros()),
            |(misfit, normal, right), (sum, by)| {
                (misfit + sum.misfit * by, normal + sum.normal * *by, right + sum.right * *by)
            },
        )
    }

    fn is_of_other(&self, p: &Point2<f64>) -> bool {
        let is_near = |sides: &Sides| sides.outside(p).is_some_and(|(out_m, _)| out_m < GROSS_M);
        self.level.iter().any(is_near)
    }
}

/// Normal equations of robust distances (Geman and McClure 1987).
#[derive(Default)]
struct Sum {
    misfit: f64,
    normal: Matrix6<f64>,
    right: Vector6<f64>,
}

impl Sum {
    fn add(&mut self, distance_m: f64, sigma_m: f64, row: &Vector6<f64>) {
        let tame = 1.0 / (1.0 + (distance_m / GROSS_M).powi(2));
        let weight = (tame / sigma_m).powi(2);
        self.misfit += tame * (distance_m / sigma_m).powi(2);
        self.normal += row * row.transpose() * weight;
        self.right -= row * (distance_m * weight);
    }
}
