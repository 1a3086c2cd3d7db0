//! Which voxels are one object: patches, the creases between them, and the mends for vessels and handles.

use super::patches::Voxels;
use super::{SceneOptions, holds};
use crate::surface::convex_hull;
use nalgebra::{Point3, Vector3};
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// Greatest distance of a patch's voxels from its seed, metres.
const PATCH_REACH_M: f64 = 0.02;
/// Greatest angle between a voxel's normal and its patch's, as a cosine (25°).
const PATCH_COS: f64 = 0.906;
/// A concave joint is still smooth up to this angle, radians (as in locally convex connected patches).
const SMOOTH_RAD: f64 = 0.35;
/// A part smaller than this share of its neighbour is no object of its own.
const CRUMB_SHARE: f64 = 0.12;
/// A part whose base is lifted and which is smaller than this share of what it hangs on belongs to it (a handle, a spout).
const HANGING_SHARE: f64 = 0.25;

/// For each voxel the number of its part. Numbers are voxel indices, the same in every run.
pub(super) fn parts(voxels: &Voxels, options: &SceneOptions) -> Vec<u32> {
    if !options.part_touching {
        let thin = thin(voxels);
        let mut whole = Union::new(voxels.len());
        for i in (0..voxels.len()).filter(|&i| !thin[i]) {
            let near = voxels.neighbours(i).iter().filter(|&&j| !thin[j as usize]);
            near.for_each(|&j| whole.join(i as u32, j));
        }
        let mut parts: Vec<u32> = (0..voxels.len() as u32).map(|i| whole.root(i)).collect();
        adopt(voxels, &thin, &mut parts);
        return parts;
    }
    let thin = thin(voxels);
    let patch_of = grow_patches(voxels, &thin);
    let patches = describe(voxels, &patch_of);
    let borders = borders(voxels, &patch_of, &thin);
    let mut joined = Union::new(patches.len());
    for border in &borders {
        let (a, b) = border.patches;
        if meets_convexly(&patches[a as usize], &patches[b as usize], border) {
            joined.join(a, b);
        }
    }
    mend(&mut joined, &borders, voxels, &patch_of);
    let root_voxel = first_voxels(&patch_of, &mut joined, patches.len());
    let mut parts: Vec<u32> = patch_of.iter().map(|&p| root_voxel[joined.root(p) as usize]).collect();
    adopt(voxels, &thin, &mut parts);
    parts
}

/// Voxels with far fewer points than those around them: frayed edges, which hang between objects and connect nothing.
fn thin(voxels: &Voxels) -> Vec<bool> {
    /// Of the points of the voxel that three quarters of those around have no more than.
    const SHARE: f64 = 0.25;
    let is_thin = |i: usize| {
        let own = f64::from(voxels.counts[i]);
        let near = voxels.neighbours(i);
        let fuller = near.iter().filter(|&&j| own < SHARE * f64::from(voxels.counts[j as usize])).count();
        near.is_empty() || fuller >= near.len() - ((near.len() - 1) as f64 * 0.75).round() as usize
    };
    (0..voxels.len()).map(is_thin).collect()
}

/// Gives each thin voxel to the part of its fullest neighbour that is not thin.
fn adopt(voxels: &Voxels, thin: &[bool], parts: &mut [u32]) {
    let full = |i: usize| {
        let near = voxels.neighbours(i).iter().map(|&j| j as usize).filter(|&j| !thin[j]);
        near.max_by_key(|&j| (voxels.counts[j], usize::MAX - j))
    };
    for i in (0..voxels.len()).filter(|&i| thin[i]) {
        if let Some(j) = full(i) {
            parts[i] = parts[j];
        }
    }
}

/// Patches: voxels around a flat seed with like normals. Flattest seeds first.
fn grow_patches(voxels: &Voxels, thin: &[bool]) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut order: Vec<(f64, u32)> = voxels.curvatures.iter().copied().zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut patch_of = vec![NONE; voxels.len()];
    let mut patches = 0;
    for (_, seed) in order {
        if patch_of[seed as usize] != NONE {
            continue;
        }
        let (origin, normal) = (voxels.centres[seed as usize], voxels.normals[seed as usize]);
        let mut open = vec![seed];
        patch_of[seed as usize] = patches;
        while let Some(voxel) = open.pop() {
            for &next in voxels.neighbours(voxel as usize) {
                let n = next as usize;
                if patch_of[n] == NONE
                    && !thin[n]
                    && !thin[seed as usize]
                    && (voxels.centres[n] - origin).norm() < PATCH_REACH_M
                    && voxels.normals[n].dot(&normal) > PATCH_COS
                {
                    patch_of[n] = patches;
                    open.push(next);
                }
            }
        }
        patches += 1;
    }
    patch_of
}

struct Patch {
    centre: Point3<f64>,
    normal: Vector3<f64>,
    points: u32,
    voxels: u32,
}

fn describe(voxels: &Voxels, patch_of: &[u32]) -> Vec<Patch> {
    let count = patch_of.iter().max().map_or(0, |&m| m as usize + 1);
    let mut patches: Vec<Patch> = (0..count)
        .map(|_| Patch { centre: Point3::origin(), normal: Vector3::zeros(), points: 0, voxels: 0 })
        .collect();
    for (i, &p) in patch_of.iter().enumerate() {
        let patch = &mut patches[p as usize];
        patch.centre.coords += voxels.centres[i].coords;
        patch.normal += voxels.normals[i] * (1.0 - 3.0 * voxels.curvatures[i]).max(0.05);
        patch.points += voxels.counts[i];
        patch.voxels += 1;
    }
    for patch in &mut patches {
        patch.centre.coords /= f64::from(patch.voxels.max(1));
        patch.normal = patch.normal.try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
    }
    patches
}

/// Two neighbouring patches, the lower number first.
struct Border {
    patches: (u32, u32),
    /// Pairs of voxels along it.
    length: u32,
}

/// The borders of all patches, in order of the patches.
fn borders(voxels: &Voxels, patch_of: &[u32], thin: &[bool]) -> Vec<Border> {
    let mut lengths: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for i in (0..voxels.len()).filter(|&i| !thin[i]) {
        for &j in voxels.neighbours(i).iter().filter(|&&j| j as usize > i) {
            let (a, b) = (patch_of[i], patch_of[j as usize]);
            if a != b && !thin[j as usize] {
                *lengths.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
    }
    let mut borders: Vec<Border> =
        lengths.into_iter().map(|(patches, length)| Border { patches, length }).collect();
    borders.sort_unstable_by_key(|border| border.patches);
    borders
}

/// True if the surface bends outwards from one patch to the other, or hardly bends.
fn meets_convexly(a: &Patch, b: &Patch, border: &Border) -> bool {
    if a.normal == Vector3::zeros() || b.normal == Vector3::zeros() || border.length < 2 {
        return false;
    }
    let between = b.centre - a.centre;
    let bend = (b.normal - a.normal).dot(&between);
    let angle = a.normal.dot(&b.normal).clamp(-1.0, 1.0).acos();
    // A step sideways between parallel patches (a box before another) is no smooth surface.
    let step = between.dot(&(a.normal + b.normal)).abs() / 2.0;
    let smooth = angle < SMOOTH_RAD && step < 0.012;
    if bend < 0.0 {
        return smooth;
    }
    // Patches that only touch at a corner: the crease must run across the line between their centres.
    let crease = a.normal.cross(&b.normal);
    let along = crease.try_normalize(1e-3).map_or(0.0, |c| c.dot(&between.normalize()).abs());
    smooth || along < 0.85
}

/// Joins what the creases wrongly parted: insides of vessels, handles, crumbs.
///
/// The smallest part that belongs to a neighbour goes first; then what touches the joined part is looked at anew.
fn mend(joined: &mut Union, borders: &[Border], voxels: &Voxels, patch_of: &[u32]) {
    let mut parts = gather(joined, voxels, patch_of);
    for border in borders {
        let (a, b) = (joined.root(border.patches.0), joined.root(border.patches.1));
        if a != b {
            link(&mut parts, a, b, border.length);
        }
    }
    let mut belonging: BTreeSet<Belonging> = BTreeSet::new();
    for (&root, part) in &parts {
        belonging.extend(part.links.keys().filter_map(|&other| belongs(&parts, root, other)));
    }
    while let Some(Belonging { small, large, .. }) = belonging.pop_first() {
        let touched: BTreeSet<u32> =
            [small, large].iter().flat_map(|root| parts[root].links.keys().copied()).collect();
        belonging.retain(|b| ![b.small, b.large].iter().any(|root| *root == small || *root == large));
        joined.join(small, large);
        let root = joined.root(small);
        let (Some(a), Some(b)) = (parts.remove(&small), parts.remove(&large)) else { return };
        let links = [&a.links, &b.links].map(Clone::clone);
        parts.insert(root, a.with(b));
        for other in &touched {
            if let Some(part) = parts.get_mut(other) {
                part.links.retain(|to, _| *to != small && *to != large);
            }
        }
        for (other, length) in links.into_iter().flatten().filter(|(o, _)| *o != small && *o != large) {
            link(&mut parts, root, other, length);
        }
        for &other in touched.iter().filter(|&&o| o != small && o != large) {
            belonging
                .extend([belongs(&parts, root, other), belongs(&parts, other, root)].into_iter().flatten());
        }
    }
}

fn link(parts: &mut BTreeMap<u32, Part>, a: u32, b: u32, length: u32) {
    for (from, to) in [(a, b), (b, a)] {
        if let Some(part) = parts.get_mut(&from) {
            *part.links.entry(to).or_default() += length;
        }
    }
}

/// A part that belongs to a neighbour, in the order in which they are joined: few points first, then long borders.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Belonging {
    points: u32,
    small: u32,
    /// The border's length below the greatest number.
    shortness: u32,
    large: u32,
}

fn belongs(parts: &BTreeMap<u32, Part>, small: u32, large: u32) -> Option<Belonging> {
    let (s, l) = (parts.get(&small)?, parts.get(&large)?);
    let length = *s.links.get(&large)?;
    let own = s.points <= l.points && (is_crumb(s, l) || hangs_on(s, l) || is_inside(s, l));
    own.then_some(Belonging { points: s.points, small, shortness: u32::MAX - length, large })
}

struct Part {
    points: u32,
    /// Of its voxels, ascending, metres.
    heights_m: Vec<f64>,
    hull: Vec<[f64; 2]>,
    places: Vec<[f64; 2]>,
    /// Lengths of the borders with other parts.
    links: BTreeMap<u32, u32>,
}

impl Part {
    fn height_m(&self, share: f64) -> f64 {
        let at = (self.heights_m.len().saturating_sub(1) as f64 * share).round() as usize;
        self.heights_m.get(at).copied().unwrap_or(0.0)
    }

    fn low_m(&self) -> f64 {
        self.height_m(0.03)
    }

    fn top_m(&self) -> f64 {
        self.height_m(0.97)
    }

    /// Both in one; the links are left to the caller.
    fn with(self, other: Part) -> Part {
        let (mut large, small) =
            if self.places.len() >= other.places.len() { (self, other) } else { (other, self) };
        large.points += small.points;
        large.places.extend(&small.places);
        // Two ascending runs: the sort joins them in one pass.
        large.heights_m.extend(&small.heights_m);
        large.heights_m.sort_by(f64::total_cmp);
        large.hull.extend(&small.hull);
        large.hull = convex_hull(large.hull);
        large.links = BTreeMap::new();
        large
    }
}

fn gather(joined: &mut Union, voxels: &Voxels, patch_of: &[u32]) -> BTreeMap<u32, Part> {
    let mut members: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, &p) in patch_of.iter().enumerate() {
        members.entry(joined.root(p)).or_default().push(i);
    }
    let part = |of: Vec<usize>| {
        let places: Vec<[f64; 2]> = of.iter().map(|&i| [voxels.centres[i].x, voxels.centres[i].y]).collect();
        let mut heights_m: Vec<f64> = of.iter().map(|&i| voxels.centres[i].z).collect();
        heights_m.sort_by(f64::total_cmp);
        let points = of.iter().map(|&i| voxels.counts[i]).sum();
        Part { points, heights_m, hull: convex_hull(places.clone()), places, links: BTreeMap::new() }
    };
    members.into_iter().map(|(root, of)| (root, part(of))).collect()
}

fn is_crumb(small: &Part, large: &Part) -> bool {
    f64::from(small.points) < CRUMB_SHARE * f64::from(large.points) && small.places.len() < 40
}

/// The inside of a vessel: within the outline of the body and no higher than its rim.
fn is_inside(small: &Part, large: &Part) -> bool {
    let within = || small.places.iter().filter(|&&p| holds(&large.hull, p)).count();
    small.top_m() < large.top_m() + 0.01 && within() * 10 >= small.places.len() * 7
}

/// A handle: small, lifted off the surface, not above the body.
fn hangs_on(small: &Part, large: &Part) -> bool {
    f64::from(small.points) < HANGING_SHARE * f64::from(large.points)
        && small.low_m() > large.low_m() + 0.01
        && small.top_m() < large.top_m() + 0.005
}

/// A voxel of each root patch, to name parts by.
fn first_voxels(patch_of: &[u32], joined: &mut Union, patches: usize) -> Vec<u32> {
    let mut first = vec![u32::MAX; patches];
    for (i, &p) in patch_of.iter().enumerate() {
        let slot = &mut first[joined.root(p) as usize];
        *slot = (*slot).min(i as u32);
    }
    first
}

/// Disjoint sets; the lowest member is the root, whatever the order of joins.
struct Union {
    parent: Vec<u32>,
}

impl Union {
    fn new(n: usize) -> Self {
        Union { parent: (0..n as u32).collect() }
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
