//! Surfaces of solids, with their ray intersections.

use nalgebra::{Isometry3, Point3, Vector3};

/// A surface with a closed-form ray intersection (the handle: to a tenth of a millimetre).
#[derive(Clone, Debug, PartialEq)]
pub enum Primitive {
    /// Side of a cone around the z axis between two heights: radius = `axis_m` + `slope`·z.
    Frustum {
        /// Radius at z = 0, metres.
        axis_m: f64,
        /// Change of the radius along z, metres a metre.
        slope: f64,
        /// Lower end along z, metres.
        low_m: f64,
        /// Upper end along z, metres.
        high_m: f64,
    },
    /// A horizontal ring.
    Disc {
        /// Height along z, metres.
        z_m: f64,
        /// Radius of the hole, metres.
        inner_m: f64,
        /// Outer radius, metres.
        outer_m: f64,
    },
    /// Half of an upright torus in the x-z plane, on the side away from the z axis.
    Handle {
        /// Centre of the ring, metres.
        centre: Point3<f64>,
        /// Radius from the ring's centre to the centre of the bent rod, metres.
        major_m: f64,
        /// Half the thickness of the bent rod, metres.
        minor_m: f64,
    },
    /// A box around the z axis, standing on z = 0, with rounded vertical edges.
    Rounded {
        /// Maximum corner of the bounding box, metres.
        high: Point3<f64>,
        /// Radius of the vertical edges, metres.
        corner_m: f64,
    },
    /// A box aligned with the axes.
    Cuboid {
        /// Minimum corner, metres.
        low: Point3<f64>,
        /// Maximum corner, metres.
        high: Point3<f64>,
    },
    /// An ellipsoid aligned with the axes.
    Ball {
        /// Centre, metres.
        middle: Point3<f64>,
        /// Half axes, metres.
        half: Vector3<f64>,
    },
    /// Another surface, given in a frame of its own.
    Turned {
        /// Transform from this frame to the frame of `part`.
        part_from_here: Isometry3<f64>,
        /// The surface, in its own frame.
        part: Box<Primitive>,
    },
}

/// Hit of a ray on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit: distance along the ray, in lengths of the ray's direction vector.
    pub t: f64,
    /// Unit normal, outward or inward.
    pub normal: Vector3<f64>,
}

/// Minimum ray parameter of a hit, which excludes the start of the ray itself.
const NEAREST_T: f64 = 1e-6;
const HANDLE_TOLERANCE_M: f64 = 1e-4;
const HANDLE_STEPS: usize = 64;

impl Primitive {
    pub(super) fn frustum(base_m: f64, top_m: f64, low_m: f64, high_m: f64) -> Primitive {
        let slope = (top_m - base_m) / (high_m - low_m);
        Primitive::Frustum { axis_m: base_m - slope * low_m, slope, low_m, high_m }
    }

    /// An ellipsoid that touches the plane z = `low_m` from above.
    pub(super) fn ball(half: &Vector3<f64>, low_m: f64) -> Primitive {
        Primitive::Ball { middle: Point3::new(0.0, 0.0, low_m + half.z), half: *half }
    }

    /// Wraps the surface for a frame from which `part_from_here` transforms to the surface's own.
    pub(crate) fn turned(self, part_from_here: Isometry3<f64>) -> Primitive {
        Primitive::Turned { part_from_here, part: Box::new(self) }
    }

    /// First hit of the ray o + t·d with t between `NEAREST_T` and `before`.
    #[inline]
    pub fn hit(&self, o: &Point3<f64>, d: &Vector3<f64>, before: f64) -> Option<Hit> {
        match *self {
            Primitive::Turned { part_from_here, ref part } => {
                let hit = part.hit(&(part_from_here * o), &(part_from_here * d), before)?;
                Some(Hit { normal: part_from_here.rotation.inverse() * hit.normal, ..hit })
            }
            Primitive::Ball { middle, half } => ball_hit(o, d, before, &middle, &half),
            Primitive::Frustum { axis_m, slope, low_m, high_m } => {
                frustum_hit(o, d, before, (axis_m, slope), (low_m, high_m))
            }
            Primitive::Disc { z_m, inner_m, outer_m } => {
                let t = (z_m - o.z) / d.z;
                if !(t > NEAREST_T && t < before) {
                    return None;
                }
                let (x, y) = (o.x + t * d.x, o.y + t * d.y);
                let square = x * x + y * y;
                (square >= inner_m * inner_m && square <= outer_m * outer_m)
                    .then_some(Hit { t, normal: Vector3::z() })
            }
            Primitive::Handle { centre, major_m, minor_m } => {
                handle_hit(o, d, before, &centre, major_m, minor_m)
            }
            Primitive::Rounded { high, corner_m } => rounded_hit(o, d, before, &high, corner_m),
            Primitive::Cuboid { low, high } => cuboid_hit(o, d, before, &low, &high),
        }
    }
}

#[inline]
fn frustum_hit(
    o: &Point3<f64>,
    d: &Vector3<f64>,
    before: f64,
    (axis_m, slope): (f64, f64),
    (low_m, high_m): (f64, f64),
) -> Option<Hit> {
    let radius = axis_m + slope * o.z;
    let a = d.x * d.x + d.y * d.y - slope * slope * d.z * d.z;
    let b = o.x * d.x + o.y * d.y - radius * slope * d.z;
    let c = o.x * o.x + o.y * o.y - radius * radius;
    let roots = if a.abs() > 1e-12 {
        let square = b * b - a * c;
        if square < 0.0 {
            return None;
        }
        let root = square.sqrt();
        let (first, second) = ((-b - root) / a, (-b + root) / a);
        if first < second { [first, second] } else { [second, first] }
    } else {
        [-0.5 * c / b, f64::INFINITY]
    };
    for t in roots {
        if !(t > NEAREST_T && t < before) {
            continue;
        }
        let p = o + d * t;
        let radius = axis_m + slope * p.z;
        if p.z >= low_m && p.z <= high_m && radius >= 0.0 {
            let normal = Vector3::new(p.x, p.y, -slope * radius).normalize();
            return Some(Hit { t, normal });
        }
    }
    None
}

#[inline]
fn cuboid_hit(
    o: &Point3<f64>,
    d: &Vector3<f64>,
    before: f64,
    low: &Point3<f64>,
    high: &Point3<f64>,
) -> Option<Hit> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    let (mut enter_axis, mut leave_axis) = (0, 0);
    for axis in 0..3 {
        if d[axis] == 0.0 {
            if o[axis] < low[axis] || o[axis] > high[axis] {
                return None;
            }
            continue;
        }
        let inverse = 1.0 / d[axis];
        let (a, b) = ((low[axis] - o[axis]) * inverse, (high[axis] - o[axis]) * inverse);
        let (near, far) = if a < b { (a, b) } else { (b, a) };
        if near > enter {
            (enter, enter_axis) = (near, axis);
        }
        if far < leave {
            (leave, leave_axis) = (far, axis);
        }
    }
    if enter > leave {
        return None;
    }
    let (t, axis) = if enter > NEAREST_T { (enter, enter_axis) } else { (leave, leave_axis) };
    if !(t > NEAREST_T && t < before) {
        return None;
    }
    let mut normal = Vector3::zeros();
    normal[axis] = 1.0;
    Some(Hit { t, normal })
}

/// Intersects a ray with an ellipsoid, by scaling the ellipsoid to the unit sphere.
#[inline]
fn ball_hit(
    o: &Point3<f64>,
    d: &Vector3<f64>,
    before: f64,
    middle: &Point3<f64>,
    half: &Vector3<f64>,
) -> Option<Hit> {
    let (from, along) = ((o - middle).component_div(half), d.component_div(half));
    let (a, b, c) = (along.norm_squared(), from.dot(&along), from.norm_squared() - 1.0);
    let square = b * b - a * c;
    if square < 0.0 {
        return None;
    }
    let root = square.sqrt();
    let t = [(-b - root) / a, (-b + root) / a].into_iter().find(|t| *t > NEAREST_T)?;
    (t < before).then(|| Hit { t, normal: (from + along * t).component_div(half).normalize() })
}

/// Intersects a ray with a rounded box: the convex union of two boxes and four cylinders, which a ray from
/// outside enters where it enters the first of them.
fn rounded_hit(
    o: &Point3<f64>,
    d: &Vector3<f64>,
    before: f64,
    high: &Point3<f64>,
    corner_m: f64,
) -> Option<Hit> {
    let (x, y) = (high.x - corner_m, high.y - corner_m);
    let boxes = [(x, high.y), (high.x, y)]
        .into_iter()
        .filter_map(|(x, y)| cuboid_hit(o, d, before, &Point3::new(-x, -y, 0.0), &Point3::new(x, y, high.z)));
    let edge = [
        Primitive::frustum(corner_m, corner_m, 0.0, high.z),
        Primitive::Disc { z_m: high.z, inner_m: 0.0, outer_m: corner_m },
    ];
    let edges = [(x, y), (-x, y), (-x, -y), (x, -y)].into_iter().flat_map(|(x, y)| {
        let from_edge = o - Vector3::new(x, y, 0.0);
        edge.each_ref().map(|part| part.hit(&from_edge, d, before)).into_iter().flatten()
    });
    boxes.chain(edges).min_by(|a, b| a.t.total_cmp(&b.t))
}

/// Intersects a ray with a handle by sphere tracing: the distance to half a torus is exact, so no step passes
/// through the handle.
fn handle_hit(
    o: &Point3<f64>,
    d: &Vector3<f64>,
    before: f64,
    centre: &Point3<f64>,
    major_m: f64,
    minor_m: f64,
) -> Option<Hit> {
    let from = o - centre;
    let (square, along) = (d.norm_squared(), from.dot(d));
    let reach = major_m + minor_m;
    let spread = along * along - square * (from.norm_squared() - reach * reach);
    if spread < 0.0 {
        return None;
    }
    let (enter, leave) = ((-along - spread.sqrt()) / square, (-along + spread.sqrt()) / square);
    let length = square.sqrt();
    let mut t = enter.max(NEAREST_T);
    for _ in 0..HANDLE_STEPS {
        if t > leave.min(before) {
            return None;
        }
        let p = from + d * t;
        let ring = Vector3::new(p.x, 0.0, p.z);
        let nearest = if p.x >= 0.0 {
            match ring.norm() {
                n if n > 1e-12 => ring * (major_m / n),
                _ => Vector3::new(major_m, 0.0, 0.0),
            }
        } else {
            Vector3::new(0.0, 0.0, major_m.copysign(p.z))
        };
        let off = p - nearest;
        let gap = off.norm() - minor_m;
        if gap < HANDLE_TOLERANCE_M {
            // The ends of the rod inside the wall are no surface.
            let at = o + d * t;
            let outside = at.x.hypot(at.y) >= centre.x;
            return outside.then(|| Hit { t, normal: off.normalize() });
        }
        t += gap / length;
    }
    None
}
