//! Objects that a log shows from most sides: isolated clusters of all readings, with the scans around each.

use descry_perception::cluster::euclidean;
use descry_perception::hull::convex;
use descry_perception::laser::{ObserveError, ObserveOptions, PosedScan, Scan, observe};
use descry_perception::nalgebra::{Point2, Point3, Vector2};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Cell size for counting readings, metres.
const CELL_M: f64 = 0.05;
/// Minimum number of readings in a cell that counts as filled.
const LEAST_IN_CELL: usize = 2;
/// Distance that separates two objects, metres.
const APART_M: f32 = 0.3;
/// Minimum and maximum width of an object, metres.
const WIDTH_M: (f64, f64) = (0.15, 1.2);
/// Margin around an object within which readings belong to it, metres, for errors of the poses.
const AROUND_M: f64 = 0.2;
/// Maximum distance of scans from an object, metres.
const NEAR_M: f64 = 4.0;
/// Number of sectors around an object into which scans are sorted.
const SECTORS: usize = 24;
/// Minimum number of sectors with a scan.
const LEAST_SECTORS: usize = 5;
/// Minimum number of sectors with a second scan.
const LEAST_TWICE: usize = 4;

/// Position and radius of an object.
pub struct Thing {
    middle: Point2<f64>,
    radius_m: f64,
}

/// Clusters of readings within the limits of size.
pub fn find(scans: &[Scan]) -> Result<Vec<Thing>, ObserveError> {
    let mut cells: BTreeMap<(i64, i64), usize> = BTreeMap::new();
    for scan in scans {
        for end in (0..scan.ranges_m.len()).filter_map(|i| scan.endpoint(i)) {
            let at = (scan.map_from_laser * end) / CELL_M;
            *cells.entry((at.x.floor() as i64, at.y.floor() as i64)).or_default() += 1;
        }
    }
    let filled = cells.iter().filter(|(_, count)| **count >= LEAST_IN_CELL);
    let places: Vec<Point2<f64>> =
        filled.map(|((x, y), _)| Point2::new(*x as f64 + 0.5, *y as f64 + 0.5) * CELL_M).collect();
    let flat: Vec<Point3<f32>> = places.iter().map(|p| Point3::new(p.x as f32, p.y as f32, 0.0)).collect();
    let of = |members: Vec<u32>| {
        let corners = convex(members.iter().map(|&i| places[i as usize]).collect());
        let sum: Vector2<f64> = corners.iter().map(|c| c.coords).sum();
        let middle = Point2::from(sum / corners.len() as f64);
        let radius_m = corners.iter().map(|c| (c - middle).norm()).fold(0.0, f64::max);
        (WIDTH_M.0..=WIDTH_M.1).contains(&(2.0 * radius_m)).then_some(Thing { middle, radius_m })
    };
    Ok(euclidean(&flat, APART_M, 4)?.into_iter().filter_map(of).collect())
}

/// Two disjoint sets of scans of an object; `None` if it was not scanned from enough sides.
pub fn two_sets(scans: &[Scan], thing: &Thing) -> Result<Option<[Vec<PosedScan>; 2]>, ObserveError> {
    let far_m = |scan: &Scan| (scan.map_from_laser.translation.vector - thing.middle.coords).norm();
    let near: Vec<Scan> = scans.iter().filter(|s| far_m(s) < NEAR_M).cloned().collect();
    let is_background = |p: &Point2<f64>| (p - thing.middle).norm() > thing.radius_m + AROUND_M;
    let options = ObserveOptions { within_m: thing.radius_m + AROUND_M, ..ObserveOptions::default() };
    let seen = observe(&near, &thing.middle, is_background, &options)?;
    let mut sectors: Vec<Vec<PosedScan>> = vec![Vec::new(); SECTORS];
    for posed in seen.scans {
        let away = posed.model_from_laser.translation.vector - thing.middle.coords;
        let share = away.y.atan2(away.x).rem_euclid(TAU) / TAU;
        sectors[((share * SECTORS as f64) as usize).min(SECTORS - 1)].push(posed);
    }
    let mut sets = [Vec::new(), Vec::new()];
    for sector in &mut sectors {
        // Those with the most readings of it first.
        sector.sort_by_key(|posed| std::cmp::Reverse(posed.scan.points.len()));
        sets[0].extend(sector.first().cloned());
        sets[1].extend(sector.get(1).cloned());
    }
    Ok((sets[0].len() >= LEAST_SECTORS && sets[1].len() >= LEAST_TWICE).then_some(sets))
}
