//! Aligns a surface's views with the map's outline, which corrects localisation.

use descry_perception::View;
use descry_perception::locate::{Certainty, Located, endings, locate};
use descry_perception::merge::{MergeOptions, Merged, merge};
use descry_perception::nalgebra::Isometry3;
use descry_perception::surface::{Surface, SurfaceOptions, find_surface};
use descry_robots::Description;

use crate::eyes::Eyes;
use crate::looking::merging::options_at;
use crate::mind::Laid;
use crate::surface::KnownSurface;

/// Aligns a merged surface with the map's outline, correcting the remaining localisation error. The
/// certainty of the alignment is `None` for an unmapped surface.
pub(super) fn lay_on_map(
    body: &Description,
    known: &KnownSurface,
    merged: Merged,
    surface: Surface,
) -> (Merged, Surface, Option<Certainty>) {
    if !known.whole {
        return (merged, surface, None);
    }
    let located = located(body, known, &merged, &surface);
    let map_from_world = located.map_from_world;
    (merged.moved(&map_from_world), surface.moved(&map_from_world), located.certainty)
}

/// Alignment of a view with a mapped surface's outline; `Nowhere` if the surface is not found, or only
/// beyond the localisation error.
pub(super) fn of_view(
    body: &Description,
    known: &KnownSurface,
    view: View,
    (merging, seeking): (&MergeOptions, &SurfaceOptions),
) -> Laid {
    let localised = view.world_from_camera;
    let Ok(merged) = merge(&[view], merging) else { return Laid::Nowhere };
    let Ok(surface) = find_surface(&merged.cloud, &merged.visibility, seeking) else { return Laid::Nowhere };
    let map_from_localised = located(body, known, &merged, &surface).map_from_world;
    match is_astray(body, &localised, &(map_from_localised * localised)) {
        true => Laid::Nowhere,
        false => Laid::By(map_from_localised),
    }
}

fn located(body: &Description, known: &KnownSurface, merged: &Merged, surface: &Surface) -> Located {
    let endings = endings(&merged.visibility, surface);
    let sigmas = (body.pose_sigma_m, body.pose_sigma_rad);
    locate(&endings, &surface.hull, &surface.up, &known.outline, sigmas.0, sigmas.1)
}

/// Maximum correction of a view in standard deviations of localisation; a larger one is an
/// alignment error.
const ASTRAY: f64 = 4.0;

/// True if a camera is registered beyond the localisation error from its localised pose.
pub(crate) fn is_astray(body: &Description, localised: &Isometry3<f64>, moved: &Isometry3<f64>) -> bool {
    let shift = moved.translation.vector - localised.translation.vector;
    let turn = moved.rotation.rotation_to(&localised.rotation);
    shift.norm() > ASTRAY * body.pose_sigma_m || turn.angle() > ASTRAY * body.pose_sigma_rad
}

/// View aligned with the map's outline of a surface; as localised if there is no outline, or none
/// is visible.
pub(crate) fn laid(eyes: Eyes<'_>, surface: &KnownSurface, view: View) -> View {
    if !surface.whole {
        return view;
    }
    let (merging, seeking) = options_at(eyes.robot, surface);
    match of_view(eyes.robot.description(), surface, view.clone(), (&merging, &seeking.surface)) {
        Laid::By(map_from_localised) => {
            View { world_from_camera: map_from_localised * view.world_from_camera, ..view }
        }
        Laid::AsLocalised | Laid::Nowhere => view,
    }
}
