//! A scene of the BOP challenge: images, and a JSON file with the camera of each image, by the image's
//! number.

use super::pieces::{self, Gathered, by_number, depths, json};
use crate::input::InputError;
use crate::recorded::folder::shown;
use crate::recorded::picture;
use crate::recorded::reading::{Conventions, Poses};
use crate::recorded::settings::CameraSettings;
use crate::recorded::stated::{Asked, Stated};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

const CAMERAS: &str = "scene_camera.json";

#[derive(Deserialize)]
struct Camera {
    #[serde(rename = "cam_K")]
    matrix: [f64; 9],
    #[serde(rename = "cam_R_w2c")]
    rotation: Option<[f64; 9]>,
    #[serde(rename = "cam_t_w2c")]
    translation: Option<[f64; 3]>,
    /// Millimetres in a unit of the depth image.
    #[serde(default = "one")]
    depth_scale: f64,
}

fn one() -> f64 {
    1.0
}

pub(super) fn is(path: &Path) -> bool {
    path.join(CAMERAS).is_file()
}

pub(super) fn read(folder: &Path, asked: &Asked) -> Result<Stated, InputError> {
    let file = folder.join(CAMERAS);
    let cameras: BTreeMap<String, Camera> = json(&file)?;
    let numbered: BTreeMap<u64, &Camera> =
        cameras.iter().filter_map(|(key, camera)| Some((key.parse().ok()?, camera))).collect();
    let depths = depths(&folder.join("depth"))?;
    let colours = by_number(pieces::images(&pieces::either(folder, &["rgb", "gray"]))?);
    let size = picture::size_of(&depths[0].1)?;
    let mut gathered = Gathered::default();
    let mut scale = None;
    for (name, depth) in depths {
        let Some(camera) = pieces::number(&name).and_then(|n| numbered.get(&n)) else {
            gathered.without_pose();
            continue;
        };
        let place = format!("{}, image {name}", shown(&file));
        let (Some(r), Some(t)) = (camera.rotation, camera.translation) else {
            let problem =
                "cam_R_w2c and cam_t_w2c are missing: the data set does not say where the camera stood";
            return Err(InputError::whole(place, problem, "take a scene that states them"));
        };
        let same = *scale.get_or_insert(camera.depth_scale);
        if !(same == camera.depth_scale && same.is_finite() && same > 0.0) {
            let problem = format!("depth_scale is {}, and {same} for the first image", camera.depth_scale);
            return Err(InputError::whole(place, problem, "one scene has one depth_scale, above zero"));
        }
        let k = camera.matrix;
        let own = CameraSettings { fx: k[0], fy: k[4], cx: k[2], cy: k[5] };
        let own = pieces::fitting(asked.camera.unwrap_or(own), size, &place)?;
        let rows = [
            [r[0], r[1], r[2], t[0]],
            [r[3], r[4], r[5], t[1]],
            [r[6], r[7], r[8], t[2]],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let colour = pieces::number(&name).and_then(|n| colours.get(&n)).cloned();
        gathered.add(name, own, pieces::pose_of(&place, rows.as_flattened())?, (depth, colour));
    }
    let notes = gathered.notes();
    Ok(Stated {
        frames: gathered.frames,
        images: Box::new(gathered.files),
        reading: Conventions {
            poses: Poses::CameraFromWorld,
            pose_unit_m: 0.001,
            ..Conventions::usual(1000.0 / scale.unwrap_or(1.0))
        },
        whole: true,
        registered: true,
        up: None,
        notes,
    })
}
