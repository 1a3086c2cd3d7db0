//! What happens with a view: recorded, read back with the others by timestamp, merged, recognised, believed.

use std::collections::BTreeSet;
use std::sync::Arc;

use descry_domains::situation::Situation;
use descry_memory::belief::{Sighted, Track};
use descry_memory::{Bounds, Draft, Meta, RecordId, Sensing, Sighting};
use descry_perception::View;
use descry_perception::locate::locate;
use descry_perception::merge::{MergeOptions, Merged, merge};
use descry_perception::nalgebra::{Point3, Unit, Vector3};
use descry_perception::recognise::Percept;
use descry_perception::segment::{Scene, SceneOptions, segment_on};
use descry_perception::surface::{Surface, SurfaceOptions, find_surface};
use descry_perception::visibility::{DepthMap, Seen, Visibility};
use descry_planner::Source;
use descry_robots::{Robot, Sensed};
use descry_skills::{Call, Outcome, SkillFailure};
use serde::Serialize;
use serde_json::json;

use super::{Agent, Look};
use crate::body::tape;
use crate::exit::CommandError;
use crate::report::Event;

/// A side counts as seen if a surface was measured this near to where it should be.
const SIDE_TOLERANCE_M: f64 = 0.03;
/// What is sought and was at least so probable is missed when it is gone.
const PERHAPS: f64 = 0.2;
/// How far a surface may be from the height at which the map has it.
const HEIGHT_TOLERANCE_M: f64 = 0.15;
/// Points this near to a surface lie on it.
const ON_SURFACE_M: f64 = 0.012;
/// How far beyond the hull of a surface points of it are looked for.
const HULL_MARGIN_M: f64 = 0.02;

/// A place where something has moved: an upright cylinder.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Change {
    /// Until when what was seen there is void.
    stamp_ns: i64,
    foot: Point3<f64>,
    up: Vector3<f64>,
    radius_m: f64,
    height_m: f64,
}

impl Change {
    /// Takes what a view shows of the place out of it, and what it saw through the place, as if the camera had no return there.
    fn blank(&self, view: &mut View) {
        let eye = Point3::from(view.world_from_camera.translation.vector);
        for p in view.cloud.points.iter_mut().filter(|p| p.x.is_finite()) {
            if self.is_crossed(&eye, &(view.world_from_camera * p.cast::<f64>())) {
                *p = Point3::new(f32::NAN, f32::NAN, f32::NAN);
            }
        }
    }

    /// Whether the way from one point to another leads through the cylinder.
    fn is_crossed(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        let split = |v: Vector3<f64>| (v.dot(&self.up), v - self.up * v.dot(&self.up));
        let (low, aside) = split(from - self.foot);
        let (rise, along) = split(to - from);
        // Where the way, seen from above, enters and leaves the circle, as shares of it.
        let (a, b) = (along.norm_squared(), aside.dot(&along));
        let root = b * b - a * (aside.norm_squared() - self.radius_m * self.radius_m);
        if root <= 0.0 || a <= 0.0 {
            return a <= 0.0 && aside.norm() < self.radius_m;
        }
        let (enters, leaves) = (((-b - root.sqrt()) / a).max(0.0), ((-b + root.sqrt()) / a).min(1.0));
        let heights = [enters, leaves].map(|share| low + rise * share);
        enters < leaves && heights[0].min(heights[1]) < self.height_m && heights[0].max(heights[1]) > 0.0
    }
}

impl Agent<'_> {
    /// Puts a view into the record: its transforms and colours, then its cloud, so that a cloud is never without its place. When
    /// this returns it survives a crash.
    pub(super) fn remember(&mut self, sensed: &Sensed) -> Result<(), CommandError> {
        for t in &sensed.transforms {
            self.record
                .put_transform(t.stamp_ns, &t.parent, &t.child, &t.parent_from_child)
                .map_err(CommandError::broken)?;
        }
        self.record.sync().map_err(CommandError::broken)?;
        let frame = &self.robot.description().frames.camera;
        tape::put_colour(self.record, frame, sensed)?;
        let eye = sensed.map_from_camera.translation.vector;
        let sensing = Sensing {
            intrinsics: Some(sensed.intrinsics),
            pose_sigma_m: sensed.pose_sigma_m,
            pose_sigma_rad: sensed.pose_sigma_rad,
        };
        let from = &self.state.candidates[self.state.at].symbol;
        let meta = Meta {
            seen_from_m: Some(eye.into()),
            covers_m: extent(sensed),
            body: json!({ "from": from }),
            ..Meta::default()
        };
        let id = self
            .record
            .put_cloud(sensed.stamp_ns, frame, &sensed.cloud, &sensing, meta)
            .map_err(CommandError::broken)?;
        self.state.looks.push(Look { stamp_ns: sensed.stamp_ns, record: id });
        // Every merge reads all views again.
        let views: Vec<RecordId> = self.state.looks.iter().map(|look| look.record).collect();
        self.record.hold(&views, "views").map_err(CommandError::broken)
    }

    /// The multi-view perception of paper 004, section V: restore the views by their timestamps, merge, recognise, believe.
    pub(super) fn perceive(&mut self, on: usize) -> Result<(), CommandError> {
        let views = self.restore()?;
        let (merging, seeking) = options(&*self.robot);
        let merged = match merge(&views, &merging) {
            Ok(merged) => merged,
            Err(nothing) => return self.saw_nothing(nothing.to_string()),
        };
        let surface = match find_surface(&merged.cloud, &merged.visibility, &seeking.surface) {
            Ok(surface) => surface,
            Err(nothing) => return self.saw_nothing(nothing.to_string()),
        };
        let (merged, surface) = self.lay_on_map(on, merged, surface);
        let newest = newest(&views, &merged);
        self.note_space(newest.as_ref());
        let scene = segment_on(&merged.cloud, &merged.visibility, surface, &seeking);
        let percepts = self.recogniser.recognise(&scene, &merged.visibility, &self.domain.objects);
        self.note_surface(on, &scene);
        let gone_before = self.state.belief.gone.len();
        self.believe(&merged, &percepts)?;
        match newest.and_then(|newest| self.taken_away(gone_before, &newest)) {
            Some(what) => self.begin_again(on, what),
            None => Ok(()),
        }
    }

    /// What was sought and believed to stand where the newest view looks through: somebody has moved it. In words; none if nothing.
    fn taken_away(&self, gone_before: usize, newest: &DepthMap) -> Option<String> {
        let up = self.state.surfaces.first().map_or_else(Vector3::z, |s| s.up);
        let sought = || self.state.things.iter().chain(&self.state.kinds);
        self.state.belief.gone[gone_before..].iter().find_map(|track| {
            let (p, name) = sought()
                .map(|thing| (track.probability_of(&thing.name), &thing.name))
                .max_by(|a, b| a.0.total_cmp(&b.0))?;
            let [x, y, z] = track.position_m.into();
            (p > PERHAPS && looked_through(track, &up, newest))
                .then(|| format!("{name} ({p:.2}) stood at ({x:.2}, {y:.2}, {z:.2}) m and is gone"))
        })
    }

    /// Things were moved while nobody looked: only the newest view still holds, and looks may be taken again.
    fn begin_again(&mut self, on: usize, what: String) -> Result<(), CommandError> {
        self.say(&Event::Changed { because: what })?;
        let last = self.state.looks.len().saturating_sub(1);
        self.state.looks.drain(..last);
        self.state.space = Arc::default();
        self.state.observed = BTreeSet::from([(self.state.at, on)]);
        self.perceive(on)
    }

    /// Lays the surface on the outline that the map has of it: that mends what is left of localisation's error.
    fn lay_on_map(&self, on: usize, merged: Merged, surface: Surface) -> (Merged, Surface) {
        let known = &self.state.surfaces[on];
        if !known.whole {
            return (merged, surface);
        }
        let body = self.robot.description();
        let outline = surface.outline();
        let on_it =
            |p: &Point3<f64>| surface.height_m(p).abs() < ON_SURFACE_M && outline.covers(p, HULL_MARGIN_M);
        let points: Vec<Point3<f64>> = merged.cloud.points.iter().map(|p| p.cast()).filter(on_it).collect();
        let (sigma_m, sigma_rad) = (body.pose_sigma_m, body.pose_sigma_rad);
        let is_past = |p: &Point3<f64>| merged.visibility.looked_past(p, ON_SURFACE_M);
        let located = locate(&points, &surface.up, &known.outline, sigma_m, sigma_rad, is_past);
        (merged.moved(&located.map_from_world), surface.moved(&located.map_from_world))
    }

    /// Takes the newest view, if it could be aligned, into the map of seen space.
    fn note_space(&mut self, newest: Option<&DepthMap>) {
        if let Some(map) = newest {
            Arc::make_mut(&mut self.state.space).integrate(map);
        }
    }

    /// Reads the views back from the record by their timestamps, with the transforms of those times. What a view shows of a
    /// place where something has moved since is left out.
    fn restore(&self) -> Result<Vec<View>, CommandError> {
        let map = &self.robot.description().frames.map;
        let restored = |look: &Look| -> Result<View, CommandError> {
            let mut view = self.record.view_at(look.stamp_ns, map).map_err(CommandError::broken)?;
            let since = self.state.changes.iter().filter(|c| c.stamp_ns >= look.stamp_ns);
            since.for_each(|change| change.blank(&mut view));
            Ok(view)
        };
        self.state.looks.iter().map(restored).collect()
    }

    /// Something on the surface was pushed: if it moved, what was seen there holds no longer, and looks may be taken again.
    pub(super) fn something_moved(
        &mut self,
        situation: &Situation,
        what: &str,
        moved_m: f64,
    ) -> Result<(), CommandError> {
        self.state.pushes += 1;
        if moved_m < self.state.space.voxel_m() {
            return Ok(());
        }
        let obstacle = situation.obstacle(what).map_err(|e| CommandError::Bug(e.to_string()))?;
        let obstacle = &situation.obstacles()[obstacle];
        let (foot, (radius_m, height_m)) = (obstacle.at, obstacle.reach_of_push(moved_m));
        let change = Change { stamp_ns: self.robot.now_ns(), foot, up: obstacle.up, radius_m, height_m };
        Arc::make_mut(&mut self.state.space).forget(&foot, &obstacle.up, radius_m, height_m);
        self.record_document("change", &change)?;
        self.state.changes.push(change);
        self.state.observed.clear();
        Ok(())
    }

    /// What the surface turned out to be: its height and tilt, and where the map knows none its outline.
    fn note_surface(&mut self, on: usize, scene: &Scene) {
        let known = &mut self.state.surfaces[on];
        let seen = &scene.surface;
        known.up = seen.up.into_inner();
        if known.whole {
            let onto_plane = |p: &Point3<f64>| p - seen.up.into_inner() * seen.height_m(p);
            known.outline = known.outline.iter().map(onto_plane).collect();
        } else {
            known.outline.clone_from(&seen.hull);
        }
    }

    fn believe(&mut self, merged: &Merged, percepts: &[Percept]) -> Result<(), CommandError> {
        let before: Vec<f64> = self.confidences();
        let stamp_ns = self.robot.now_ns();
        let up = self.state.surfaces.first().map_or_else(Vector3::z, |s| s.up);
        let viewpoints: Vec<Vec<Point3<f64>>> =
            percepts.iter().map(|p| seen_from(p, &up, &merged.visibility)).collect();
        let sighted: Vec<Sighted<'_>> = percepts
            .iter()
            .zip(&viewpoints)
            .map(|(percept, v)| Sighted { percept, viewpoints_m: v })
            .collect();
        let cites: Vec<RecordId> = self.state.looks.iter().map(|look| look.record).collect();
        self.state.belief.update(&sighted, stamp_ns, &cites);
        let after = self.confidences();
        let changed = self.state.things.iter().zip(before.iter().zip(&after));
        let changed = changed
            .map(|(thing, (b, a))| format!("confidence in {}: {b:.2} -> {a:.2}", thing.name))
            .collect();
        let used: Vec<_> = merged.fits.iter().filter(|fit| fit.used).collect();
        let event = Event::Perceived {
            merged: used.len(),
            left_out: merged
                .fits
                .iter()
                .zip(1..)
                .filter(|(fit, _)| !fit.used)
                .map(|(fit, n)| format!("view {n} left out: {}", fit.why))
                .collect(),
            points: merged.cloud.points.len(),
            residual_m: used.iter().map(|fit| fit.residual_m).fold(0.0, f64::max),
            objects: percepts.iter().map(crate::report::percept).collect(),
            changed,
        };
        let seen = serde_json::to_value(percepts).map_err(|e| CommandError::Bug(e.to_string()))?;
        let seen = json!({ "percepts": seen, "fits": merged.fits, "steps": merged.steps });
        let mut held = cites;
        held.push(
            self.record_meta(
                "percepts",
                Meta { objects: sightings(percepts), body: seen, ..Meta::default() },
            )?,
        );
        held.push(self.record_document("belief", &self.state.belief)?);
        // What the belief rests on outlasts any limit of the record.
        self.record.hold(&held, "belief").map_err(CommandError::broken)?;
        self.say(&event).map(|_| ())
    }

    fn confidences(&self) -> Vec<f64> {
        let best =
            |name: &str| self.state.belief.tracks.iter().map(|t| t.probability_of(name)).fold(0.0, f64::max);
        self.state.things.iter().map(|thing| best(&thing.name)).collect()
    }

    fn saw_nothing(&mut self, because: String) -> Result<(), CommandError> {
        self.say(&Event::Nothing { because }).map(|_| ())
    }

    pub(super) fn record_outcome(&mut self, call: &Call, outcome: &Outcome) -> Result<(), CommandError> {
        let said = match outcome {
            Outcome::Driven(d) => json!({ "distance_m": d.distance_m, "duration_s": d.duration_s }),
            Outcome::Seen(s) => json!({ "stamp_ns": s.stamp_ns }),
            Outcome::Pushed(p) => json!({ "moved_m": p.moved_m, "duration_s": p.duration_s }),
        };
        self.record_document("skill", &json!({ "call": call.to_string(), "outcome": said })).map(|_| ())
    }

    pub(super) fn record_failure(&mut self, call: &Call, failure: &SkillFailure) -> Result<(), CommandError> {
        let said = json!({ "call": call.to_string(), "failure": failure.to_string() });
        self.record_document("skill", &said).map(|_| ())
    }

    pub(super) fn record_problem(&mut self, problem: &Source) -> Result<(), CommandError> {
        let said = json!({ "name": problem.name, "pddl": problem.text });
        self.state.problem = Some(self.record_document("problem", &said)?);
        Ok(())
    }

    /// Tells of an event, and records it.
    pub(super) fn say(&mut self, event: &Event) -> Result<RecordId, CommandError> {
        (self.tell)(event);
        self.record_document("event", event)
    }

    pub(super) fn record_document(
        &self,
        kind: &str,
        body: &impl Serialize,
    ) -> Result<RecordId, CommandError> {
        let body = serde_json::to_value(body).map_err(|e| CommandError::Bug(e.to_string()))?;
        self.record_meta(kind, Meta { body, ..Meta::default() })
    }

    fn record_meta(&self, kind: &str, meta: Meta) -> Result<RecordId, CommandError> {
        let draft = Draft { meta, ..Draft::new(kind, self.robot.now_ns()) };
        self.record.put(draft).map_err(CommandError::broken)
    }
}

/// What the newest view measured, from where it was placed; none if it could not be aligned.
fn newest(views: &[View], merged: &Merged) -> Option<DepthMap> {
    let (fit, view) = merged.fits.last().filter(|fit| fit.used).zip(views.last())?;
    DepthMap::from_view(view, &fit.world_from_camera)
}

/// Whether a camera saw through the middle of an object's place, low and high.
fn looked_through(track: &Track, up: &Vector3<f64>, map: &DepthMap) -> bool {
    let free = |share: f64| {
        let place = track.position_m + up * (track.size_m[2] * share);
        map.look(&place, SIDE_TOLERANCE_M) == Seen::Free
    };
    [0.3, 0.5, 0.7].into_iter().all(free)
}

/// How a body's views are merged and looked through. The surface is looked for where the map has it, if it has one; what can
/// stand on it, and it itself, is merged; without any, all that is in range.
pub fn options(robot: &dyn Robot) -> (MergeOptions, SceneOptions) {
    let up = robot.description().up.map(Unit::new_normalize);
    let heights = robot.surfaces().iter().map(|s| s.height_m);
    let band = heights.fold(None, |band: Option<(f64, f64)>, h| {
        let (low, high) = band.unwrap_or((h, h));
        Some((low.min(h), high.max(h)))
    });
    let height_band_m = band.map(|(low, high)| (low - HEIGHT_TOLERANCE_M, high + HEIGHT_TOLERANCE_M));
    let surface = SurfaceOptions { up, height_band_m, ..SurfaceOptions::default() };
    let scene = SceneOptions { surface, ..SceneOptions::default() };
    let height_band_m = height_band_m.map(|(low, high)| (low, high + scene.tallest_m));
    (MergeOptions { up, height_band_m, ..MergeOptions::default() }, scene)
}

/// The part of the map that a frame shows; none if nothing returned.
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

/// By which names percepts are found again: what each may be, and how sure that is.
fn sightings(percepts: &[Percept]) -> Vec<Sighting> {
    let of = |p: &Percept| p.label.clone().map(|label| (p.probability_of(&label), label));
    let named = percepts.iter().filter_map(of);
    named.map(|(p, object)| Sighting { object, confidence: p.clamp(0.0, 1.0) }).collect()
}

/// The cameras that saw an object: those that measured the side of its body which faces them.
fn seen_from(p: &Percept, up: &Vector3<f64>, visibility: &Visibility) -> Vec<Point3<f64>> {
    let middle = p.position_m + up * (p.size_m[2] / 2.0);
    let radius = p.size_m[0].min(p.size_m[1]) / 2.0;
    let sees = |map: &&DepthMap| {
        let towards = map.viewpoint() - middle;
        let aside = towards - up * towards.dot(up);
        let side = middle + aside.try_normalize(1e-9).unwrap_or(*up) * radius;
        map.look(&side, SIDE_TOLERANCE_M) == Seen::Surface
    };
    visibility.maps.iter().filter(sees).map(DepthMap::viewpoint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_of_a_changed_place_or_through_it_is_void() {
        let foot = Point3::new(1.0, 0.0, 0.7);
        let change = Change { stamp_ns: 0, foot, up: Vector3::z(), radius_m: 0.3, height_m: 0.2 };
        let eye = Point3::new(0.0, 0.0, 1.4);
        for (to, crossed, what) in [
            ((1.0, 0.0, 0.8), true, "within"),
            ((2.0, 0.0, 0.3), true, "through it to the floor behind"),
            ((1.0, 0.0, 0.7), true, "the table under it"),
            ((1.0, 0.5, 0.7), false, "the table beside it"),
            ((3.0, 0.0, 1.3), false, "over it"),
            ((0.5, 0.0, 0.9), false, "before it"),
            ((-1.0, 0.0, 0.7), false, "away from it"),
        ] {
            assert_eq!(change.is_crossed(&eye, &Point3::new(to.0, to.1, to.2)), crossed, "{what}");
        }
    }
}
