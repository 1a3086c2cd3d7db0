//! Localisation uncertainty of objects along a surface: observed edges are aligned with the map's
//! outline, and along unobserved directions localisation's error remains.

use std::sync::OnceLock;

use descry_memory::belief::Track;
use descry_memory::space::Cell;
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::noise::normal_cdf;

use crate::belief::hypothesis::{Basis, Hypothesis};
use crate::situation::{Situation, cells};
use crate::surface::KnownSurface;

/// Maximum position error of an object that counts as located, metres: a grasp would miss it
/// beyond.
const OFF_M: f64 = 0.03;
/// Probability of a displacement below which the displacement is neglected.
const NEGLIGIBLE: f64 = 0.01;
/// Cosine of the largest angle between a direction and the normal of an edge that constrains it.
const ACROSS: f64 = 0.7;
/// Spacing of sample points along an edge, metres.
const STEP_M: f64 = 0.05;
/// Distance of these points inside the edge, and above the surface, metres.
const INSIDE_M: f64 = 0.01;

/// Least certain direction of an object's position, if the surface was aligned with the map, and the
/// standard deviation in that direction, metres.
pub(crate) fn worst(surface: &KnownSurface, track: &Track) -> (Option<Vector3<f64>>, f64) {
    let own_m = track.position_sigma_m.hypot(surface.displaced_m);
    match &surface.placed {
        Some(placed) => {
            let (way, sigma_m) = placed.worst(&track.position_m);
            (Some(way.into_inner()), sigma_m.hypot(own_m))
        }
        None => (None, own_m),
    }
}

/// Probability that an object is displaced along its surface by more than [`OFF_M`]; 0 if negligible, or
/// if no view can reduce it.
pub(crate) fn chance_off(s: &Situation, track: &Track) -> f64 {
    let Some(on) = s.surface_of(track) else { return 0.0 };
    let (Some(_), sigma_m) = worst(&s.surfaces[on], track) else { return 0.0 };
    let chance = 2.0 * normal_cdf(-OFF_M / sigma_m);
    if chance < NEGLIGIBLE || s.unseen_ends(on).is_empty() { 0.0 } else { chance }
}

/// Share of a surface's unseen locating edges that a view (candidate and surface) shows beyond the
/// earlier views, 0 to 1.
pub(crate) fn share_shown(s: &Situation, look: (usize, usize), before: &[(usize, usize)]) -> f64 {
    let ends = s.unseen_ends(look.1);
    let told = |(from, on): (usize, usize), end| s.would_settle(from, on, end, None);
    let earlier = |end| before.iter().filter(|b| b.1 == look.1).map(|b| told(*b, end)).fold(0.0, f64::max);
    let fresh: f64 = ends.iter().map(|end| (told(look, end) - earlier(end)).max(0.0)).sum();
    fresh / ends.len().max(1) as f64
}

/// Hypotheses about unseen edges of a surface that must be seen to locate an object, each with its
/// share of the object's weight.
pub(super) fn ends_of(s: &Situation, track: &Track, weight: f64) -> Vec<Hypothesis> {
    let weight = weight * chance_off(s, track);
    match s.surface_of(track) {
        Some(on) if weight > 0.0 => {
            let ends = s.unseen_ends(on);
            let each = weight / ends.len() as f64;
            ends.iter().map(|end| Hypothesis { weight: each, ..end.clone() }).collect()
        }
        _ => Vec::new(),
    }
}

/// Unseen edges of a surface that constrain its least certain direction and are visible from a
/// reachable, unused viewpoint.
pub(crate) fn unseen_ends(s: &Situation, on: usize) -> Vec<Hypothesis> {
    let surface = &s.surfaces[on];
    let Some((placed, centre)) = surface.placed.as_ref().zip(surface.centre()) else { return Vec::new() };
    let (way, _) = placed.worst(&centre);
    let corners = surface.outline.len();
    let sides = (0..corners).map(|n| (surface.outline[n], surface.outline[(n + 1) % corners]));
    let ends = sides.filter_map(|(a, b)| end(s, on, &centre, [a, b], &way));
    let looks = || {
        let from = 0..s.candidates.len();
        from.filter(|&from| !s.observed.contains(&(from, on)) && s.can_reach(from) && s.sees(from, on))
    };
    ends.filter(|end| looks().any(|from| s.would_settle(from, on, end, None) > 0.0)).collect()
}

/// Hypothesis of an edge of a surface, if the edge constrains a direction and is mostly unseen.
fn end(
    s: &Situation,
    on: usize,
    centre: &Point3<f64>,
    [a, b]: [Point3<f64>; 2],
    way: &Vector3<f64>,
) -> Option<Hypothesis> {
    let surface = &s.surfaces[on];
    let along = (b - a).try_normalize(1e-9)?;
    let across = surface.up.cross(&along).normalize();
    let inward = across * across.dot(&(centre - a)).signum();
    if inward.dot(way).abs() < ACROSS {
        return None;
    }
    let steps = ((b - a).norm() / STEP_M) as usize;
    let point = |n: usize| a + along * (STEP_M * (n as f64 + 0.5)) + (inward + surface.up) * INSIDE_M;
    let points: Vec<Point3<f64>> = (0..steps).map(point).collect();
    let unseen = points.iter().filter(|p| s.spaces[on].cell(p) == Cell::Unseen).count();
    let centre = a + (b - a) / 2.0;
    (2 * unseen > steps).then_some(Hypothesis {
        weight: 0.0,
        on,
        centre,
        points,
        facing: None,
        ground: Basis::Object,
    })
}

impl Situation {
    /// Unseen edges of a surface that a view could show to locate the surface better.
    pub(crate) fn unseen_ends(&self, on: usize) -> &[Hypothesis] {
        let ends: &Ends = self.derived.get(&|| Ends(cells(self.surfaces.len())));
        ends.0[on].get_or_init(|| unseen_ends(self, on))
    }
}

/// Cache of the unseen edges of each surface.
struct Ends(Vec<OnceLock<Vec<Hypothesis>>>);
