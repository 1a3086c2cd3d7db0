//! Cases beyond the paper: a diagonal wall, a round room, a corridor that is bare on one side, glass.

use super::corridor::measure::{score, survey};
use super::corridor::{Building, Panel, Rig, along};
use super::plot::{Sheet, write};
use super::poses::{off, options, steps};
use descry_perception::mapping::{MapOptions, Matcher, RoomMap, chained};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use std::f64::consts::TAU;
use std::path::Path;

/// Poses at each place (x, y in metres), with headings every 20 degrees.
fn looking_round(places: &[(f64, f64)]) -> Vec<Isometry2<f64>> {
    let turn = |(x, y): (f64, f64)| {
        (0..18).map(move |i| Isometry2::new(Vector2::new(x, y), TAU * f64::from(i) / 18.0))
    };
    places.iter().copied().flat_map(turn).collect()
}

fn told(name: &str, building: &Building, truths: &[Isometry2<f64>], seed: u64) -> Result<RoomMap, String> {
    let stations = building.drive(truths, &Rig::default(), seed);
    let pairs = steps(&stations, &options(Matcher::IcpEm))?;
    let chain = chained(&pairs);
    let last = truths.len() - 1;
    let (way, turn) = off(&chain[last], &truths[0].inv_mul(&truths[last]));
    let odometry = stations[0].odom_from_level.inv_mul(&stations[last].odom_from_level);
    let (way_before, turn_before) = off(&odometry, &truths[0].inv_mul(&truths[last]));
    let map = survey(&stations, truths).map(&MapOptions::default()).map_err(|e| e.to_string())?;
    let s = score(&map, building, 0.15, truths, truths);
    println!(
        "{name:<34} last pose off {:>5.2} m {:>5.1}° by odometry, {way:>5.2} m {turn:>5.1}° rectified; walls {:>2} (truth {:>2}), precision {:>5.1}, recall {:>5.1} %, angle {:.2}°, main direction {}{}",
        way_before,
        turn_before,
        s.walls,
        building.walls.len(),
        100.0 * s.precision,
        100.0 * s.recall,
        s.angle_deg,
        map.main_rad.map_or("none".to_owned(), |m| format!("{:.1}°", m.to_degrees())),
        map.cylinders
            .iter()
            .map(|c| format!(
                "; a cylinder of radius {:.2} m at ({:.2}, {:.2}), {:.0}° of it seen from {}, rms {:.1} cm",
                c.radius_m,
                c.middle.x,
                c.middle.y,
                c.arc_rad().to_degrees(),
                if c.from_inside { "inside" } else { "outside" },
                100.0 * c.rms_m
            ))
            .collect::<String>()
    );
    Ok(map)
}

/// Corridor 22 m long without doors, with textures for its left and right walls, and a drive through it.
fn bare(left: f64, right: f64) -> (Building, Vec<Isometry2<f64>>) {
    let at = Point2::new;
    let corners = [at(-2.0, -1.1), at(20.0, -1.1), at(20.0, 1.1), at(-2.0, 1.1)];
    let building = Building::room(&corners, |i| [right, 0.5, left, 0.5][i]);
    (building, along(&[at(0.0, 0.0), at(16.0, 0.0)], 0.8, 0.3))
}

/// Prints errors of poses and walls in buildings of other forms.
pub fn print(seed: u64, out: Option<&Path>) -> Result<(), String> {
    let at = Point2::new;
    println!("\nother buildings: poses by the wheels and rectified, walls at true poses");
    let square = [at(3.0, -2.5), at(3.0, 2.5), at(-3.0, 2.5), at(-3.0, -2.5)];
    let cut = [at(3.0, -2.5), at(3.0, 0.5), at(1.0, 2.5), at(-3.0, 2.5), at(-3.0, -2.5)];
    let round: Vec<Point2<f64>> =
        (0..72).map(|i| TAU * f64::from(i) / 72.0).map(|a| at(3.0 * a.cos(), 3.0 * a.sin())).collect();
    let places = [(0.5, 0.2), (-1.0, -0.6)];
    told("square room", &Building::room(&square, |_| 0.5), &looking_round(&places), seed)?;
    let diagonal = told("a diagonal wall", &Building::room(&cut, |_| 0.5), &looking_round(&places), seed)?;
    let round = told("round room", &Building::room(&round, |_| 0.5), &looking_round(&places), seed)?;
    let both = bare(0.5, 0.5);
    told("corridor without doors", &both.0, &both.1, seed)?;
    let one = bare(0.5, 0.0);
    told("the same, bare on one side", &one.0, &one.1, seed)?;
    let none = bare(0.0, 0.0);
    told("the same, bare on both sides", &none.0, &none.1, seed)?;
    // Glass: the camera sees through it, now and then its frame.
    let mut glass = Building::room(&square, |i| if i == 1 { 0.0 } else { 0.5 });
    let (a, b) = (at(3.0, 2.5), at(-3.0, 2.5));
    glass.panels.retain(|p| !(p.a == a && p.b == b));
    for i in 0..=4 {
        let post = a + (b - a) * (f64::from(i) / 4.0);
        glass.panels.push(Panel { a: post, b: post + Vector2::new(-0.06, 0.0), z: (0.0, 2.6), texture: 0.9 });
    }
    glass.panels.push(Panel { a: at(6.0, 5.5), b: at(-6.0, 5.5), z: (0.0, 2.6), texture: 0.5 });
    let map = told("a glass wall (3 m behind it a wall)", &glass, &looking_round(&places), seed)?;
    let stood = |y: f64| {
        map.feet()
            .filter(|(a, b)| (a.y - y).abs() < 0.3 && (b.y - y).abs() < 0.3)
            .map(|(a, b)| (b - a).norm())
            .fold(0.0, |sum, length: f64| sum + length)
    };
    println!(
        "{:<34} {:.1} m of wall where the glass is, {:.1} m where the wall behind it is: glass is not seen, and the grid says it is open",
        "",
        stood(2.5),
        stood(5.5)
    );
    let Some(dir) = out else { return Ok(()) };
    let plots = [("a diagonal wall", &diagonal), ("a round room", &round), ("a glass wall", &map)].map(
        |(name, map)| {
            let mut sheet = Sheet::new(at(-4.5, -3.5), at(4.5, 6.5), 40.0);
            if let Some(grid) = &map.grid {
                sheet.grid(grid);
            }
            sheet.upright(map);
            (name, sheet)
        },
    );
    write(dir, "variations.svg", &plots)
}
