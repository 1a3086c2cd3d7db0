//! A building mapped without a list of stops: the next pose by what it is expected to show and what the way costs, beside the nearest frontier.

use super::corridor::measure::{BODY_M, MAP_FAR_M};
use super::corridor::{Building, CAMERA_HEIGHT_M, Rig, field_of_view};
use super::tabletop::Draws;
use descry_perception::mapping::{
    ExploreOptions, FieldOfView, NextPose, Station, Survey, frontiers, next_poses,
};
use descry_perception::nalgebra::{Isometry2, Point2};
use descry_perception::occupancy::{Occupancy, Space};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Policy {
    Expected,
    NearestFrontier,
    Greedy,
}

/// Metres driven, looks taken and share of the walls known when it was enough, or at the end.
struct Run {
    metres: f64,
    looks: usize,
    known: f64,
    seconds: f64,
}

fn options() -> ExploreOptions {
    let field = FieldOfView { far_m: MAP_FAR_M, ..field_of_view() };
    ExploreOptions { field, ..ExploreOptions::default() }
}

/// Share of the corridor's walls of which the grid knows a square nearby.
fn known(building: &Building, grid: &Occupancy) -> f64 {
    let (mut hit, mut all) = (0, 0);
    for (a, b) in &building.walls {
        let steps = ((b - a).norm() / 0.2).ceil() as usize;
        for i in 0..steps {
            let at = a + (b - a) * ((i as f64 + 0.5) / steps as f64);
            let mut around = (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y)));
            let seen = around.any(|(x, y)| {
                let near = Point2::new(at.x + 0.1 * f64::from(x), at.y + 0.1 * f64::from(y));
                grid.at(&near) == Space::Occupied
            });
            hit += usize::from(seen);
            all += 1;
        }
    }
    hit as f64 / all as f64
}

fn choose(policy: Policy, grid: &Occupancy, looked: &[Isometry2<f64>]) -> Option<NextPose> {
    let poses = next_poses(grid, looked, &options());
    match policy {
        Policy::Expected => poses.into_iter().next(),
        Policy::Greedy => poses.into_iter().max_by(|a, b| a.gain_m2.total_cmp(&b.gain_m2)),
        Policy::NearestFrontier => {
            // Of the poses that look at the middle of a frontier, the nearest.
            let fronts = frontiers(grid, &options());
            let looks_at = |pose: &NextPose| {
                let sees = |p: &Point2<f64>| options().field.sees(&pose.pose.inverse_transform_point(p));
                fronts.iter().any(|f| sees(&f.middle))
            };
            let near = |a: &NextPose, b: &NextPose| (a.way_m, a.cost_s).partial_cmp(&(b.way_m, b.cost_s));
            poses.into_iter().filter(looks_at).min_by(|a, b| near(a, b).unwrap_or(std::cmp::Ordering::Equal))
        }
    }
}

fn explore(policy: Policy, building: &Building, start: &Isometry2<f64>, enough: f64, seed: u64) -> Run {
    const MOST_LOOKS: usize = 250;
    let mut draws = Draws(seed);
    let mut survey = Survey::new(0.1).expect("a length");
    let mut looked = vec![*start];
    let mut run = Run { metres: 0.0, looks: 0, known: 0.0, seconds: 0.0 };
    while run.looks < MOST_LOOKS {
        let at = looked[looked.len() - 1];
        let points = building.look(&at, &Rig { stride: 6, ..Rig::default() }, &mut draws);
        survey
            .add(&Station { points, odom_from_level: at }, &at, CAMERA_HEIGHT_M, MAP_FAR_M, &BODY_M)
            .expect("a pose");
        run.looks += 1;
        let Some(grid) = survey.grid() else { break };
        run.known = known(building, &grid);
        if run.known >= enough {
            break;
        }
        let Some(next) = choose(policy, &grid, &looked) else { break };
        run.metres += next.way_m;
        run.seconds += next.cost_s;
        looked.push(next.pose);
    }
    run
}

/// Prints metres until 95 % of the walls are known.
pub fn print(seed: u64) {
    const ENOUGH: f64 = 0.95;
    println!(
        "\nexplored at true poses until 95 % of the walls are known: metres, looks, seconds, share known at the end (%)"
    );
    for (name, building, start) in [
        ("corridor 20 x 10 m", Building::corridor_loop(20.0, 10.0, seed), Isometry2::translation(0.0, -5.0)),
        (
            "corridor 28 x 14 m",
            Building::corridor_loop(28.0, 14.0, seed + 1),
            Isometry2::translation(0.0, -7.0),
        ),
        (
            "corridor 16 x 8 m",
            Building::corridor_loop(16.0, 8.0, seed + 2),
            Isometry2::translation(2.0, -4.0),
        ),
    ] {
        for policy in [Policy::Expected, Policy::NearestFrontier, Policy::Greedy] {
            let run = explore(policy, &building, &start, ENOUGH, seed);
            println!(
                "{name:<20} {:<18} {:>6.1} m {:>4} looks {:>6.0} s {:>5.1}",
                format!("{policy:?}"),
                run.metres,
                run.looks,
                run.seconds,
                100.0 * run.known
            );
        }
    }
}
