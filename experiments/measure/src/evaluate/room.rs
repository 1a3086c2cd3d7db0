//! Room with one table in which searches are measured: its scenes, and what a search answers in them.

use descry_domains::reasons;
use descry_domains::situation::Situation;
use descry_memory::belief::Track;
use descry_perception::nalgebra::Point3;
use descry_robots::sim::{Object, Scene, SceneSpec, arrange};

/// Number of poses along the ring between one look and the next.
pub const STRIDE: usize = 3;
/// Maximum distance between an object and its stated place, metres.
const FOUND_M: f64 = 0.05;

const TABLE: &str = r#"
[[surface]]
name = "table"
size_m = [1.6, 0.8]
height_m = 0.72
[start]
position_m = [-1.4, 0.0]
"#;

/// Tables of the two things that stand beside what is asked for.
pub const BESIDE: &str = r#"
[[object]]
name = "carton"
shape.box = { size_m = [0.10, 0.06, 0.20] }
[[object]]
name = "can"
shape.cylinder = { diameter_m = 0.066, height_m = 0.12 }
"#;

/// Scene of the room with the given tables of TOML behind surface and start.
pub fn spec(title: &str, rest: &str) -> Result<SceneSpec, String> {
    SceneSpec::parse(title, &format!("title = {title:?}\n{TABLE}{rest}")).map_err(|e| e.to_string())
}

/// Arrangement of a scene by a seed; by later seeds where the first has none.
pub fn arranged(spec: &SceneSpec, seed: u64) -> Result<Scene, String> {
    (0..20).find_map(|n| arrange(spec, seed + n * 1_000_003).ok()).ok_or_else(|| "no arrangement".into())
}

/// Runtime of one thread.
pub fn runtime() -> Result<tokio::runtime::Runtime, String> {
    tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(|e| e.to_string())
}

/// Position of a point of an object in the map, metres.
pub fn in_map(object: &Object, at_m: [f64; 3]) -> Point3<f64> {
    object.map_from_object * Point3::from(at_m)
}

/// True if a believed position is that of an object at `place_m`.
pub fn is_at(believed_m: &Point3<f64>, place_m: &Point3<f64>) -> bool {
    (believed_m.xy() - place_m.xy()).norm() < FOUND_M
}

/// Answer of a search.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Answer {
    Found,
    CannotTell,
    NotThere,
    /// Found away from its true place, or while absent.
    Elsewhere,
}

impl Answer {
    /// Answer that a situation gives about the first thing, which truly is at `place_m`, or absent.
    pub fn of(s: &Situation, place_m: Option<Point3<f64>>) -> Answer {
        if s.confidence(0) < s.threshold {
            return if reasons::left_about(s, 0).is_none() { Answer::NotThere } else { Answer::CannotTell };
        }
        let p = |t: &&Track| s.things[0].probability(t, &s.surfaces);
        let best = s.belief.tracks.iter().max_by(|a, b| p(a).total_cmp(&p(b)));
        let is_there = best.zip(place_m).is_some_and(|(t, place_m)| is_at(&t.position_m, &place_m));
        if is_there { Answer::Found } else { Answer::Elsewhere }
    }

    /// True if the answer is the right one.
    pub fn is_right(self, present: bool) -> bool {
        self == if present { Answer::Found } else { Answer::NotThere }
    }
}

/// Belief about the first thing in one line.
pub fn believed(s: &Situation) -> String {
    let most = |list: &[(String, f64)]| {
        let best = list.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(String::new(), |(name, p)| format!(", {name} {p:.2}"))
    };
    let track = |t: &Track| {
        let (at, [a, b, c]) = (t.position_m, t.size_m.map(|m| (100.0 * m).round()));
        let p = s.things[0].probability(t, &s.surfaces);
        let names = most(&t.probabilities) + &most(&t.colours);
        format!("({:.2} {:.2} {:.3}) {a}x{b}x{c} it {p:.3}{names}, none {:.2}", at.x, at.y, at.z, t.unknown)
    };
    let tracks: Vec<String> = s.belief.tracks.iter().map(track).collect();
    let why = reasons::left_about(s, 0).unwrap_or_default();
    format!("{why} [{:.3}] {}", s.chance_there(0), tracks.join("; "))
}
