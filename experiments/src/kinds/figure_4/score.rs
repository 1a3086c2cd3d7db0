//! Scores of each recogniser on the views, against the true scene.

use std::collections::BTreeSet;

use descry_perception::merge::{MergeOptions, Merged, merge};
use descry_perception::nalgebra::Isometry3;
use descry_perception::recognise::Percept;
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::{Scene, View};
use descry_robots::truth::TrueObject;
use serde_json::{Value, json};

use super::views::Taken;
use super::{Figure4, row};
use crate::job::Row;

/// Maximum distance of a percept from its object, metres: less than the radius of the smallest cup plus the
/// gap around it.
const SAME_PLACE_M: f64 = 0.05;
/// Minimum number of pixels on a handle for it to count as seen: 2 by 2 cm at 1.4 m with a Kinect.
const HANDLE_PIXELS: usize = 60;

/// Rows of measurements, one for each mode, number of views and recogniser.
pub(super) fn rows(experiment: &Figure4, taken: &Taken) -> Vec<Row> {
    let mut rows = Vec::new();
    for k in 1..=taken.views.len() {
        for (mode, from) in [("single", k - 1), ("merged", 0)] {
            // One view is both.
            let seen = perceive(&taken.views[from..k], &taken.options);
            let map_from_seen = seen
                .as_ref()
                .map_or(Isometry3::identity(), |(_, m)| aligned(m, &taken.map_from_camera[from..k]));
            for recogniser in &experiment.recognisers {
                let percepts = match &seen {
                    Ok((scene, merged)) => {
                        recogniser.recognise(scene, &merged.visibility, &experiment.models)
                    }
                    Err(_) => Vec::new(),
                };
                let mut said = score(experiment, taken, &percepts, from..k, &map_from_seen);
                let about = json!({ "recogniser": recogniser.name(), "mode": mode, "views": k });
                let used =
                    seen.as_ref().map_or(0, |(_, merged)| merged.fits.iter().filter(|fit| fit.used).count());
                said.insert("views_used".into(), json!(used));
                said.insert(
                    "nothing_because".into(),
                    seen.as_ref().err().map_or(Value::Null, |why| json!(why)),
                );
                rows.push(row(about).into_iter().chain(said).collect());
            }
        }
    }
    rows
}

/// Transform from the merged cloud to the true scene, by the first merged view, so that localisation errors
/// do not count as recognition errors.
fn aligned(merged: &Merged, map_from_camera: &[Isometry3<f64>]) -> Isometry3<f64> {
    let used = merged.fits.iter().zip(map_from_camera).find(|(fit, _)| fit.used);
    used.map_or(Isometry3::identity(), |(fit, truth)| truth * fit.world_from_camera.inverse())
}

fn perceive(
    views: &[View],
    (merging, seeking): &(MergeOptions, SceneOptions),
) -> Result<(Scene, Merged), String> {
    let merged = merge(views, merging).map_err(|e| e.to_string())?;
    let scene = segment(&merged.cloud, &merged.visibility, seeking).map_err(|e| e.to_string())?;
    Ok((scene, merged))
}

fn score(
    experiment: &Figure4,
    taken: &Taken,
    percepts: &[Percept],
    views: std::ops::Range<usize>,
    map_from_seen: &Isometry3<f64>,
) -> Row {
    let kind = &experiment.text.of_kind;
    let of_kind = |o: &TrueObject| {
        o.kind == *kind
            || experiment.models.iter().any(|m| m.kind == *kind && (m.name == o.kind || m.name == o.name))
    };
    let owners = owners(percepts, &taken.truth.objects, map_from_seen);
    let is_right = |n: usize| owners[n].is_some_and(|o| of_kind(&taken.truth.objects[o]));
    let called: Vec<usize> =
        (0..percepts.len()).filter(|&n| percepts[n].kind.as_ref() == Some(kind)).collect();
    let right: BTreeSet<usize> = called.iter().filter(|&&n| is_right(n)).filter_map(|&n| owners[n]).collect();
    let named = called.iter().filter(|&&n| {
        let names = owners[n].map(|o| &taken.truth.objects[o]).map(|o| [&o.name, &o.kind]);
        names.zip(percepts[n].label.as_ref()).is_some_and(|(names, label)| names.contains(&label))
    });
    let probability =
        |p: &Percept| p.kinds.iter().find(|(name, _)| name == kind).map_or(0.0, |(_, p)| p.min(1.0));
    let forecasts: Vec<Value> =
        percepts.iter().zip(0..).map(|(p, n)| json!([probability(p), is_right(n)])).collect();
    let handled: Vec<Value> = taken
        .handles
        .iter()
        .filter_map(|(name, pixels)| {
            let object = taken.truth.objects.iter().position(|o| o.name == *name)?;
            let seen: usize = pixels[views.clone()].iter().sum();
            Some(json!([seen >= HANDLE_PIXELS, called.iter().any(|&n| owners[n] == Some(object))]))
        })
        .collect();
    row(json!({
        "right": right.len(),
        "wrong": called.len() - right.len(),
        "named": named.count(),
        "things": taken.truth.objects.iter().filter(|o| of_kind(o)).count(),
        "handled": handled,
        "forecasts": forecasts,
    }))
}

/// Index of the true object of each percept, assigned nearest pairs first, each object once; `None` for
/// a percept without one.
fn owners(
    percepts: &[Percept],
    objects: &[TrueObject],
    map_from_seen: &Isometry3<f64>,
) -> Vec<Option<usize>> {
    let distance = |p: &Percept, o: &TrueObject| {
        ((map_from_seen * p.position_m).coords.xy() - o.map_from_object.translation.vector.xy()).norm()
    };
    let mut pairs: Vec<(f64, usize, usize)> = (0..percepts.len())
        .flat_map(|p| (0..objects.len()).map(move |o| (p, o)))
        .filter(|&(_, o)| objects[o].present)
        .map(|(p, o)| (distance(&percepts[p], &objects[o]), p, o))
        .filter(|&(d, ..)| d <= SAME_PLACE_M)
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut owners = vec![None; percepts.len()];
    let mut taken = BTreeSet::new();
    for (_, p, o) in pairs {
        if owners[p].is_none() && taken.insert(o) {
            owners[p] = Some(o);
        }
    }
    owners
}
