//! Horizontal surfaces in posed depth recordings (such as the kitchen's) and in organised clouds, each with
//! its classification.

use descry_perception::files::read_cloud;
use descry_perception::merge::{MergeOptions, merge};
use descry_perception::nalgebra::{Unit, Vector3};
use descry_perception::surface::{SurfaceOptions, find_surface, find_surfaces};
use descry_perception::{Cloud, View, Visibility};
use std::path::Path;

/// Prints the surfaces of each folder's frames, merged and one by one, or of each cloud.
pub fn run(paths: &[&str]) -> Result<(), String> {
    for path in paths {
        println!("{path}");
        if path.ends_with(".pcd") || path.ends_with(".ply") {
            let bytes = std::fs::read(path).map_err(|e| format!("{path}: {e}"))?;
            let cloud = read_cloud(&bytes).map_err(|e| format!("{path}: {e}"))?.cloud;
            let seen = Visibility::from_views(&[View::alone(cloud.clone())]);
            tell(&cloud, &seen, &SurfaceOptions::default());
            continue;
        }
        let frames = super::frames::frames(Path::new(path))?;
        let up = Some(Unit::new_normalize(Vector3::z()));
        let views: Vec<View> = frames.into_iter().map(|(_, view)| view).collect();
        for set in std::iter::once(&views[..]).chain(views.chunks(1)) {
            let merged =
                merge(set, &MergeOptions { up, ..MergeOptions::default() }).map_err(|e| e.to_string())?;
            println!(" {} of {} views", merged.fits.iter().filter(|f| f.used).count(), set.len());
            let options = SurfaceOptions { up, ..SurfaceOptions::default() };
            tell(&merged.cloud, &merged.visibility, &options);
        }
    }
    Ok(())
}

fn tell(cloud: &Cloud, seen: &Visibility, options: &SurfaceOptions) {
    match find_surface(cloud, seen, options) {
        Ok(best) => println!("  best: {:.3} m, {:?}", best.offset_m, best.role),
        Err(why) => println!("  best: {why}"),
    }
    for s in find_surfaces(cloud, seen, options).unwrap_or_default() {
        println!(
            "    {:7.3} m, {:5.2} m2, {:3.0} % of returns, residual {:.1} mm, above floor {:.3?}: {:?}, {}",
            s.offset_m,
            s.area_m2,
            1e2 * s.share,
            1e3 * s.residual_m,
            s.above_floor_m,
            s.role,
            s.because
        );
    }
}
