//! Scenes: errors in them, and their arrangements by seeds.

use crate::scenes::on_a_table;
use descry_robots::Pose2;
use descry_robots::nalgebra::Point3;
use descry_robots::sim::shape::Shape;
use descry_robots::sim::{Object, Scene, SceneSpec, SimOptions, SimRobot, arrange};
use std::path::Path;

const GOOD: &str = on_a_table!(
    r#"[start]
position_m = [-2.0, 0.0]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.07, height_m = 0.1 }
[[object]]
name = "mug"
shape.mug = { diameter_m = 0.08, height_m = 0.095 }
[target]
object = "cup"
"#
);

#[test]
fn mistakes_are_drawn_at_their_place() {
    for (from, to, line, words) in [
        ("height_m = 0.72", "height_m = -1", 5, &["found -1", "above zero"][..]),
        ("height_m = 0.72", "heigth_m = 0.72", 5, &["unknown field `heigth_m`", "height_m"]),
        (
            "height_m = 0.72",
            "height_m = \"high\"",
            5,
            &["invalid type", "expected a number", "write what is expected"],
        ),
        ("shape.cup =", "shape.cupp =", 10, &["cupp", "mug"]),
        ("diameter_m = 0.07,", "diameter_m = 0,", 10, &["found 0"]),
        ("height_m = 0.1 }", "height_m = 0.1, wall_m = 0.03 }", 10, &["leaves no inside", "at most 0.0175"]),
        ("name = \"mug\"", "name = \"cup\"", 12, &["second object", "\"cup\""]),
        ("name = \"mug\"", "name = \"mug\"\non = \"shelf\"", 13, &["no surface \"shelf\"", "table"]),
        ("name = \"mug\"", "name = \"mug\"\nposition_m = [2.0, 0.0]", 13, &["beside"]),
        ("height_m = 0.095 }", "height_m = 0.06 }", 13, &["handle", "at most half the height 0.03"]),
        ("object = \"cup\"", "object = \"jug\"", 15, &["no object \"jug\"", "cup, mug"]),
        ("object = \"cup\"", "object = \"cup\"\nvisible_from_start = [0.5, 0.2]", 16, &["no range"]),
        ("name = \"mug\"", "name = \"mug\"\nscale = [0.01, 1.0]", 13, &["no inside"]),
        ("[start]", "[room]\nsize_m = [1e9, 5]\n[start]", 7, &["at most 100"]),
        ("[-2.0, 0.0]", "[-9.0, 0.0]", 7, &["outside the room"]),
        (
            "height_m = 0.72",
            "height_m = 0.72\nposition_m = [2.8, 0.0]",
            6,
            &["\"table\" is not within the room", "give [room] a `size_m`"],
        ),
        ("[-2.0, 0.0]", "[-2.0, nan]", 7, &["expected a number"]),
        ("[target]", "[target", 14, &["no TOML"]),
        ("height_m = 0.72", "", 2, &["missing field `height_m`", "add it"]),
        ("shape.cup =", "colour = [0, 300, 0]\nshape.cup =", 10, &["from 0 to 255"]),
    ] {
        assert!(GOOD.contains(from), "{from}");
        let text = GOOD.replacen(from, to, 1);
        let error = SceneSpec::parse("my.toml", &text).expect_err(to);
        let drawn = error.to_string();
        assert_eq!(error.line, line, "{drawn}");
        assert!(drawn.starts_with(&format!("my.toml:{line}:")), "{drawn}");
        for word in words {
            assert!(drawn.contains(word), "no {word:?} in: {drawn}");
        }
    }
}

fn scenes() -> Vec<(String, SceneSpec)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../domains/tabletop/scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let read = |path: &std::path::PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(path).unwrap();
        let spec = SceneSpec::parse(&name, &text).unwrap_or_else(|e| panic!("{e}"));
        (name, spec)
    };
    files.iter().map(read).collect()
}

/// True if a point of the table, map frame, is under the object.
fn covers(o: &Object, p: &Point3<f64>) -> bool {
    let q = o.map_from_object.inverse_transform_point(p);
    match &o.shape {
        Shape::Box(b) => q.x.abs() < 0.5 * b.size_m[0] && q.y.abs() < 0.5 * b.size_m[1],
        other => q.x.hypot(q.y) < 0.5 * (other.bounds().1.y - other.bounds().0.y),
    }
}

fn check_arrangement(name: &str, seed: u64, spec: &SceneSpec, scene: &Scene) {
    for o in &scene.objects {
        let surface = o.surface().and_then(|s| scene.surface(s)).unwrap();
        let top = surface.map_from_top();
        for i in -40..=40 {
            for j in -20..=20 {
                let p = top * Point3::new(f64::from(i) * 0.02, f64::from(j) * 0.02, 0.0);
                let here: Vec<&str> =
                    scene.objects.iter().filter(|o| covers(o, &p)).map(|o| o.name.as_str()).collect();
                assert!(here.len() < 2, "{name} seed {seed}: {here:?} overlap");
            }
        }
        let (low, high) = o.shape.bounds();
        for x in [low.x, high.x] {
            for y in [low.y, high.y] {
                let p = top.inverse_transform_point(&(o.map_from_object * Point3::new(x, y, 0.0)));
                let half = surface.size_m.map(|s| 0.5 * s + 0.02);
                assert!(p.x.abs() <= half[0] && p.y.abs() <= half[1], "{name} {seed}: {} juts out", o.name);
                assert!(p.z.abs() < 1e-9);
            }
        }
    }
    if let Some(target) = &spec.target {
        let share = scene.target_visible_from_start.unwrap();
        assert!(target.visible_from_start[0] <= share && share <= target.visible_from_start[1]);
    }
}

#[test]
fn every_scene_can_be_arranged() {
    for (name, spec) in scenes() {
        for seed in 1..=10 {
            let scene = arrange(&spec, seed).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(scene, arrange(&spec, seed).unwrap(), "{name}: the same seed, another scene");
            check_arrangement(&name, seed, &spec, &scene);
        }
        if spec.objects.iter().any(|o| o.position_m.is_none()) {
            assert_ne!(arrange(&spec, 1).unwrap(), arrange(&spec, 2).unwrap(), "{name}");
        }
    }
}

#[test]
fn the_target_hides_from_the_start_and_not_from_everywhere() {
    let (_, spec) = scenes().into_iter().find(|(name, _)| name == "default.toml").unwrap();
    for seed in 1..=20 {
        let scene = arrange(&spec, seed).unwrap();
        let start = scene.start;
        let robot = SimRobot::new(scene, SimOptions::default());
        assert_eq!(robot.true_visible_share("cup A", &start), 0.0, "seed {seed}");
        let best = (0..16)
            .map(|k| f64::from(k) * std::f64::consts::TAU / 16.0)
            .map(|a| Pose2::facing(1.4 * a.cos(), 1.4 * a.sin(), &[0.0, 0.0].into()))
            .map(|pose| robot.true_visible_share("cup A", &pose))
            .fold(0.0, f64::max);
        assert!(best > 0.5, "seed {seed}: {best} at best");
    }
}

/// All occlusion levels of the experiments, in every scene with occluders.
#[test]
fn every_level_of_occlusion_can_be_arranged() {
    for (name, spec) in
        scenes().into_iter().filter(|(name, _)| ["default.toml", "clutter.toml"].contains(&&**name))
    {
        for level in [[0.0, 0.0], [0.0, 0.25], [0.25, 0.6]] {
            let mut spec = spec.clone();
            if let Some(target) = &mut spec.target {
                target.visible_from_start = level;
            }
            for seed in 100..130 {
                let scene = arrange(&spec, seed).unwrap_or_else(|e| panic!("{name} {level:?}: {e}"));
                let share = scene.target_visible_from_start.unwrap();
                assert!(level[0] <= share && share <= level[1], "{name} {level:?} seed {seed}: {share}");
            }
        }
    }
}

#[test]
fn what_cannot_be_arranged_says_why() {
    for (from, to, word) in [
        ("[-2.0, 0.0]", "[-0.9, 0.0]", "cannot stand at its start"),
        ("object = \"cup\"", "object = \"cup\"\nvisible_from_start = [0.0, 0.0]", "seen from the start"),
        (
            "height_m = 0.1 }",
            "height_m = 0.1 }\narea_m = [0.01, 0.01]\narea_centre_m = [0.9, 0.0]",
            "no room",
        ),
    ] {
        let spec = SceneSpec::parse("my.toml", &GOOD.replacen(from, to, 1)).unwrap();
        let error = arrange(&spec, 1).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_target_can_be_left_out() {
    let spec = SceneSpec::parse("my.toml", GOOD).unwrap().without("cup");
    assert!(spec.target.is_none() && spec.check().is_ok());
    assert!(arrange(&spec, 1).unwrap().object("cup").is_none());
}

/// Two tables, with objects that appear, disappear and move.
const VISITS: &str = "
visits = 3
[start]
position_m = [-2.0, 0.0]
[[surface]]
name = 'table'
size_m = [1.4, 0.9]
height_m = 0.72
[[obstacle]]
name = 'chair'
position_m = [0.0, 1.2]
size_m = [0.4, 0.4, 0.45]
legs_m = 0.03
back_m = 0.4
visits = [2]
on_map = false
[[object]]
name = 'tissues'
shape.household = 'tissues'
[[object]]
name = 'radio'
shape.household = 'radio'
visits = [1]
[[object]]
name = 'kettle'
shape.household = 'kettle'
visits = [2, 3]
moves = [3]
scale = [0.9, 1.1]
";

#[test]
fn between_visits_things_come_go_and_move_and_the_others_stay() {
    for seed in 1..6 {
        let visit = |n: usize| {
            let spec = SceneSpec::parse("visits.toml", &format!("visit = {n}\n{VISITS}")).unwrap();
            arrange(&spec, seed).unwrap()
        };
        let visits = [visit(1), visit(2), visit(3)];
        let names: Vec<Vec<&str>> =
            visits.iter().map(|s| s.objects.iter().map(|o| o.name.as_str()).collect()).collect();
        assert_eq!(names, [vec!["tissues", "radio"], vec!["tissues", "kettle"], vec!["tissues", "kettle"]]);
        assert_eq!(visits.each_ref().map(|s| s.obstacles.len()), [0, 1, 0]);
        let at = |n: usize, name: &str| visits[n].object(name).unwrap().map_from_object;
        assert!(at(0, "tissues") == at(1, "tissues") && at(1, "tissues") == at(2, "tissues"));
        assert_ne!(at(1, "kettle"), at(2, "kettle"));
        assert_eq!(visits[1].object("kettle").unwrap().shape, visits[2].object("kettle").unwrap().shape);
    }
}

#[test]
fn visits_and_household_things_that_are_not_there_are_refused() {
    let check = |from: &str, to: &str, said: &str| {
        let error = SceneSpec::parse("visits.toml", &VISITS.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    };
    check("visits = [2, 3]", "visits = [2, 4]", "there is no visit 4");
    check("visits = 3", "visits = 3\nvisit = 5", "there is no visit 5");
    check("'kettle'\nvisits", "'cattle'\nvisits", "nothing of a household is called \"cattle\"");
    check("legs_m = 0.03\n", "", "no seat");
}
