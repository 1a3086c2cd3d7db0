//! Pillars, announced as future work in the paper: halls with round and square posts, seen on a drive around
//! and between them.

use super::corridor::measure::{BODY_M, MAP_FAR_M, PillarScore, score_pillars};
use super::corridor::{Building, CAMERA_HEIGHT_M, Rig, along};
use super::plot::{Sheet, write};
use super::tabletop::Draws;
use descry_perception::mapping::{MapOptions, Station, Survey};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use std::path::Path;

/// Number of simulated halls with posts.
const HALLS: u64 = 20;

/// Poses around the rows of posts, and between them.
fn way() -> Vec<Isometry2<f64>> {
    let at = Point2::new;
    let corners = [at(-5.0, -3.0), at(5.0, -3.0), at(5.0, 3.0), at(-5.0, 3.0), at(-5.0, 0.0), at(5.0, 0.0)];
    along(&corners, 0.8, 0.5)
}

/// Survey of a hall at poses with errors `off`: standard deviations, metres and radians.
fn seen(hall: &Building, edge_m: f64, off: (f64, f64), seed: u64) -> Survey {
    let truths = way();
    let mut draws = Draws(seed);
    let mut survey = Survey::new(edge_m).expect("a length");
    for truth in &truths {
        let points = hall.look(truth, &Rig::default(), &mut draws);
        let shift = Vector2::new(draws.normal(), draws.normal()) * off.0;
        let pose = truth * Isometry2::new(shift, off.1 * draws.normal());
        let station = Station { points, odom_from_level: pose };
        survey.add(&station, &pose, CAMERA_HEIGHT_M, MAP_FAR_M, &BODY_M).expect("a pose");
    }
    survey
}

/// Prints how many of the posts are found, and how accurately.
pub fn print(seed: u64, out: Option<&Path>) -> Result<(), String> {
    println!(
        "\n{HALLS} halls with eight posts each, some round: pillars found of those that there are, false ones, how far axis and radius are off (cm); walls"
    );
    for (name, edge_m, off) in [
        ("cells of 10 cm, true poses", 0.1, (0.0, 0.0)),
        ("poses off by 2 cm and 0.5 degrees", 0.1, (0.02, 0.009)),
        ("cells of 5 cm, true poses", 0.05, (0.0, 0.0)),
    ] {
        let mut sum = PillarScore::default();
        let (mut hit_m, mut radius_m) = (0.0, 0.0);
        for k in 0..HALLS {
            let hall = Building::hall(1000 * seed + k);
            let map = seen(&hall, edge_m, off, 1000 * seed + k)
                .map(&MapOptions::default())
                .map_err(|e| e.to_string())?;
            let score = score_pillars(&map.cylinders, &hall);
            let right = (score.found - score.wrong) as f64;
            (hit_m, radius_m) = (hit_m + right * score.off_m, radius_m + right * score.radius_off_m);
            sum.found += score.found;
            sum.wrong += score.wrong;
            sum.all += score.all;
            if let Some(dir) = out.filter(|_| k == 0 && edge_m == 0.1 && off.0 == 0.0) {
                let mut sheet = Sheet::new(Point2::new(-7.0, -5.0), Point2::new(7.0, 5.0), 40.0);
                if let Some(grid) = &map.grid {
                    sheet.grid(grid);
                }
                sheet.upright(&map);
                sheet.levels(&map);
                sheet.drive(&way());
                write(dir, "pillars.svg", &[("a hall: walls, pillars, open floor", sheet)])?;
            }
        }
        let right = sum.found - sum.wrong;
        println!(
            "{name:<36} {right} of {}, recall {:.1} %, precision {:.1} %, axis {:.1} cm, radius {:.1} cm",
            sum.all,
            100.0 * right as f64 / sum.all as f64,
            100.0 * right as f64 / f64::max(sum.found as f64, 1.0),
            100.0 * hit_m / f64::max(right as f64, 1.0),
            100.0 * radius_m / f64::max(right as f64, 1.0)
        );
    }
    Ok(())
}
