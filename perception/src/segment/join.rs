//! Grouping of voxels into objects by patches and the creases between them.

use super::mend::mend;
use super::patches::{SOME, Voxels};
use super::scene::SceneOptions;
use crate::pool;
use crate::scale::PLACE_M;
use nalgebra::{Point3, Vector3};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Maximum distance of a patch's voxels from its seed, metres. From: chosen.
const PATCH_REACH_M: f64 = 0.02;
/// Minimum cosine between a voxel's normal and that of its patch (25°). From: chosen.
const PATCH_COS: f64 = 0.906;
/// Maximum angle of a concave joint that is still smooth, radians (as in locally convex connected
/// patches). From: chosen, .25 was tried on piles of things and not kept.
const SMOOTH_RAD: f64 = 0.35;

/// Sets of voxels within which parts are sought.
pub(super) struct Sets {
    /// True for each voxel with far fewer points than its neighbours.
    thin: Vec<bool>,
    /// Connected sets of voxels, without thin ones.
    sets: Vec<Vec<usize>>,
    /// Index of each voxel in its set; [`NONE`] for thin ones.
    place: Vec<u32>,
}

/// Mark of no set, or no patch. From: mark.
const NONE: u32 = u32::MAX;

impl Sets {
    pub fn of(voxels: &Voxels) -> Sets {
        let thin = thin(voxels);
        let full: Vec<usize> = (0..voxels.len()).filter(|&i| !thin[i]).collect();
        let sets = voxels.together(&full);
        let mut place = vec![NONE; voxels.len()];
        sets.iter().for_each(|set| (0..).zip(set).for_each(|(local, &voxel)| place[voxel] = local));
        Sets { thin, sets, place }
    }
}

/// Part number of each voxel: the index of one of the part's voxels, so that the numbers are
/// deterministic.
pub(super) fn parts(voxels: &Voxels, Sets { thin, sets, place }: &Sets, options: &SceneOptions) -> Vec<u32> {
    let name = |set: &Vec<usize>| match options.part_touching {
        true => Piece::of(voxels, set, place).parts(),
        false => vec![set[0] as u32; set.len()],
    };
    let names: Vec<Vec<u32>> = pool::heaviest_first(sets, Vec::len, name);
    let mut parts: Vec<u32> = (0..voxels.len() as u32).collect();
    let named = sets.iter().flatten().zip(names.iter().flatten());
    named.for_each(|(&voxel, &name)| parts[voxel] = name);
    adopt(voxels, thin, &mut parts);
    parts
}

/// Connected voxels without thin ones; the methods use indices within the piece.
pub(super) struct Piece<'a> {
    pub voxels: &'a Voxels,
    /// Indices of the piece's voxels, ascending.
    pub of: &'a [usize],
    /// Start of each voxel's neighbours in `near`, and the total.
    starts: Vec<u32>,
    /// Neighbours of all voxels in a row, as indices within the piece.
    near: Vec<u32>,
}

impl<'a> Piece<'a> {
    /// Piece of the voxels `of`; `place`: index of each voxel in its set, [`NONE`] for thin ones.
    fn of(voxels: &'a Voxels, of: &'a [usize], place: &[u32]) -> Piece<'a> {
        let count = of.iter().map(|&voxel| voxels.neighbours(voxel).len()).sum();
        let (mut starts, mut near) = (Vec::with_capacity(of.len() + 1), Vec::with_capacity(count));
        for &voxel in of {
            starts.push(near.len() as u32);
            for place in voxels.neighbours(voxel).iter().map(|&n| place[n as usize]) {
                if place != NONE {
                    near.push(place);
                }
            }
        }
        starts.push(near.len() as u32);
        Piece { voxels, of, starts, near }
    }

    /// Neighbours of a voxel within the piece.
    fn near(&self, voxel: usize) -> impl Iterator<Item = u32> {
        self.near[self.starts[voxel] as usize..self.starts[voxel + 1] as usize].iter().copied()
    }

    /// Part number of each voxel of the piece.
    fn parts(&self) -> Vec<u32> {
        let patch_of = grow_patches(self);
        let patches = describe(self, &patch_of);
        let borders = borders(self, &patch_of);
        let mut joined = Union::new(patches.len());
        for border in &borders {
            let (a, b) = border.patches;
            if meets_convexly(&patches[a as usize], &patches[b as usize], border) {
                joined.join(a, b);
            }
        }
        mend(&mut joined, &borders, self, &patch_of);
        let root_voxel = first_voxels(&patch_of, &mut joined, patches.len());
        patch_of.iter().map(|&p| self.of[root_voxel[joined.root(p) as usize] as usize] as u32).collect()
    }
}

/// Voxels with far fewer points than their neighbours: frayed edges that hang between objects and
/// must not connect them.
fn thin(voxels: &Voxels) -> Vec<bool> {
    /// Share of a neighbour's points below which a voxel has far fewer points than that neighbour.
    /// From: chosen.
    const SHARE: f64 = 0.25;
    /// Quantile of the neighbours' numbers of points with which a voxel's own number is compared.
    /// From: chosen.
    const MOST: f64 = 0.75;
    let is_thin = |i: usize| {
        let own = f64::from(voxels.counts[i]);
        let near = voxels.neighbours(i);
        let fuller = near.iter().filter(|&&j| own < SHARE * f64::from(voxels.counts[j as usize])).count();
        near.is_empty() || fuller >= near.len() - ((near.len() - 1) as f64 * MOST).round() as usize
    };
    pool::each(voxels.len(), SOME, is_thin)
}

/// Assigns each thin voxel to the part of its fullest neighbour that is not thin.
fn adopt(voxels: &Voxels, thin: &[bool], parts: &mut [u32]) {
    let full = |i: usize| {
        let near = voxels.neighbours(i).iter().map(|&j| j as usize).filter(|&j| !thin[j]);
        near.max_by_key(|&j| (voxels.counts[j], usize::MAX - j))
    };
    let adopted = pool::filter(voxels.len(), SOME, |i| full(i).filter(|_| thin[i]).map(|j| (i, j)));
    adopted.into_iter().for_each(|(i, j)| parts[i] = parts[j]);
}

/// Grows patches of neighbouring voxels with similar normals from seeds, the flattest first;
/// returns the patch number of each voxel.
fn grow_patches(piece: &Piece) -> Vec<u32> {
    let Piece { voxels, of, .. } = *piece;
    // Curvatures are not negative: their bits are in the order of their values.
    let key = |(&voxel, local): (&usize, u32)| {
        u128::from(voxels.curvatures[voxel].to_bits()) << 32 | u128::from(local)
    };
    let mut order: Vec<u128> = of.iter().zip(0..).map(key).collect();
    order.sort_unstable();
    let mut patch_of = vec![NONE; of.len()];
    let (mut patches, mut open) = (0, Vec::new());
    for seed in order.into_iter().map(|key| key as u32) {
        if patch_of[seed as usize] != NONE {
            continue;
        }
        let (origin, normal) = (voxels.centres[of[seed as usize]], voxels.normals[of[seed as usize]]);
        patch_of[seed as usize] = patches;
        open.push(seed);
        while let Some(voxel) = open.pop() {
            for next in piece.near(voxel as usize) {
                let (own, n) = (&mut patch_of[next as usize], of[next as usize]);
                if *own == NONE
                    && (voxels.centres[n] - origin).norm_squared() < PATCH_REACH_M * PATCH_REACH_M
                    && voxels.normals[n].dot(&normal) > PATCH_COS
                {
                    *own = patches;
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

fn describe(Piece { voxels, of, .. }: &Piece, patch_of: &[u32]) -> Vec<Patch> {
    /// Factor by which a sphere's curvature is scaled to one; normals on a sphere give no axis.
    /// From: derived, equal moments along three axes.
    const PER_BALL: f64 = 3.0;
    /// Minimum length of the sum of a patch's normals; below it, they cancel out. From: rounding.
    const CANCELLED: f64 = 1e-9;
    let count = patch_of.iter().max().map_or(0, |&m| m as usize + 1);
    let mut patches: Vec<Patch> = (0..count)
        .map(|_| Patch { centre: Point3::origin(), normal: Vector3::zeros(), points: 0, voxels: 0 })
        .collect();
    for (&i, &p) in of.iter().zip(patch_of) {
        let patch = &mut patches[p as usize];
        patch.centre.coords += voxels.centres[i].coords;
        patch.normal += voxels.normals[i] * (1.0 - PER_BALL * voxels.curvatures[i]).max(0.0);
        patch.points += voxels.counts[i];
        patch.voxels += 1;
    }
    for patch in &mut patches {
        patch.centre.coords /= f64::from(patch.voxels.max(1));
        patch.normal = patch.normal.try_normalize(CANCELLED).unwrap_or_else(Vector3::zeros);
    }
    patches
}

/// Two neighbouring patches, the lower number first.
pub(super) struct Border {
    pub patches: (u32, u32),
    /// Number of neighbouring voxel pairs across the border.
    pub length: u32,
}

/// Borders between all neighbouring patches, in order of the patches.
fn borders(piece: &Piece, patch_of: &[u32]) -> Vec<Border> {
    let of = |range: Range<usize>| {
        let mut lengths: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        // Pairs that follow each other are of one border, most often.
        let (mut last, mut length) = ((NONE, NONE), 0);
        for i in range {
            for j in piece.near(i).map(|j| j as usize).filter(|&j| j > i) {
                let (a, b) = (patch_of[i], patch_of[j]);
                if a == b {
                    continue;
                }
                let patches = (a.min(b), a.max(b));
                if patches != last && length > 0 {
                    *lengths.entry(last).or_default() += std::mem::take(&mut length);
                }
                (last, length) = (patches, length + 1);
            }
        }
        if length > 0 {
            *lengths.entry(last).or_default() += length;
        }
        lengths
    };
    let half = patch_of.len() / 2;
    let (mut lengths, others) = pool::join(|| of(0..half), || of(half..patch_of.len()));
    others.into_iter().for_each(|(patches, length)| *lengths.entry(patches).or_default() += length);
    let mut borders: Vec<Border> =
        lengths.into_iter().map(|(patches, length)| Border { patches, length }).collect();
    borders.sort_unstable_by_key(|border| border.patches);
    borders
}

/// True if the surface is convex or nearly flat from one patch to the other.
fn meets_convexly(a: &Patch, b: &Patch, border: &Border) -> bool {
    /// Sine of the angle between normals below which there is no crease. From: rounding.
    const NO_CREASE: f64 = 1e-3;
    /// Maximum cosine between the crease and the line between the patches' centres. From: chosen.
    const ALONG: f64 = 0.85;
    if a.normal == Vector3::zeros() || b.normal == Vector3::zeros() || border.length < 2 {
        return false;
    }
    let between = b.centre - a.centre;
    let bend = (b.normal - a.normal).dot(&between);
    let angle = a.normal.dot(&b.normal).clamp(-1.0, 1.0).acos();
    // A step sideways between parallel patches (a box before another) is no smooth surface.
    let step = between.dot(&(a.normal + b.normal)).abs() / 2.0;
    let smooth = angle < SMOOTH_RAD && step < PLACE_M;
    if bend < 0.0 {
        return smooth;
    }
    // Patches that only touch at a corner: the crease must run across the line between their centres.
    let crease = a.normal.cross(&b.normal);
    let along = crease.try_normalize(NO_CREASE).map_or(0.0, |c| c.dot(&between.normalize()).abs());
    smooth || along < ALONG
}

/// First voxel of each root patch, which numbers the part.
fn first_voxels(patch_of: &[u32], joined: &mut Union, patches: usize) -> Vec<u32> {
    let mut first = vec![u32::MAX; patches];
    for (i, &p) in patch_of.iter().enumerate() {
        let slot = &mut first[joined.root(p) as usize];
        *slot = (*slot).min(i as u32);
    }
    first
}

/// Disjoint sets; the lowest member is the root, independent of the joining order.
pub(super) struct Union {
    parent: Vec<u32>,
}

impl Union {
    fn new(n: usize) -> Self {
        Union { parent: (0..n as u32).collect() }
    }

    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
