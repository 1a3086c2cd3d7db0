//! Recorded depth frames with poses.

use descry_perception::files::depth;
use descry_perception::nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use descry_perception::{Intrinsics, View};
use std::path::Path;

fn numbers(path: &Path) -> Result<Vec<f64>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    text.split_whitespace().map(|w| w.parse().map_err(|e| format!("{}: {e}", path.display()))).collect()
}

/// The frames of a folder with their names, in order.
pub fn frames(dir: &Path) -> Result<Vec<(String, View)>, String> {
    let k = numbers(&dir.join("camera-intrinsics.txt"))?;
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .map_err(|e| format!("{}: {e}", dir.display()))?
        .filter_map(|e| e.ok()?.file_name().to_str()?.strip_suffix(".depth.png").map(str::to_owned))
        .collect();
    names.sort();
    names
        .into_iter()
        .map(|name| {
            let bytes =
                std::fs::read(dir.join(format!("{name}.depth.png"))).map_err(|e| format!("{name}: {e}"))?;
            let image = depth::read(&bytes, 0.001).map_err(|e| format!("{name}: {e}"))?;
            let camera = Intrinsics {
                width: image.width,
                height: image.height,
                fx: k[0],
                fy: k[4],
                cx: k[2],
                cy: k[5],
            };
            let p = numbers(&dir.join(format!("{name}.pose.txt")))?;
            let turn = Matrix3::new(p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]);
            let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&turn));
            let view = View {
                stamp_ns: 0,
                cloud: camera.cloud_from_depth(&image.depths_m).map_err(|e| e.to_string())?,
                intrinsics: Some(camera),
                world_from_camera: Isometry3::from_parts(Translation3::new(p[3], p[7], p[11]), turn),
                pose_sigma_m: 0.02,
                pose_sigma_rad: 0.015,
            };
            Ok((name, view))
        })
        .collect()
}
