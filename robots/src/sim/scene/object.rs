//! Objects on surfaces, and the visibility required of their arrangement.

use super::check::{finite, object, positive};
use super::surface::headroom_m;
use super::{SceneSpec, SurfaceSpec, default_grey, one_or_many};
use crate::input::{Objection, Step};
use crate::sim::composed::{Composed, household};
use crate::sim::shape::{Cuboid, Shape};
use serde::{Deserialize, Serialize};

/// An object on a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSpec {
    /// Name of the object, unique in the scene.
    pub name: String,
    /// Kind of the object; the name if left out.
    #[serde(default)]
    pub kind: Option<String>,
    /// Shape of the object.
    pub shape: Shape,
    /// Names of the surfaces from which the seed chooses; the first surface of the scene if left out.
    #[serde(default, with = "one_or_many", skip_serializing_if = "Vec::is_empty")]
    pub on: Vec<String>,
    /// Weight of each surface in `on` for the seed's choice; equal if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<Vec<f64>>,
    /// Name of an earlier object; this one is placed on another surface than that one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub apart_from: Option<String>,
    /// Fixed position, from the centre of the surface along its axes, metres.
    #[serde(default)]
    pub position_m: Option<[f64; 2]>,
    /// Fixed rotation on the surface, degrees.
    #[serde(default)]
    pub yaw_deg: Option<f64>,
    /// Size of the rectangle in which the object is placed, along the surface's axes, metres; the whole
    /// surface if left out.
    #[serde(default)]
    pub area_m: Option<[f64; 2]>,
    /// Centre of that rectangle, from the centre of the surface, metres.
    #[serde(default)]
    pub area_centre_m: [f64; 2],
    /// Minimum and maximum factor by which the shape is scaled, drawn by the seed.
    #[serde(default)]
    pub scale: Option<[f64; 2]>,
    /// Red, green, blue.
    #[serde(default = "default_grey")]
    pub colour: [u8; 3],
    /// Volume of the liquid in it, litres.
    #[serde(default)]
    pub holds_l: f64,
    /// The visits in which the object is present; all if left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visits: Vec<usize>,
    /// The visits in which the object stands elsewhere than in the visit before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moves: Vec<usize>,
}

/// Required visibility of one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetSpec {
    /// Name of the object.
    pub object: String,
    /// Minimum and maximum share of the object visible from the start, with the camera turned to it. 0 to 0
    /// requires that the object is hidden.
    #[serde(default = "default_any_share")]
    pub visible_from_start: [f64; 2],
    /// Minimum share of the object visible from some pose around its surface; 0 requires nothing.
    #[serde(default = "default_some_share")]
    pub visible_from_some: f64,
}

fn default_any_share() -> [f64; 2] {
    [0.0, 1.0]
}
fn default_some_share() -> f64 {
    0.6
}

impl SceneSpec {
    pub(super) fn check_object(&self, i: usize, o: &ObjectSpec) -> Result<(), Objection> {
        let at = |key| vec![Step::Key("object"), Step::Index(i), Step::Key(key)];
        if self.objects[..i].iter().any(|other| other.name == o.name) {
            return Err(object(
                &at("name"),
                format!("a second object is called \"{}\"", o.name),
                "give each its own name; `kind` may be the same".into(),
            ));
        }
        check_shape(&o.shape, &at("shape"))?;
        if !(0.0..=o.shape.capacity_l()).contains(&o.holds_l) {
            return Err(object(
                &at("holds_l"),
                format!("{} l are not in it", o.holds_l),
                format!("0 to {:.2} l are, by its shape", o.shape.capacity_l()),
            ));
        }
        self.check_on(o, &at)?;
        self.check_apart(i, o, &at)?;
        if let Some(area) = o.area_m {
            positive(&area, &at("area_m"))?;
        }
        finite(&o.area_centre_m, &at("area_centre_m"))?;
        if let Some([low, high]) = o.scale {
            positive(&[low, high], &at("scale"))?;
            if low > high {
                return Err(object(
                    &at("scale"),
                    format!("the least factor {low} is above the greatest {high}"),
                    format!("[{high}, {low}]"),
                ));
            }
            check_shape(&o.shape.scaled(low), &at("scale"))?;
        }
        if let Some(position) = o.position_m {
            finite(&position, &at("position_m"))?;
            let beside = |s: &&SurfaceSpec| (0..2).any(|k| position[k].abs() > 0.5 * s.size_m[k]);
            if let Some(surface) = self.surfaces_of(o).into_iter().find(beside) {
                return Err(object(
                    &at("position_m"),
                    format!("\"{}\" stands beside \"{}\"", o.name, surface.name),
                    "positions are from the centre of the surface, along its axes".into(),
                ));
            }
        }
        finite(&[o.yaw_deg.unwrap_or(0.0)], &at("yaw_deg"))
    }

    /// Checks that the surfaces of an object exist and have enough headroom, and that its weights are valid.
    fn check_on(&self, o: &ObjectSpec, at: &impl Fn(&'static str) -> Vec<Step>) -> Result<(), Objection> {
        let known: Vec<&str> = self.surfaces.iter().map(|s| s.name.as_str()).collect();
        if known.is_empty() && o.on.is_empty() {
            let problem = "the scene has no surface to stand on";
            return Err(object(&at("on"), problem.into(), "add a [[surface]]".into()));
        }
        for (k, on) in o.on.iter().enumerate() {
            let path = if o.on.len() > 1 { [at("on"), vec![Step::Index(k)]].concat() } else { at("on") };
            if !known.contains(&on.as_str()) {
                let mend = if known.is_empty() { "none yet".into() } else { known.join(", ") };
                return Err(object(
                    &path,
                    format!("there is no surface \"{on}\""),
                    format!("one of: {mend}"),
                ));
            }
            if o.on[..k].contains(on) {
                let mend = "keep one of them; `weights` makes one likelier";
                return Err(object(&path, format!("\"{on}\" is there twice"), mend.into()));
            }
        }
        let height_m = o.scale.map_or(o.shape.height_m(), |[_, high]| o.shape.scaled(high).height_m());
        for surface in self.surfaces_of(o) {
            let room_m = headroom_m(&self.surfaces, surface);
            if height_m > room_m {
                return Err(object(
                    &at("on"),
                    format!(
                        "\"{}\" is {height_m:.3} m high; above \"{}\" there are {room_m:.3} m",
                        o.name, surface.name
                    ),
                    "put it elsewhere, or the surface above higher".into(),
                ));
            }
        }
        let Some(weights) = &o.weights else { return Ok(()) };
        if weights.len() != o.on.len() {
            return Err(object(
                &at("weights"),
                format!("{} weights for {} surfaces", weights.len(), o.on.len()),
                "one for each name in `on`".into(),
            ));
        }
        let sound = weights.iter().all(|w| w.is_finite() && *w >= 0.0) && weights.iter().sum::<f64>() > 0.0;
        if sound {
            return Ok(());
        }
        Err(object(&at("weights"), "these are no weights".into(), "numbers from 0 up, not all 0".into()))
    }

    fn check_apart(
        &self,
        i: usize,
        o: &ObjectSpec,
        at: &impl Fn(&'static str) -> Vec<Step>,
    ) -> Result<(), Objection> {
        let Some(other) = &o.apart_from else { return Ok(()) };
        if !self.objects[..i].iter().any(|earlier| &earlier.name == other) {
            return Err(object(
                &at("apart_from"),
                format!("no object \"{other}\" comes before \"{}\"", o.name),
                "the name of an [[object]] above this one".into(),
            ));
        }
        if o.on.len() < 2 {
            return Err(object(
                &at("apart_from"),
                format!("\"{}\" has no other surface to stand on", o.name),
                "give `on` two or more".into(),
            ));
        }
        Ok(())
    }

    /// Possible surfaces of an object.
    pub(crate) fn surfaces_of(&self, o: &ObjectSpec) -> Vec<&SurfaceSpec> {
        if o.on.is_empty() {
            return self.surfaces.iter().take(1).collect();
        }
        o.on.iter().filter_map(|name| self.surfaces.iter().find(|s| &s.name == name)).collect()
    }

    pub(super) fn check_target(&self) -> Result<(), Objection> {
        let Some(target) = &self.target else { return Ok(()) };
        let at = |key| [Step::Key("target"), Step::Key(key)];
        if !self.objects.iter().any(|o| o.name == target.object) {
            let names: Vec<&str> = self.objects.iter().map(|o| o.name.as_str()).collect();
            return Err(object(
                &at("object"),
                format!("there is no object \"{}\"", target.object),
                format!("one of: {}", names.join(", ")),
            ));
        }
        let [low, high] = target.visible_from_start;
        if !(0.0 <= low && low <= high && high <= 1.0) {
            return Err(object(
                &at("visible_from_start"),
                format!("[{low}, {high}] is no range of shares"),
                "least and greatest share, between 0 and 1".into(),
            ));
        }
        if !(0.0..=1.0).contains(&target.visible_from_some) {
            return Err(object(
                &at("visible_from_some"),
                format!("{} is no share", target.visible_from_some),
                "a number between 0 and 1".into(),
            ));
        }
        Ok(())
    }
}

fn check_shape(shape: &Shape, path: &[Step]) -> Result<(), Objection> {
    let within = |kind, key| [path, &[Step::Key(kind), Step::Key(key)]].concat();
    let check_wall = |kind, rim_m: f64, base_m: Option<f64>, height_m: f64, wall_m: f64| {
        positive(&[rim_m], &within(kind, "diameter_m"))?;
        positive(&[base_m.unwrap_or(rim_m)], &within(kind, "base_diameter_m"))?;
        positive(&[height_m], &within(kind, "height_m"))?;
        positive(&[wall_m], &within(kind, "wall_m"))?;
        let room_m = (0.5 * rim_m.min(base_m.unwrap_or(rim_m))).min(height_m);
        if 2.0 * wall_m > room_m {
            return Err(object(
                &within(kind, "wall_m"),
                format!("a wall of {wall_m} m leaves no inside"),
                format!("at most {:.4}", 0.5 * room_m),
            ));
        }
        Ok(())
    };
    match shape {
        Shape::Cup(c) => check_wall("cup", c.diameter_m, c.base_diameter_m, c.height_m, c.wall_m),
        Shape::Mug(m) => {
            check_wall("mug", m.diameter_m, m.base_diameter_m, m.height_m, m.wall_m)?;
            positive(&[m.handle_thickness_m], &within("mug", "handle_thickness_m"))?;
            if !(m.handle_m > m.handle_thickness_m && 2.0 * m.handle_m <= m.height_m) {
                return Err(object(
                    &within("mug", "handle_m"),
                    format!("a handle that stands out {} m does not fit this mug", m.handle_m),
                    format!(
                        "more than its thickness {} and at most half the height {}",
                        m.handle_thickness_m,
                        0.5 * m.height_m
                    ),
                ));
            }
            Ok(())
        }
        Shape::Cylinder(c) => {
            positive(&[c.diameter_m], &within("cylinder", "diameter_m"))?;
            positive(&[c.top_diameter_m.unwrap_or(c.diameter_m)], &within("cylinder", "top_diameter_m"))?;
            positive(&[c.height_m], &within("cylinder", "height_m"))
        }
        Shape::Canister(c) => {
            positive(&[c.diameter_m], &within("canister", "diameter_m"))?;
            positive(&[c.lid_diameter_m], &within("canister", "lid_diameter_m"))?;
            positive(&[c.lid_height_m], &within("canister", "lid_height_m"))?;
            positive(&[c.height_m - c.lid_height_m], &within("canister", "height_m"))
        }
        Shape::Box(Cuboid { size_m }) => positive(size_m, &within("box", "size_m")),
        Shape::Ball(ball) => positive(&ball.size_m, &within("ball", "size_m")),
        Shape::Rod(rod) => {
            positive(&[rod.diameter_m], &within("rod", "diameter_m"))?;
            positive(&[rod.length_m - rod.diameter_m], &within("rod", "length_m"))
        }
        Shape::Bow(bow) => {
            positive(&[bow.thickness_m], &within("bow", "thickness_m"))?;
            positive(&[bow.height_m - 2.0 * bow.thickness_m], &within("bow", "height_m"))
        }
        Shape::Composed(composed) => check_parts(composed, &within("composed", "parts")),
        Shape::Household(name) if household().all(|known| known != name) => Err(object(
            &[path, &[Step::Key("household")]].concat(),
            format!("nothing of a household is called \"{name}\""),
            format!("one of: {}", household().collect::<Vec<_>>().join(", ")),
        )),
        Shape::Household(_) => Ok(()),
    }
}

fn check_parts(composed: &Composed, path: &[Step]) -> Result<(), Objection> {
    if composed.parts.is_empty() {
        return Err(object(path, "it has no part".into(), "give at least one".into()));
    }
    composed.parts.iter().enumerate().try_for_each(|(n, part)| {
        let at = |key| [path, &[Step::Index(n), Step::Key(key)]].concat();
        check_shape(&part.shape, &at("shape"))?;
        finite(&part.at_m, &at("at_m"))?;
        finite(&part.turn_deg, &at("turn_deg"))?;
        part.pattern.map_or(Ok(()), |pattern| positive(&[pattern.size_m], &at("pattern")))
    })
}
