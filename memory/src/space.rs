//! Free, occupied and unobserved space: a sparse voxel map.
//!
//! Paper 004's outlook asks for an octree (OctoMap); blocks of voxels in a hash map serve the same purpose
//! with flat access. Each view updates the voxels in its field of view as in depth fusion: voxels in front of
//! the measured surface become free, voxels on it occupied, voxels behind it stay unchanged.

use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::noise::axial_sigma_m;
use descry_perception::visibility::DepthMap;
use rustc_hash::FxHashMap;

/// Number of voxels along the side of a block.
const SIDE: i32 = 16;
const BLOCK: usize = (SIDE * SIDE * SIDE) as usize;
/// Number of voxels along the side of a brick; a block has 64 bricks.
const BRICK: i32 = 4;
/// Distance below which two viewpoints count as the same, metres.
const SAME_PLACE_M: f64 = 0.1;
/// Mark of an unobserved voxel.
const UNSEEN: i8 = i8::MIN;
/// Increment of a voxel's log-odds for a surface measured in it.
const HIT: i8 = 3;
/// Decrement of a voxel's log-odds for a camera that looks through it.
const MISS: i8 = 1;
/// Limit of a voxel's log-odds in either direction.
const SURE: i8 = 12;

/// State of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cell {
    /// Not observed by any view.
    Unseen,
    /// A camera looked through the voxel.
    Free,
    /// A surface was measured in the voxel.
    Occupied,
}

/// A sparse map of voxels in the world frame.
#[derive(Debug, Clone)]
pub struct Space {
    #[doc(hidden)]
    pub voxel_m: f64,
    range_m: f64,
    blocks: FxHashMap<[i32; 3], Box<Block>>,
    opaque: Opaque,
    seen_from: Vec<Point3<f64>>,
}

/// Set of bricks with an occupied voxel, one bit each, by block within a bounding box of blocks; tests of
/// lines of sight use it.
#[derive(Debug, Clone, Default)]
struct Opaque {
    low: [i32; 3],
    size: [i32; 3],
    bricks: Vec<u64>,
}

impl Opaque {
    fn of(blocks: &FxHashMap<[i32; 3], Box<Block>>) -> Self {
        let full = || blocks.iter().filter(|(_, b)| b.occupied_bricks != 0);
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for (key, _) in full() {
            for axis in 0..3 {
                low[axis] = low[axis].min(key[axis]);
                high[axis] = high[axis].max(key[axis] + 1);
            }
        }
        if low[0] > high[0] {
            return Self::default();
        }
        let size: [i32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
        let mut opaque = Self { low, size, bricks: vec![0; size.iter().product::<i32>() as usize] };
        for (key, block) in full() {
            if let Some(at) = opaque.index(*key) {
                opaque.bricks[at] = block.occupied_bricks;
            }
        }
        opaque
    }

    fn index(&self, key: [i32; 3]) -> Option<usize> {
        let [x, y, z] = std::array::from_fn(|axis| key[axis] - self.low[axis]);
        let within = |at: i32, size: i32| (0..size).contains(&at);
        let [sx, sy, sz] = self.size;
        (within(x, sx) && within(y, sy) && within(z, sz)).then(|| ((x * sy + y) * sz + z) as usize)
    }

    /// First and last step of a line of sight within the bounding box; `None` if the line misses the box. All
    /// lengths are in voxels.
    fn clip(&self, from: &Vector3<f64>, step: &Vector3<f64>, last: f64) -> Option<(i64, i64)> {
        let (mut enters, mut leaves) = (0.0_f64, last);
        for axis in 0..3 {
            let low = f64::from(self.low[axis] * SIDE);
            let high = low + f64::from(self.size[axis] * SIDE);
            let [a, b] = [low, high].map(|wall| (wall - from[axis]) / step[axis]);
            if step[axis] == 0.0 {
                if from[axis] < low || from[axis] >= high {
                    return None;
                }
                continue;
            }
            (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
        }
        // A step more on either side, for what rounding takes.
        (enters <= leaves + 1.0).then(|| ((enters - 1.0).max(0.0) as i64, (leaves + 1.0).min(last) as i64))
    }
}

/// Voxels of a block, and the set of bricks with an occupied voxel; lines of sight skip the other bricks.
#[derive(Debug, Clone)]
struct Block {
    levels: [i8; BLOCK],
    occupied_bricks: u64,
}

impl Block {
    const UNSEEN: Self = Self { levels: [UNSEEN; BLOCK], occupied_bricks: 0 };

    /// Recomputes the set of bricks with an occupied voxel; required after any change of the block's voxels.
    fn find_bricks(&mut self) {
        let mut bricks = 0;
        for (row, levels) in self.levels.chunks_exact(BRICK as usize).enumerate() {
            if levels.iter().any(|&level| level > 0) {
                let side = SIDE as usize;
                let first = row * BRICK as usize;
                let voxel = [first / (side * side), first / side % side, first % side];
                bricks |= 1 << brick(voxel.map(|v| v as i32));
            }
        }
        self.occupied_bricks = bricks;
    }
}

/// Numbers of observed voxels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Extent {
    /// Free voxels.
    pub free: usize,
    /// Occupied voxels.
    pub occupied: usize,
}

impl Default for Space {
    /// Voxels of 2 cm, integrated up to a range of 3.5 m.
    fn default() -> Self {
        Self::new(0.02, 3.5)
    }
}

impl Space {
    /// Creates an unobserved map with this voxel size and maximum range of views, metres.
    pub fn new(voxel_m: f64, range_m: f64) -> Self {
        Self {
            voxel_m,
            range_m,
            blocks: FxHashMap::default(),
            opaque: Opaque::default(),
            seen_from: Vec::new(),
        }
    }

    /// Viewpoints of the integrated views, world frame, metres; those nearer to each other than
    /// `SAME_PLACE_M` count once.
    pub fn seen_from(&self) -> &[Point3<f64>] {
        &self.seen_from
    }

    /// Side of a voxel, metres.
    pub fn voxel_m(&self) -> f64 {
        self.voxel_m
    }

    /// State of a point of the world.
    pub fn cell(&self, point: &Point3<f64>) -> Cell {
        match self.level(self.voxel(point)) {
            UNSEEN => Cell::Unseen,
            level if level > 0 => Cell::Occupied,
            _ => Cell::Free,
        }
    }

    /// True if no occupied voxel lies between two points, except where `gone` is true. The last two voxels
    /// before `to` do not count, so that a surface does not hide itself.
    pub fn line_of_sight(
        &self,
        from: &Point3<f64>,
        to: &Point3<f64>,
        gone: &dyn Fn(&Point3<f64>) -> bool,
    ) -> bool {
        let way = to - from;
        let length = way.norm() - 2.0 * self.voxel_m;
        if length <= 0.0 {
            return true;
        }
        let step = way.normalize();
        let start = from.coords / self.voxel_m;
        let last = (length / self.voxel_m).floor();
        let Some((first, last)) = self.opaque.clip(&start, &step, last) else { return true };
        let steps_a_voxel = step.map(|s| 1.0 / s.abs());
        // Nothing is measured right before a camera; the far end, where things stand, is looked at first.
        let mut k = last;
        while k >= first {
            let place = start + step * k as f64;
            let voxel: [i32; 3] = place.map(floor).into();
            let key = voxel.map(|v| v.div_euclid(SIDE));
            let bricks = self.opaque.index(key).map_or(0, |at| self.opaque.bricks[at]);
            let empty = if bricks == 0 {
                SIDE
            } else if bricks >> brick(voxel) & 1 == 0 {
                BRICK
            } else {
                if self.level(voxel) > 0 && !gone(&Point3::from(place * self.voxel_m)) {
                    return false;
                }
                1
            };
            k -= steps_out_of(empty, voxel, &place, &step, &steps_a_voxel);
        }
        true
    }

    /// Unobserved length within the last `last_m` metres of the segment between two points, metres.
    pub fn unseen_m(&self, from: &Point3<f64>, to: &Point3<f64>, last_m: f64) -> f64 {
        let way = to - from;
        let steps = (last_m.min(way.norm()) / self.voxel_m).floor();
        let back = way.normalize() * self.voxel_m;
        let unseen = |k: &u32| self.cell(&(to - back * f64::from(*k))) == Cell::Unseen;
        (0..steps.max(0.0) as u32).filter(unseen).count() as f64 * self.voxel_m
    }

    /// Resets an upright cylinder to unobserved, because the scene may have changed there: foot of the axis,
    /// unit vector up, radius and height in metres.
    pub fn forget(&mut self, foot: &Point3<f64>, up: &Vector3<f64>, radius_m: f64, height_m: f64) {
        let voxel_m = self.voxel_m;
        for (key, block) in &mut self.blocks {
            let first = Vector3::from(key.map(|k| f64::from(k * SIDE) + 0.5)) * voxel_m;
            for (at, level) in block.levels.iter_mut().enumerate() {
                let side = SIDE as usize;
                let (x, y, z) = (at / (side * side), at / side % side, at % side);
                let d = first + Vector3::new(x as f64, y as f64, z as f64) * voxel_m - foot.coords;
                let above = d.dot(up);
                if above > 0.0 && above < height_m && (d - up * above).norm() < radius_m {
                    *level = UNSEEN;
                }
            }
            block.find_bricks();
        }
        self.opaque = Opaque::of(&self.blocks);
    }

    /// Integrates a depth image.
    pub fn integrate(&mut self, map: &DepthMap) {
        let reach_m = map.depths_m.iter().filter(|d| d.is_finite()).fold(0.0_f32, |most, &d| most.max(d));
        let reach_m = f64::from(reach_m).min(self.range_m) + self.voxel_m;
        let world_from_camera = map.camera_from_world.inverse();
        let from = Point3::from(world_from_camera.translation.vector);
        if self.seen_from.iter().all(|place| (place - from).norm() > SAME_PLACE_M) {
            self.seen_from.push(from);
        }
        let measured = self.measured(map, &world_from_camera);
        for key in self.blocks_in_view(map, &world_from_camera, reach_m) {
            let before = self.blocks.remove(&key);
            let known = before.is_some();
            let mut block = before.unwrap_or_else(|| Box::new(Block::UNSEEN));
            let seen =
                self.look_at_block(map, key, measured.get(&key).map(|block| &**block), &mut block.levels);
            if seen {
                block.find_bricks();
            }
            if seen || known {
                self.blocks.insert(key, block);
            }
        }
        self.opaque = Opaque::of(&self.blocks);
    }

    /// Number of known voxels.
    pub fn extent(&self) -> Extent {
        let mut extent = Extent::default();
        for level in self.blocks.values().flat_map(|b| b.levels.iter()) {
            match level {
                &UNSEEN => {}
                level if *level > 0 => extent.occupied += 1,
                _ => extent.free += 1,
            }
        }
        extent
    }

    /// Share of unobserved voxels in a box between two corners, 0 to 1.
    pub fn unseen_share(&self, low: &Point3<f64>, high: &Point3<f64>) -> f64 {
        let (low, high) = (self.voxel(low), self.voxel(high));
        let (mut all, mut unseen) = (0_usize, 0_usize);
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    all += 1;
                    unseen += usize::from(self.level([x, y, z]) == UNSEEN);
                }
            }
        }
        unseen as f64 / all.max(1) as f64
    }

    fn voxel(&self, p: &Point3<f64>) -> [i32; 3] {
        [p.x, p.y, p.z].map(|c| floor((c / self.voxel_m).clamp(-1e9, 1e9)))
    }

    fn level(&self, voxel: [i32; 3]) -> i8 {
        let key = voxel.map(|v| v.div_euclid(SIDE));
        self.blocks.get(&key).map_or(UNSEEN, |block| block.levels[index(voxel)])
    }

    /// Blocks that meet the camera's field of view, in a fixed order.
    fn blocks_in_view(
        &self,
        map: &DepthMap,
        world_from_camera: &Isometry3<f64>,
        reach_m: f64,
    ) -> Vec<[i32; 3]> {
        let c = &map.intrinsics;
        let corner = |u: f64, v: f64, z: f64| {
            world_from_camera * Point3::new((u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z)
        };
        let (w, h) = (c.width as f64, c.height as f64);
        let mut corners = vec![Point3::from(world_from_camera.translation.vector)];
        corners.extend([(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|(u, v)| corner(u, v, reach_m)));
        let low =
            corners.iter().fold([f64::MAX; 3], |low, p| [low[0].min(p.x), low[1].min(p.y), low[2].min(p.z)]);
        let high = corners
            .iter()
            .fold([f64::MIN; 3], |high, p| [high[0].max(p.x), high[1].max(p.y), high[2].max(p.z)]);
        let block_m = self.voxel_m * f64::from(SIDE);
        let [low, high] = [low, high].map(|p| p.map(|v| (v / block_m).floor() as i32));
        let radius_m = block_m * 0.87;
        let mut keys = Vec::new();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let centre = Point3::new(f64::from(x), f64::from(y), f64::from(z)).coords.add_scalar(0.5)
                        * block_m;
                    if touches_view(map, &Point3::from(centre), radius_m, reach_m) {
                        keys.push([x, y, z]);
                    }
                }
            }
        }
        keys
    }

    /// Voxels with a measured surface, by block, where the depth is more accurate than a voxel. They must not
    /// become free: at a grazing angle, the depth measured at a voxel's centre may be far behind the voxel.
    fn measured(
        &self,
        map: &DepthMap,
        world_from_camera: &Isometry3<f64>,
    ) -> FxHashMap<[i32; 3], Box<[bool; BLOCK]>> {
        let c = &map.intrinsics;
        let sure = |z: f64| axial_sigma_m(z, 0.0).is_some_and(|sigma_m| sigma_m < self.voxel_m / 2.0);
        let mut blocks: FxHashMap<[i32; 3], Box<[bool; BLOCK]>> = FxHashMap::default();
        for (row, depths) in map.depths_m.chunks_exact(c.width).enumerate() {
            let y = (row as f64 - c.cy) / c.fy;
            for (column, depth) in depths.iter().enumerate() {
                let z = f64::from(*depth);
                if z.is_nan() || z > self.range_m || !sure(z) {
                    continue;
                }
                let x = (column as f64 - c.cx) / c.fx;
                let voxel = self.voxel(&(world_from_camera * Point3::new(x * z, y * z, z)));
                let block = blocks.entry(voxel.map(|v| v.div_euclid(SIDE)));
                block.or_insert_with(|| Box::new([false; BLOCK]))[index(voxel)] = true;
            }
        }
        blocks
    }

    /// Updates the voxels of a block from a depth image; `measured` marks the voxels with a measured surface.
    /// Returns true if any voxel was observed.
    fn look_at_block(
        &self,
        map: &DepthMap,
        key: [i32; 3],
        measured: Option<&[bool; BLOCK]>,
        levels: &mut [i8; BLOCK],
    ) -> bool {
        let c = &map.intrinsics;
        let first = Point3::from(Vector3::from(key.map(|k| f64::from(k * SIDE) + 0.5)) * self.voxel_m);
        let origin = map.camera_from_world * first;
        let [dx, dy, dz] = [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|axis| map.camera_from_world.rotation * axis * self.voxel_m);
        let mut any = false;
        let mut at = 0;
        for x in 0..SIDE {
            for y in 0..SIDE {
                let row = origin + dx * f64::from(x) + dy * f64::from(y);
                for z in 0..SIDE {
                    let p = row + dz * f64::from(z);
                    let level = &mut levels[at];
                    let on_surface = measured.is_some_and(|measured| measured[at]);
                    at += 1;
                    if p.z < 0.1 || p.z > self.range_m {
                        continue;
                    }
                    let (u, v) = (c.fx * p.x / p.z + c.cx, c.fy * p.y / p.z + c.cy);
                    if u < 0.0 || v < 0.0 || u >= c.width as f64 || v >= c.height as f64 {
                        continue;
                    }
                    let depth = f64::from(map.depths_m[v as usize * c.width + u as usize]);
                    // Noise grows with the square of the distance (Nguyen et al.): so does what counts as on the surface.
                    let band = self.voxel_m * 0.75 + 0.003 * depth * depth;
                    if depth > p.z + band && !on_surface {
                        *level = if *level == UNSEEN { -MISS } else { (*level - MISS).max(-SURE) };
                        any = true;
                    } else if on_surface || depth >= p.z - self.voxel_m * 0.75 {
                        *level = if *level == UNSEEN { HIT } else { (*level + HIT).min(SURE) };
                        any = true;
                    }
                }
            }
        }
        any
    }
}

/// Rounds down to an integer within 32 bits. `f64::floor` is a function call on the baseline instruction set,
/// and lines of sight spend most of their time here.
#[inline(always)]
fn floor(value: f64) -> i32 {
    let toward_zero = value as i32;
    toward_zero - i32::from(f64::from(toward_zero) > value)
}

/// Number of steps along a line of sight that leave the cube of `side` voxels around a voxel; the samples
/// within are skipped.
fn steps_out_of(
    side: i32,
    voxel: [i32; 3],
    place: &Vector3<f64>,
    step: &Vector3<f64>,
    steps_a_voxel: &Vector3<f64>,
) -> i64 {
    if side == 1 {
        return 1;
    }
    let mut least = f64::INFINITY;
    for axis in 0..3 {
        let low = f64::from(voxel[axis].div_euclid(side) * side);
        let room = if step[axis] > 0.0 { place[axis] - low } else { low + f64::from(side) - place[axis] };
        least = least.min(room * steps_a_voxel[axis]);
    }
    // A sample on the very border is looked at again rather than passed.
    (least - 1e-6).clamp(0.0, 1e9) as i64 + 1
}

/// Index of a voxel's brick within its block.
fn brick(voxel: [i32; 3]) -> u32 {
    let [x, y, z] = voxel.map(|v| (v.rem_euclid(SIDE) / BRICK) as u32);
    (x * 4 + y) * 4 + z
}

/// Index of a voxel within its block.
fn index(voxel: [i32; 3]) -> usize {
    let [x, y, z] = voxel.map(|v| v.rem_euclid(SIDE) as usize);
    (x * SIDE as usize + y) * SIDE as usize + z
}

/// True if a ball may intersect the camera's field of view.
fn touches_view(map: &DepthMap, centre: &Point3<f64>, radius_m: f64, reach_m: f64) -> bool {
    let c = &map.intrinsics;
    let p = map.camera_from_world * centre;
    if p.z + radius_m < 0.1 || p.z - radius_m > reach_m {
        return false;
    }
    let outside = |x: f64, low: f64, high: f64| {
        // Distance from the two planes through the optical centre that bound the view on this axis.
        let beyond =
            |slope: f64, sign: f64| sign * (x - slope * p.z) / (1.0 + slope * slope).sqrt() > radius_m;
        beyond(low, -1.0) || beyond(high, 1.0)
    };
    let (w, h) = (c.width as f64, c.height as f64);
    !outside(p.x, -c.cx / c.fx, (w - c.cx) / c.fx) && !outside(p.y, -c.cy / c.fy, (h - c.cy) / c.fy)
}
