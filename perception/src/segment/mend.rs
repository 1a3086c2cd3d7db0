//! Repairs of over-segmentation at creases, for vessels and handles.

use super::footprint::most_within;
use super::join::{Border, Piece, Union};
use super::patches::SOME;
use crate::polygon::convex_hull;
use crate::pool;
use crate::quantile::VOXEL_ENDS;
use crate::scale::PLACE_M;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::OnceLock;

/// Number of points relative to a neighbour below which a part is no object of its own.
/// From: chosen.
const CRUMB_SHARE: f64 = 0.12;
/// Minimum number of voxels of an object of its own. From: chosen.
const CRUMB_VOXELS: usize = 40;
/// Number of points relative to a body below which a part without contact to the surface belongs to
/// that body (a handle, a spout). From: chosen.
const HANGING_SHARE: f64 = 0.25;

/// Joins parts separated wrongly by creases: insides of vessels, handles, small fragments.
///
/// The smallest part that belongs to a neighbour is joined first; then the neighbours of the joined
/// part are tested again.
pub(super) fn mend(joined: &mut Union, borders: &[Border], piece: &Piece, patch_of: &[u32]) {
    let mut parts = gather(joined, piece, patch_of);
    link(&mut parts, joined, borders);
    let of_part = |(root, part): (usize, &Option<Part>)| {
        let others = part.iter().flat_map(|part| &part.links);
        let belongings = others.filter_map(|link| Belonging::of(&parts, root as u32, link.other));
        belongings.map(Reverse).collect::<Vec<_>>()
    };
    let all = pool::each(parts.len(), SOME, |root| of_part((root, &parts[root])));
    let mut open: BinaryHeap<Reverse<Belonging>> = all.into_iter().flatten().collect::<Vec<_>>().into();
    let mut joins = 0;
    while let Some(Reverse(next)) = open.pop() {
        let Belonging { small, large, .. } = next;
        if !next.is_current(&parts) {
            continue;
        }
        let (Some(a), Some(b)) = (parts[small as usize].take(), parts[large as usize].take()) else { return };
        joined.join(small, large);
        joins += 1;
        let root = joined.root(small);
        let whole = a.with(b, [small, large], joins);
        for link in &whole.links {
            if let Some(other) = &mut parts[link.other as usize] {
                other.links.retain(|l| l.other != small && l.other != large);
                other.links.push(Link { other: root, length: link.length });
            }
        }
        let others: Vec<u32> = whole.links.iter().map(|link| link.other).collect();
        parts[root as usize] = Some(whole);
        for other in others {
            let both = [Belonging::of(&parts, root, other), Belonging::of(&parts, other, root)];
            open.extend(both.into_iter().flatten().map(Reverse));
        }
    }
}

/// Part that belongs to a neighbour, ordered by joining: few points first, then long borders.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Belonging {
    /// Number of points of the smaller part.
    points: u32,
    /// Root of the smaller part.
    small: u32,
    /// Greatest number minus the border's length, so that long borders come first.
    shortness: u32,
    /// Root of the larger part.
    large: u32,
    /// Number of joins before each of the two parts was made, which shows whether they have
    /// changed.
    made: [u32; 2],
}

impl Belonging {
    fn of(parts: &[Option<Part>], small: u32, large: u32) -> Option<Belonging> {
        let (s, l) = (parts[small as usize].as_ref()?, parts[large as usize].as_ref()?);
        let own = s.points <= l.points && (is_crumb(s, l) || hangs_on(s, l) || is_inside(s, l));
        let length = s.links.iter().find(|link| link.other == large)?.length;
        let made = [s.made, l.made];
        own.then_some(Belonging { points: s.points, small, shortness: u32::MAX - length, large, made })
    }

    /// True if neither part has been joined to another since this pair was found.
    fn is_current(&self, parts: &[Option<Part>]) -> bool {
        let is_same = |part: u32, made| parts[part as usize].as_ref().is_some_and(|p| p.made == made);
        is_same(self.small, self.made[0]) && is_same(self.large, self.made[1])
    }
}

/// Border with another part: its root, and the number of voxel pairs along the border.
#[derive(Clone, Copy)]
struct Link {
    other: u32,
    length: u32,
}

struct Part {
    points: u32,
    /// Heights of the part's voxels above the surface, ascending, metres.
    heights_m: Vec<f64>,
    /// Voxel centres seen from above, metres.
    places: Vec<[f64; 2]>,
    /// Points that span the part's hull, seen from above, metres.
    outer: Vec<[f64; 2]>,
    hull: OnceLock<Vec<[f64; 2]>>,
    /// Links to other parts, one each, unordered.
    links: Vec<Link>,
    /// Number of joins before the part was made.
    made: u32,
}

impl Part {
    fn height_m(&self, share: f64) -> f64 {
        let at = (self.heights_m.len().saturating_sub(1) as f64 * share).round() as usize;
        self.heights_m.get(at).copied().unwrap_or(0.0)
    }

    fn low_m(&self) -> f64 {
        self.height_m(VOXEL_ENDS.0)
    }

    fn top_m(&self) -> f64 {
        self.height_m(VOXEL_ENDS.1)
    }

    fn hull(&self) -> &[[f64; 2]] {
        self.hull.get_or_init(|| convex_hull(self.outer.clone()))
    }

    /// Union of both parts, without the links between them.
    fn with(self, other: Part, both: [u32; 2], made: u32) -> Part {
        let (mut large, small) =
            if self.places.len() >= other.places.len() { (self, other) } else { (other, self) };
        large.made = made;
        large.points += small.points;
        large.places.extend(&small.places);
        large.heights_m = merged(&large.heights_m, &small.heights_m);
        large.outer = large.hull.take().unwrap_or(large.outer);
        large.outer.extend(small.hull.get().unwrap_or(&small.outer));
        large.links.extend(small.links);
        large.links.retain(|link| !both.contains(&link.other));
        large.links.sort_unstable_by_key(|link| link.other);
        large.links.dedup_by(|next, kept| {
            let same = next.other == kept.other;
            kept.length += if same { next.length } else { 0 };
            same
        });
        large
    }
}

/// Merges two ascending lists.
fn merged(long: &[f64], short: &[f64]) -> Vec<f64> {
    let mut both = Vec::with_capacity(long.len() + short.len());
    let mut from = 0;
    for value in short {
        let to = from + long[from..].partition_point(|other| other < value);
        both.extend_from_slice(&long[from..to]);
        both.push(*value);
        from = to;
    }
    both.extend_from_slice(&long[from..]);
    both
}

/// Part of each root patch, without links; `None` for the other patches.
fn gather(joined: &mut Union, Piece { voxels, of, .. }: &Piece, patch_of: &[u32]) -> Vec<Option<Part>> {
    let patches = patch_of.iter().max().map_or(0, |&p| p as usize + 1);
    let mut parts: Vec<Option<Part>> = (0..patches).map(|_| None).collect();
    for (&voxel, &patch) in of.iter().zip(patch_of) {
        let part = parts[joined.root(patch) as usize].get_or_insert_with(|| Part {
            points: 0,
            heights_m: Vec::new(),
            places: Vec::new(),
            outer: Vec::new(),
            hull: OnceLock::new(),
            links: Vec::new(),
            made: 0,
        });
        let centre = &voxels.centres[voxel];
        part.points += voxels.counts[voxel];
        part.heights_m.push(centre.z);
        part.places.push([centre.x, centre.y]);
    }
    for part in parts.iter_mut().flatten() {
        part.heights_m.sort_unstable_by(f64::total_cmp);
        part.outer.clone_from(&part.places);
    }
    parts
}

/// Links bordering parts, with the lengths of the borders.
fn link(parts: &mut [Option<Part>], joined: &mut Union, borders: &[Border]) {
    let mut links: Vec<(u32, u32, u32)> = Vec::with_capacity(2 * borders.len());
    for Border { patches: (a, b), length } in borders {
        let (a, b) = (joined.root(*a), joined.root(*b));
        if a != b {
            links.extend([(a, b, *length), (b, a, *length)]);
        }
    }
    links.sort_unstable();
    for same in links.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (from, other, _) = same[0];
        if let Some(part) = &mut parts[from as usize] {
            part.links.push(Link { other, length: same.iter().map(|link| link.2).sum() });
        }
    }
}

fn is_crumb(small: &Part, large: &Part) -> bool {
    f64::from(small.points) < CRUMB_SHARE * f64::from(large.points) && small.places.len() < CRUMB_VOXELS
}

/// True if the small part is the inside of a vessel: within the body's outline and no higher than
/// its rim.
fn is_inside(small: &Part, large: &Part) -> bool {
    small.top_m() < large.top_m() + PLACE_M && most_within(large.hull(), &small.places, |p| *p)
}

/// True if the small part is a handle: lifted off the surface and not above the body.
fn hangs_on(small: &Part, large: &Part) -> bool {
    f64::from(small.points) < HANGING_SHARE * f64::from(large.points)
        && small.low_m() > large.low_m() + PLACE_M
        && small.top_m() < large.top_m() + PLACE_M
}
