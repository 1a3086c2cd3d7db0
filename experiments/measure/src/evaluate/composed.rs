//! Things that stand on or in others, upside down or made of parts: what a search says of them while they are there, and
//! while something else is there instead.

use descry_domains::load::Domain;
use descry_perception::recognise::{Handle, ObjectModel, Range, Shape as Form, Top};
use descry_robots::sim::composed::{Composed, Piece};
use descry_robots::sim::shape::{Cuboid, Cup, Cylinder, Shape};
use descry_robots::sim::{SceneSpec, SimOptions};

use super::room::{self, Answer, BESIDE, STRIDE};
use super::searching::Search;

/// Looks that a search may take; all poses of the ring but the start.
const LOOKS: usize = 8;

/// Kinds of scenes.
const KINDS: [&str; 11] =
    ["alone", "saucer", "tin", "bowl", "tray", "book", "box", "in a tin", "stacked", "upside down", "bottle"];

const ASKED: &str = r#"
[[object]]
name = "asked"
shape.cup = { diameter_m = 0.16, height_m = 0.25 }
area_m = [1.2, 0.5]
"#;

fn cup(diameter_m: f64, base_m: Option<f64>, height_m: f64) -> Shape {
    Shape::Cup(Cup { diameter_m, base_diameter_m: base_m, height_m, wall_m: 0.003 })
}

fn cylinder(diameter_m: f64, top_m: f64, height_m: f64) -> Shape {
    Shape::Cylinder(Cylinder { diameter_m, top_diameter_m: Some(top_m), height_m })
}

fn cuboid(x: f64, y: f64, z: f64) -> Shape {
    Shape::Box(Cuboid { size_m: [x, y, z] })
}

fn piece(shape: Shape, at_m: [f64; 3]) -> Piece {
    Piece { shape, at_m, turn_deg: [0.0; 3], colour: None, pattern: None }
}

/// A thing upside down, its rim at a height.
fn upturned(shape: Shape, at_m: f64) -> Piece {
    let height_m = shape.height_m();
    Piece { turn_deg: [180.0, 0.0, 0.0], ..piece(shape, [0.0, 0.0, at_m + height_m]) }
}

/// The parts of a scene of a kind; the asked thing, or what is there instead, is the last of them.
fn parts(kind: &str, present: bool, seed: u64) -> Vec<Piece> {
    let vary = |n: u64| 0.9 + 0.05 * ((seed / 3 + n) % 5) as f64;
    let asked = |at_m: [f64; 3]| {
        let other = [cup(0.082, None, 0.12), cylinder(0.056, 0.056, 0.10), cuboid(0.06, 0.07, 0.09)];
        piece(if present { cup(0.070, None, 0.104) } else { other[(seed % 3) as usize].clone() }, at_m)
    };
    let on = |support: Shape, at_m: [f64; 3]| vec![piece(support, [0.0; 3]), asked(at_m)];
    match kind {
        "alone" => vec![asked([0.0; 3])],
        "saucer" => on(cylinder(0.10 * vary(0), 0.15 * vary(0), 0.02), [0.005, -0.004, 0.018]),
        "tin" => on(cylinder(0.09 * vary(0), 0.09 * vary(0), 0.13 * vary(1)), [0.0, 0.004, 0.13 * vary(1)]),
        "bowl" => on(cup(0.16 * vary(0), Some(0.10), 0.055 * vary(1)), [0.008, 0.0, 0.004]),
        "tray" => on(cuboid(0.40 * vary(0), 0.30, 0.02), [0.08, 0.05, 0.02]),
        "book" => on(cuboid(0.17, 0.23 * vary(0), 0.03 * vary(1)), [0.03, -0.02, 0.03 * vary(1)]),
        "box" => on(cuboid(0.22 * vary(0), 0.16, 0.06 * vary(1)), [0.02, 0.01, 0.06 * vary(1)]),
        "in a tin" => on(cup(0.13 * vary(0), None, 0.07 * vary(1)), [0.0, 0.01, 0.004]),
        "stacked" => vec![upturned(cup(0.088, None, 0.155), 0.0), asked([0.003, 0.0, 0.155])],
        "upside down" => match present {
            true => vec![upturned(cup(0.070, None, 0.104), 0.0)],
            false => vec![upturned(
                [cup(0.086, None, 0.12), cup(0.06, None, 0.09)][(seed % 2) as usize].clone(),
                0.0,
            )],
        },
        _ if present => vec![
            piece(cylinder(0.07, 0.028, 0.04), [0.0, 0.0, 0.16]),
            piece(cylinder(0.028, 0.028, 0.05), [0.0, 0.0, 0.20]),
            piece(cylinder(0.07, 0.07, 0.16), [0.0; 3]),
        ],
        _ => vec![
            piece(cylinder(0.05, 0.05, 0.035), [0.0, 0.0, 0.125]),
            piece(cylinder(0.085, 0.085, 0.13), [0.0; 3]),
        ],
    }
}

fn bottle() -> ObjectModel {
    let range = |low: f64, high: f64| Range { low, high };
    ObjectModel {
        name: "bottle".into(),
        kind: "bottle".into(),
        phrases: Vec::new(),
        shape: Form::Round,
        height_m: range(0.24, 0.26),
        diameter_m: Some(range(0.065, 0.075)),
        width_m: None,
        depth_m: None,
        taper: range(2.0, 3.0),
        top: Top::Closed,
        handle: Handle::None,
        colours: Vec::new(),
    }
}

/// Prints a row for each kind (all without one): `count` scenes from a seed with the asked thing, and as many without it.
pub fn run(count: u64, first: u64, only: &str) -> Result<(), String> {
    let mut domain = Domain::load("tabletop").map_err(|e| e.to_string())?;
    domain.objects.push(bottle());
    let spec = room::spec("A thing on, in or under another", &format!("{ASKED}{BESIDE}"))?;
    let runtime = room::runtime()?;
    println!(
        "{:>12} {:>7} {:>6} {:>11} {:>15} {:>9} | {:>7} {:>10} {:>11} {:>9} | {:>6} {:>9}",
        "",
        "with it",
        "found",
        "cannot tell",
        "false not there",
        "elsewhere",
        "without",
        "not there",
        "cannot tell",
        "false yes",
        "looks",
        "cpu s"
    );
    for kind in KINDS.iter().filter(|kind| only.is_empty() || **kind == only) {
        let begun_s = processor_s();
        let (mut answers, mut looks) = ([[0; 4]; 2], 0);
        for seed in first..first + count {
            for (n, present) in [true, false].into_iter().enumerate() {
                let (answer, taken, words) = runtime
                    .block_on(one(&domain, &spec, kind, seed, present))
                    .map_err(|e| format!("{kind} {seed}: {e}"))?;
                answers[n][answer as usize] += 1;
                looks += taken;
                if !answer.is_right(present) {
                    eprintln!("{kind} {seed}, there {present}: {words}");
                }
            }
        }
        let [[found, open, denied, off], [yes, left, absent, off_too]] = answers;
        println!(
            "{kind:>12} {count:>7} {found:>6} {open:>11} {denied:>15} {off:>9} | {count:>7} {absent:>10} {left:>11} {:>9} | {:>6.1} {:>9.1}",
            yes + off_too,
            looks as f64 / (2 * count) as f64,
            processor_s() - begun_s
        );
    }
    Ok(())
}

/// The answer about one scene, after how many looks, and what was believed then.
async fn one(
    domain: &Domain,
    spec: &SceneSpec,
    kind: &str,
    seed: u64,
    present: bool,
) -> Result<(Answer, usize, String), String> {
    let mut scene = room::arranged(spec, seed)?;
    let target = scene.objects.iter_mut().find(|o| o.name == "asked").ok_or("nothing asked")?;
    let parts = parts(kind, present, seed);
    let at_m = parts.last().map_or([0.0; 3], |last| last.at_m);
    target.shape = Shape::Composed(Composed { parts });
    let place_m = present.then(|| room::in_map(target, at_m));
    let name = if kind == "bottle" { "bottle" } else { "cup A" };
    let options = SimOptions { seed, ..SimOptions::default() };
    let goal = format!("find {name}");
    let search = Search { domain, scene, options, goal: &goal, looks: LOOKS };
    let mut last = None;
    let heard = search
        .run(
            |poses| STRIDE % poses.len(),
            |situation| {
                let answer = Answer::of(situation, place_m);
                last = Some(room::believed(situation));
                (answer, answer != Answer::CannotTell)
            },
        )
        .await?;
    let answer = heard.last().copied().unwrap_or(Answer::CannotTell);
    Ok((answer, heard.len(), last.unwrap_or_default()))
}

/// Processor time of this program so far, seconds.
fn processor_s() -> f64 {
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok());
    ticks.sum::<f64>() / TICKS_A_SECOND
}
