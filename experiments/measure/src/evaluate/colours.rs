//! Colours under changing light: what a search for a thing of a colour answers while it is there and while only others are,
//! which names colours get, and how far their probabilities are to be trusted.

use super::room::{self, Answer, STRIDE};
use super::searching::Search;
use descry_domains::load::Domain;
use descry_perception::calibration::{Claim, reliability};
use descry_perception::nalgebra::Point3;
use descry_perception::recognise::Colour;
use descry_robots::sim::{SceneSpec, SimOptions};

/// Paints of each colour. From: colours that CSS names so, or as a shade of it; another source than that of the recogniser's ranges.
const PAINTS: [(&str, &[[u8; 3]]); 11] = [
    ("black", &[[0, 0, 0], [20, 20, 22], [35, 33, 34]]),
    ("white", &[[255, 255, 255], [245, 245, 245], [255, 250, 250]]),
    ("grey", &[[128, 128, 128], [169, 169, 169], [105, 105, 105]]),
    ("red", &[[255, 0, 0], [178, 34, 34], [220, 20, 60], [139, 0, 0]]),
    ("orange", &[[255, 165, 0], [255, 140, 0], [255, 127, 80]]),
    ("yellow", &[[255, 255, 0], [255, 215, 0], [240, 230, 140]]),
    ("green", &[[0, 128, 0], [34, 139, 34], [50, 205, 50], [46, 139, 87]]),
    ("blue", &[[0, 0, 255], [65, 105, 225], [70, 130, 180], [30, 144, 255]]),
    ("purple", &[[128, 0, 128], [75, 0, 130], [147, 112, 219]]),
    ("pink", &[[255, 192, 203], [255, 105, 180], [255, 20, 147]]),
    ("brown", &[[139, 69, 19], [160, 82, 45], [205, 133, 63]]),
];
/// Looks that a search may take.
const LOOKS: usize = 6;

const LIGHT_AND_OBJECTS: &str = r#"
[light]
gain = [0.5, 1.3]
cast = 0.12
gloss = 0.6
noise = 4.0
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.070, height_m = 0.104 }
[[object]]
name = "mug"
shape.mug = { diameter_m = 0.080, height_m = 0.095 }
[[object]]
name = "other mug"
shape.mug = { diameter_m = 0.080, height_m = 0.095 }
[[object]]
name = "carton"
shape.box = { size_m = [0.10, 0.06, 0.20] }
colour = [190, 170, 60]
"#;

/// Names that tracks got: by true and likeliest name, and each probability with its truth.
#[derive(Default)]
struct Named {
    confusion: [[usize; 12]; 11],
    claims: Vec<Claim>,
}

/// Prints answers, names and reliability for `count` scenes from a seed, each with the asked thing and without it.
pub fn run(count: u64, first: u64) -> Result<(), String> {
    let domain = Domain::load("tabletop").map_err(|e| e.to_string())?;
    let mut mugs = domain.clone();
    let mug = domain.objects.iter().find(|o| o.name == "mug").cloned().ok_or("no mug")?;
    mugs.objects.retain(|o| o.kind != "mug");
    for name in ["red", "blue"] {
        let (phrases, colours) = (Vec::new(), vec![Colour::Name(name)]);
        mugs.objects.push(descry_perception::ObjectModel {
            name: format!("{name} mug"),
            phrases,
            colours,
            ..mug.clone()
        });
    }
    let spec = room::spec("A cup, two mugs and a carton under some light", LIGHT_AND_OBJECTS)?;
    let runtime = room::runtime()?;
    let mut named = Named::default();
    println!("{:>22} {:>6} {:>11} {:>9} {:>6}", "", "found", "cannot tell", "not there", "wrong");
    for (what, domain) in [("cup", &domain), ("mug by colour alone", &mugs)] {
        for present in [true, false] {
            let mut answers = [0; 4];
            for seed in first..first + count {
                let (answer, words) = runtime
                    .block_on(one(domain, &spec, (what, seed, present), &mut named))
                    .map_err(|e| format!("{what} {seed}: {e}"))?;
                answers[answer as usize] += 1;
                if !answer.is_right(present) {
                    eprintln!("{what} {seed}, there {present}: {words}");
                }
            }
            let [found, open, absent, wrong] = answers;
            let there = if present { "there" } else { "not there" };
            println!("{what:>12}, {there} {found:>6} {open:>11} {absent:>9} {wrong:>6}");
        }
    }
    tell(&named);
    Ok(())
}

/// The confusion of names, and the reliability of their probabilities.
fn tell(named: &Named) {
    print!("{:>8}", "");
    PAINTS.iter().for_each(|(name, _)| print!("{name:>8}"));
    println!("{:>8}", "several");
    for ((name, _), row) in PAINTS.iter().zip(&named.confusion) {
        print!("{name:>8}");
        row.iter().for_each(|n| print!("{n:>8}"));
        println!();
    }
    let told = reliability(&named.claims, 10);
    println!(
        "{} claims: Brier {:.4} (base {:.4}), ECE {:.4}",
        told.count, told.brier, told.brier_of_base_rate, told.expected_error
    );
    for bin in told.bins.iter().filter(|b| b.count > 0) {
        println!(
            "  {:.1}-{:.1}: {:5} said, {:.3} stated, {:.3} came true",
            bin.low, bin.high, bin.count, bin.stated, bin.came_true
        );
    }
}

/// The answer about one scene, and the belief then.
async fn one(
    domain: &Domain,
    spec: &SceneSpec,
    (what, seed, present): (&str, u64, bool),
    named: &mut Named,
) -> Result<(Answer, String), String> {
    let mut scene = room::arranged(spec, seed)?;
    let is_cup = what == "cup";
    let asked = if is_cup { seed as usize % PAINTS.len() } else { 3 };
    // Any colour but the one that is asked for, and another than the last.
    let other = |n: u64| (asked + 1 + ((seed / 11 + 3 * n) as usize) % (PAINTS.len() - 1)) % PAINTS.len();
    let first = if present { asked } else { other(0) };
    let colours = if is_cup { [first, other(1), asked] } else { [other(2), first, 7] };
    let mut truth: Vec<(usize, Point3<f64>)> = Vec::new();
    for (object, colour) in scene.objects.iter_mut().zip(colours) {
        let paints = PAINTS[colour].1;
        object.colour = paints[(seed / 7) as usize % paints.len()];
        truth.push((colour, room::in_map(object, [0.0; 3])));
    }
    let place_m = present.then(|| truth[usize::from(!is_cup)].1);
    let goal = if is_cup { format!("find the {} cup", PAINTS[asked].0) } else { "find the red mug".into() };
    let options = SimOptions { seed, ..SimOptions::default() };
    let mut last = None;
    let search = Search { domain, scene, options, goal: &goal, looks: LOOKS };
    let choose = |poses: &[String]| STRIDE % poses.len();
    let heard = search
        .run(choose, |s| {
            let answer = Answer::of(s, place_m);
            last = Some((format!("{goal}: {}", room::believed(s)), s.belief.tracks.clone()));
            (answer, !matches!(answer, Answer::CannotTell))
        })
        .await?;
    let (words, tracks) = last.ok_or("no look")?;
    for (colour, at) in truth {
        let near = tracks.iter().find(|t| room::is_at(&t.position_m, &at));
        let Some(track) = near.filter(|t| !t.colours.is_empty()) else { continue };
        let several = 1.0 - track.colours.iter().map(|(_, p)| p).sum::<f64>();
        let all: Vec<f64> = track.colours.iter().map(|(_, p)| *p).chain([several]).collect();
        let best = (0..all.len()).max_by(|&a, &b| all[a].total_cmp(&all[b])).unwrap_or_default();
        named.confusion[colour][best] += 1;
        named
            .claims
            .extend(track.colours.iter().zip(PAINTS).map(|((_, p), (n, _))| (*p, n == PAINTS[colour].0)));
    }
    Ok((heard.last().copied().unwrap_or(Answer::CannotTell), words))
}
