//! Records a view: transforms, colours and cloud.

use descry_memory::{Bounds, Image, Meta, Record, RecordId, Sensing};
use descry_robots::Sensed;
use serde_json::json;

use crate::error::WorldError;
use crate::eyes::Eyes;
use crate::mind::{Laid, Mind, RecordedView};

/// Records a view of some surfaces (indices), with transforms, colours and cloud atomically; durable on
/// return.
pub fn view(
    mind: &mut Mind,
    eyes: Eyes<'_>,
    shown: &[usize],
    sensed: &Sensed,
) -> Result<RecordId, WorldError> {
    let record = eyes.record;
    for t in &sensed.transforms {
        record.put_transform_soon(t.stamp_ns, &t.parent, &t.child, &t.parent_from_child)?;
    }
    let camera = eyes.robot.description().camera.as_ref();
    let frame = camera.map_or("camera", |camera| camera.frame.as_str());
    put_colour(record, frame, sensed)?;
    let eye = sensed.map_from_camera.translation.vector;
    let sensing = Sensing {
        intrinsics: Some(sensed.intrinsics),
        pose_sigma_m: sensed.pose_sigma_m,
        pose_sigma_rad: sensed.pose_sigma_rad,
    };
    let known = &mind.known;
    let from = &known.candidates[known.at].symbol;
    let on: Vec<&String> = shown.iter().map(|&n| &known.surfaces[n].symbol).collect();
    let meta = Meta {
        seen_from_m: Some(eye.into()),
        covers_m: extent(sensed),
        body: json!({ "from": from, "on": on }),
        ..Meta::default()
    };
    let id = record.put_cloud(sensed.stamp_ns, frame, &sensed.cloud, &sensing, meta)?;
    for &n in shown {
        let away = mind.known.surfaces[n].centre().map(|centre| (centre.coords - eye).norm());
        let away_m = away.unwrap_or_default();
        let region = &mut mind.regions[n];
        region.looks.push(RecordedView {
            stamp_ns: sensed.stamp_ns,
            record: id,
            away_m,
            laid: Laid::AsLocalised,
        });
        region.taken += 1;
    }
    mind.views += 1;
    mind.known.looked_from = mind.known.at;
    // Every merge reads all views of its surface again.
    record.hold(&mind.views_held(), "views")?;
    Ok(id)
}

/// Records the colours of a frame, if any.
fn put_colour(record: &Record, frame: &str, sensed: &Sensed) -> Result<(), WorldError> {
    let Some(colour) = &sensed.colour else { return Ok(()) };
    let image = Image::Raw {
        width: colour.image.width(),
        height: colour.image.height(),
        encoding: "rgb8",
        data: colour.image.as_raw(),
    };
    let meta = Meta { body: json!({ "registered": colour.registered }), ..Meta::default() };
    Ok(record.put_image_soon(sensed.stamp_ns, frame, image, meta)?)
}

/// Bounds of a frame's points, map frame; `None` without returns.
fn extent(sensed: &Sensed) -> Option<Bounds> {
    let points =
        sensed.cloud.points.iter().map(|p| p.cast::<f64>()).filter(|p| p.iter().all(|x| x.is_finite()));
    points.map(|p| sensed.map_from_camera * p).fold(None, |bounds: Option<Bounds>, p| {
        let at: [f64; 3] = p.coords.into();
        let bounds = bounds.unwrap_or(Bounds { min_m: at, max_m: at });
        let with = |side: [f64; 3], of: fn(f64, f64) -> f64| std::array::from_fn(|i| of(side[i], at[i]));
        Some(Bounds { min_m: with(bounds.min_m, f64::min), max_m: with(bounds.max_m, f64::max) })
    })
}
