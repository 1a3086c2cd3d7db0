//! Options for merging views and segmenting the merged cloud.

use descry_perception::View;
use descry_perception::merge::{MergeError, MergeOptions, Merged};
use descry_perception::nalgebra::Unit;
use descry_perception::segment::SceneOptions;
use descry_perception::surface::{Region, SurfaceOptions};
use descry_robots::Robot;

use crate::mind::{LastMerged, Mind};
use crate::surface::KnownSurface;
use crate::symbol::symbol;

/// Maximum height of a point above or below a mapped surface for the point to be merged, metres.
const HEIGHT_TOLERANCE_M: f64 = 0.15;
/// Maximum height difference between an observed level surface and that of the map, metres; beyond
/// it, the surface is another or the body is lost.
const SAME_HEIGHT_M: f64 = 0.08;
/// Maximum tilt of an observed map surface, radians: localisation and camera mounting err by a
/// degree or two; a steeper plane cuts through walls and objects.
const LEVEL_RAD: f64 = 0.045;
/// Margin around the mapped outline in which points of a surface may lie, metres, for localisation
/// errors.
const BESIDE_M: f64 = 0.25;

/// Options for merging and segmenting a body's views of a surface (`None`: any), limited to the
/// map's surface height if known, and to objects that fit on it; without a map, everything in range
/// is merged.
pub fn options(robot: &dyn Robot, on: Option<&str>) -> (MergeOptions, SceneOptions) {
    let up = robot.description().up.map(Unit::new_normalize);
    let asked = robot.surfaces().iter().filter(|hint| on.is_none_or(|on| symbol(&hint.name) == on));
    let band = asked.map(|hint| hint.height_m).fold(None, |band: Option<(f64, f64)>, h| {
        let (low, high) = band.unwrap_or((h, h));
        Some((low.min(h), high.max(h)))
    });
    let within = |m: f64| band.map(|(low, high)| (low - m, high + m));
    let surface = SurfaceOptions { up, height_band_m: within(SAME_HEIGHT_M), ..SurfaceOptions::default() };
    let scene = SceneOptions { surface, ..SceneOptions::default() };
    let height_band_m = within(HEIGHT_TOLERANCE_M).map(|(low, high)| (low, high + scene.tallest_m));
    (MergeOptions { up, height_band_m, ..MergeOptions::default() }, scene)
}

/// Options for merging and segmenting one surface: a mapped one within its outline; a seen one with
/// its observed normal if the body does not know the up direction.
pub(super) fn options_at(robot: &dyn Robot, known: &KnownSurface) -> (MergeOptions, SceneOptions) {
    let (merging, mut seeking) = options(robot, Some(&known.symbol));
    if !known.whole {
        let is_told = !known.outline.is_empty() && known.doubtful.is_none();
        let seen_up = is_told.then(|| Unit::new_normalize(known.up));
        seeking.surface.up = seeking.surface.up.or(seen_up);
        return (merging, seeking);
    }
    let region = Some(Region { corners: known.outline.clone(), margin_m: BESIDE_M });
    let surface = SurfaceOptions { region: region.clone(), tilt_rad: LEVEL_RAD, ..seeking.surface };
    (MergeOptions { region, ..merging }, SceneOptions { surface, ..seeking })
}

/// Merged views of a surface. Without a map, one view covers all its surfaces; the last merge is
/// reused.
pub(super) fn merged(
    mind: &mut Mind,
    on: usize,
    views: &[View],
    options: &MergeOptions,
) -> Result<Merged, MergeError> {
    let taken: Vec<_> = views.iter().map(|view| (view.stamp_ns, view.world_from_camera)).collect();
    if let Some(last) = mind.merged.as_ref().filter(|last| last.views == taken && last.options == *options) {
        return Ok(last.merged.clone());
    }
    let merged = mind.regions[on].merger.merge(views, options)?;
    let kept = || LastMerged { options: options.clone(), views: taken, merged: merged.clone() };
    mind.merged = (!mind.known.surfaces[on].whole).then(kept);
    Ok(merged)
}

/// Removes the walls of the surface's room, as mapped, from a merged cloud, so that objects at a
/// wall are not joined with it.
pub(super) fn without_walls(known: &KnownSurface, mut merged: Merged) -> Merged {
    merged.cloud = merged.cloud.filter(|p| !known.is_of_wall(&p.cast(), 0.0));
    merged
}
