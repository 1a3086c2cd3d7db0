//! Routes on drawn maps: waypoints, costs, and reasons for having none.

use descry_robots::nalgebra::Point2;
use descry_robots::route::{Router, turn};
use descry_robots::{Failure, OccupancyGrid, Pose2, Speeds};

const SPEEDS: Speeds = Speeds { linear_m_s: 0.5, angular_rad_s: 1.0 };

/// Parses a map, one character a cell of 0.1 m, the top row first; `#` is occupied.
fn map(drawing: &[&str]) -> OccupancyGrid {
    let (width, height) = (drawing[0].len(), drawing.len());
    let mut grid = OccupancyGrid::covering(
        Point2::origin(),
        Point2::new(width as f64 * 0.1 - 1e-9, height as f64 * 0.1 - 1e-9),
        0.1,
    );
    for (r, line) in drawing.iter().rev().enumerate() {
        for (c, ch) in line.chars().enumerate() {
            grid.occupied[r * width + c] = ch == '#';
        }
    }
    grid
}

fn room() -> OccupancyGrid {
    map(&[
        "....................",
        "....................",
        "....................",
        "....................",
        ".......######.......",
        ".......######.......",
        ".......######.......",
        "....................",
        "....................",
        "....................",
        "....................",
    ])
}

#[test]
fn straight_where_nothing_stands() {
    let router = Router::new(&room(), 0.1, SPEEDS);
    let (from, to) = (Pose2::new(0.25, 0.25, 0.0), Pose2::new(1.75, 0.25, std::f64::consts::FRAC_PI_2));
    let travel = router.travel(&from, &to).unwrap();
    assert!((travel.distance_m - 1.5).abs() < 1e-9);
    assert!((travel.duration_s - (1.5 / 0.5 + std::f64::consts::FRAC_PI_2)).abs() < 1e-9);
}

#[test]
fn around_a_table_is_the_shortest_way() {
    let router = Router::new(&room(), 0.1, SPEEDS);
    let (from, to) = (Pose2::new(0.25, 0.55, 0.0), Pose2::new(1.75, 0.55, 0.0));
    let route = router.route(&from, &to).unwrap();
    assert!(route.points_m.len() >= 3, "{:?}", route.points_m);
    let length: f64 = route.points_m.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    assert!((length - route.travel.distance_m).abs() < 1e-9);
    for w in route.points_m.windows(2) {
        assert!(router.sees(&w[0], &w[1]), "{w:?} runs into something");
    }
    let exact = shortest_by_grid(&router, &from, &to);
    assert!(length <= exact + 1e-6, "{length} against {exact} on the grid");
    assert!(length >= 1.5);
}

/// Length of the shortest route over the eight neighbours of each cell: an upper bound on the any-angle
/// route.
fn shortest_by_grid(router: &Router, from: &Pose2, to: &Pose2) -> f64 {
    let grid = router.blocked();
    let start = grid.cell(&from.point()).unwrap();
    let goal = grid.cell(&to.point()).unwrap();
    let steps = |&(c, r): &(usize, usize)| {
        let mut out = Vec::new();
        for (dc, dr) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
            let (nc, nr) = (c as i64 + dc, r as i64 + dr);
            if nc < 0 || nr < 0 || nc >= grid.width as i64 || nr >= grid.height as i64 {
                continue;
            }
            let free = |c: i64, r: i64| !grid.occupied[r as usize * grid.width + c as usize];
            if free(nc, nr) && free(nc, r as i64) && free(c as i64, nr) {
                let cost = if dc != 0 && dr != 0 { 141_421_356 } else { 100_000_000u64 };
                out.push(((nc as usize, nr as usize), cost));
            }
        }
        out
    };
    let (_, cost) = pathfinding::directed::dijkstra::dijkstra(&start, steps, |n| *n == goal).unwrap();
    cost as f64 * 1e-9
}

#[test]
fn never_longer_than_the_grid_on_random_maps() {
    use rand::{Rng, SeedableRng};
    let mut compared = 0;
    for seed in 0..30 {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut grid = OccupancyGrid::covering(Point2::new(-1.5, -1.5), Point2::new(1.499, 1.499), 0.1);
        for cell in grid.occupied.iter_mut() {
            *cell = rng.random_bool(0.08);
        }
        // Turning costs nothing here, so that the fastest way is the shortest.
        let quick = Speeds { linear_m_s: 1.0, angular_rad_s: 1e12 };
        let router = Router::new(&grid, 0.06, quick);
        let free: Vec<Pose2> = (0..40)
            .map(|_| Pose2::new(rng.random_range(-1.4..1.4), rng.random_range(-1.4..1.4), 0.0))
            .filter_map(|p| {
                let (c, r) = router.blocked().cell(&p.point())?;
                let centre = router.blocked().centre(c, r);
                router.fits(&centre).is_ok().then(|| Pose2::new(centre.x, centre.y, 0.0))
            })
            .collect();
        let table = router.travel_table(&free);
        for (i, from) in free.iter().enumerate() {
            for (j, to) in free.iter().enumerate().skip(i) {
                let there = table[i][j].clone();
                assert_eq!(there.is_ok(), table[j][i].is_ok());
                assert_eq!(there.as_ref().ok(), router.travel(from, to).as_ref().ok());
                if let Ok(travel) = there {
                    let route = router.route(from, to).unwrap();
                    let length: f64 = route.points_m.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
                    assert!((length - travel.distance_m).abs() < 1e-9);
                    assert!(route.points_m.windows(2).all(|w| router.sees(&w[0], &w[1])));
                    let exact_m = shortest_by_grid(&router, from, to);
                    assert!(length <= exact_m + 1e-6, "{length} against {exact_m} from {from:?} to {to:?}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 1000, "only {compared} pairs");
}

#[test]
fn unreachable_says_why() {
    let walled = map(&[
        "....................",
        "....................",
        "..#######...........",
        "..#.....#...........",
        "..#.....#...........",
        "..#.....#...........",
        "..#######...........",
        "....................",
        "....................",
    ]);
    let router = Router::new(&walled, 0.1, SPEEDS);
    let from = Pose2::new(1.5, 0.45, 0.0);
    for (to, word) in [
        (Pose2::new(0.55, 0.45, 0.0), "passage"),
        (Pose2::new(9.0, 0.45, 0.0), "outside"),
        (Pose2::new(0.95, 0.45, 0.0), "0.10 m"),
        (Pose2::new(f64::NAN, 0.45, 0.0), "no place"),
        (Pose2::new(1.6, 0.45, f64::NAN), "no heading"),
    ] {
        match router.travel(&from, &to) {
            Err(Failure::Unreachable { because }) => assert!(because.contains(word), "{because}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_start_beside_the_table_gets_away() {
    let router = Router::new(&room(), 0.2, SPEEDS);
    let from = Pose2::new(0.62, 0.55, 0.0);
    assert!(router.fits(&from.point()).is_err());
    let route = router.route(&from, &Pose2::new(0.25, 0.25, 0.0)).unwrap();
    assert_eq!(route.points_m[0], from.point());
    let length: f64 = route.points_m.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    assert!((length - route.travel.distance_m).abs() < 1e-9);
}

#[test]
fn turns_are_the_short_way_round() {
    for (from, to, expected) in [(0.0, 0.5, 0.5), (3.0, -3.0, std::f64::consts::TAU - 6.0), (0.1, 0.1, 0.0)] {
        assert!((turn(from, to) - expected).abs() < 1e-12);
    }
}
