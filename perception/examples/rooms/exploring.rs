//! Flats mapped without a list of stops: a plan past all poses from which more would be seen, beside the one that promises most for its time and beside
//! going to the nearest frontier.

use super::corridor::measure::{BODY_M, MAP_FAR_M};
use super::corridor::{Building, CAMERA_HEIGHT_M, DOOR_WIDE_M, Opening, Panel, Rig, Table, field_of_view};
use super::tabletop::Draws;
use descry_perception::mapping::{
    ExploreOptions, FieldOfView, NextPose, Station, Survey, Unseen, in_order, nearest_frontier, next_poses,
    outlooks,
};
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use descry_perception::occupancy::{Occupancy, Space};

/// Flats that are made.
const FLATS: u64 = 12;
/// Walls are known when this share of them is.
const ENOUGH: f64 = 0.95;
const MOST_LOOKS: usize = 250;

/// Poses that a plan goes past at most.
const PLANNED: usize = 10;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Policy {
    /// The first pose of the quickest way past those from which together all would be seen; planned anew after each look.
    Plan,
    /// The pose that promises most for its time.
    BestRate,
    NearestFrontier,
}

const POLICIES: [Policy; 3] = [Policy::Plan, Policy::BestRate, Policy::NearestFrontier];

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

/// Two rows of two or three rooms, doors between them, a table in each; and the middle of the first room.
fn flat(seed: u64) -> (Building, Isometry2<f64>) {
    let mut draws = Draws(seed);
    let mut building = Building::default();
    let columns = if draws.next() < 0.5 { 2 } else { 3 };
    let mut cuts = |count: usize, least: f64, spread: f64| {
        (0..count).fold(vec![0.0], |mut cuts: Vec<f64>, _| {
            cuts.push(cuts[cuts.len() - 1] + least + spread * draws.next());
            cuts
        })
    };
    let (x, y) = (cuts(columns, 3.0, 2.0), cuts(2, 3.0, 1.5));
    let at = Point2::new;
    for (row, &along) in y.iter().enumerate() {
        for ends in x.windows(2) {
            wall(&mut building, at(ends[0], along), at(ends[1], along), row == 1, &mut draws);
        }
    }
    for (column, &across) in x.iter().enumerate() {
        for (row, ends) in y.windows(2).enumerate() {
            let inner = column > 0 && column < columns;
            let door = inner && (row == 0 || draws.next() < 0.4);
            wall(&mut building, at(across, ends[0]), at(across, ends[1]), door, &mut draws);
        }
    }
    for (column, row) in (0..columns).flat_map(|c| [(c, 0), (c, 1)]) {
        let corner = at(x[column] + 0.2, if row == 0 { y[0] + 0.2 } else { y[2] - 0.9 });
        table(&mut building, corner, Vector2::new(0.9 + 0.4 * draws.next(), 0.7));
    }
    let start = Isometry2::new(Vector2::new(0.5 * x[1] + 0.3, 0.5 * y[1] + 0.2), 6.0 * draws.next());
    (building, start)
}

/// A wall, with a door if it has one.
fn wall(building: &mut Building, a: Point2<f64>, b: Point2<f64>, door: bool, draws: &mut Draws) {
    let along = (b - a).normalize();
    let length = (b - a).norm();
    let texture = 0.3 + 0.3 * draws.next();
    if !door {
        return building.wall(a, b, texture);
    }
    let from = 1.2 + (length - 2.4 - DOOR_WIDE_M).max(0.0) * draws.next();
    let (p, q) = (a + along * from, a + along * (from + DOOR_WIDE_M));
    building.wall(a, p, texture);
    building.wall(q, b, texture);
    building.openings.push(Opening { a: p, b: q });
}

fn table(building: &mut Building, low: Point2<f64>, size: Vector2<f64>) {
    let middle = low + 0.5 * size;
    let corners = [low, low + Vector2::new(size.x, 0.0), low + size, low + Vector2::new(0.0, size.y)];
    for i in 0..4 {
        building.panels.push(Panel { a: corners[i], b: corners[(i + 1) % 4], z: (0.0, 0.74), texture: 0.7 });
    }
    building.tables.push(Table { middle, half: [0.5 * size.x, 0.5 * size.y], height: 0.74 });
}

/// Share of the walls of which the grid knows a square nearby.
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
    match policy {
        Policy::Plan => planned(grid, looked, &options()),
        Policy::BestRate => next_poses(grid, looked, &options()).into_iter().next(),
        Policy::NearestFrontier => nearest_frontier(grid, looked, &options()),
    }
}

fn planned(grid: &Occupancy, looked: &[Isometry2<f64>], options: &ExploreOptions) -> Option<NextPose> {
    let from = looked.last()?;
    let looks = outlooks(grid, looked, &[], PLANNED, options);
    let first = &looks[*in_order(grid, from, &looks, options).first()?];
    let (metre_s, radian_s, look_s) = options.seconds;
    let turn = from.rotation.angle_to(&first.pose.rotation).abs();
    let cost_s = metre_s * first.way_m + radian_s * turn + look_s;
    Some(NextPose { pose: first.pose, gain_m2: Unseen::default().gain_m2(first), way_m: first.way_m, cost_s })
}

fn explore(policy: Policy, building: &Building, start: &Isometry2<f64>, seed: u64) -> Run {
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
        if run.known >= ENOUGH {
            break;
        }
        let Some(next) = choose(policy, &grid, &looked) else { break };
        run.metres += next.way_m;
        run.seconds += next.cost_s;
        looked.push(next.pose);
    }
    run
}

/// Prints metres and seconds until 95 % of the walls are known.
pub fn print(seed: u64) {
    println!(
        "\n{FLATS} flats explored at true poses until 95 % of the walls are known: metres, seconds, looks and share known at the end (%) by {POLICIES:?}; a metre counts 2 s, a radian 1 s, a look 1 s"
    );
    let mut all: Vec<[Run; 3]> = Vec::new();
    for k in 0..FLATS {
        let (building, start) = flat(1000 * seed + k);
        let runs = POLICIES.map(|policy| explore(policy, &building, &start, 1000 * seed + k));
        let told = runs.each_ref().map(|run| {
            let Run { metres, looks, known, seconds } = run;
            format!("{metres:>6.1} m {seconds:>5.0} s {looks:>4} looks {:>5.1}", 100.0 * known)
        });
        println!("flat {k:>2}   {}", told.join("   "));
        all.push(runs);
    }
    let whole: Vec<&[Run; 3]> = all.iter().filter(|runs| runs.iter().all(|r| r.known >= ENOUGH)).collect();
    let sum = |n: usize, of: fn(&Run) -> f64| whole.iter().map(|runs| of(&runs[n])).sum::<f64>();
    let nearest = POLICIES.len() - 1;
    for (n, policy) in POLICIES.iter().enumerate() {
        let done = all.iter().filter(|runs| runs[n].known >= ENOUGH).count();
        let (metres, seconds) = (sum(n, |r| r.metres), sum(n, |r| r.seconds));
        println!(
            "{policy:?}: {done} of {FLATS} known; where all policies came to the end {metres:.1} m, {seconds:.0} s, {} looks: {:.2} of the metres and {:.2} of the seconds of the nearest frontier",
            whole.iter().map(|runs| runs[n].looks).sum::<usize>(),
            metres / sum(nearest, |r| r.metres),
            seconds / sum(nearest, |r| r.seconds)
        );
    }
}
