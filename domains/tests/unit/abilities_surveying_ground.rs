//! Tests of `abilities::surveying::ground`.

use descry_domains::abilities::surveying::ground::*;
use descry_perception::nalgebra::{Isometry2, Point2, Vector2};
use descry_perception::occupancy::{Occupancy, Space};
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Place, Pose2};

const ROOM_M: (f64, f64) = (0.25, 0.08);

fn pose(x: f64, y: f64) -> Place {
    Place::Pose(Pose2::new(x, y, 0.0))
}

/// A corridor 2 m long and `width_m` wide between walls, cells of 10 cm.
fn corridor(width_m: f64) -> Occupancy {
    let (width, rows) = (20, (width_m / 0.1).round() as usize + 2);
    let is_wall = |n: usize| n / width == 0 || n / width == rows - 1;
    let cells = (0..width * rows).map(|n| if is_wall(n) { Space::Occupied } else { Space::Free });
    Occupancy { origin: Point2::origin(), cell_m: 0.1, width, cells: cells.collect() }
}

/// Driven floor is open, whatever looks show there, in the present frame of the map; floor where the body
/// does not fit is not.
#[test]
fn ways_lead_over_what_was_driven_and_not_where_the_body_does_not_fit() {
    let at = |x: f64, y: f64| Point2::new(x, y);
    let here = Isometry2::identity();
    let moved = Isometry2::new(Vector2::new(-0.3, 0.2), 0.1);
    // Too narrow for the body with its margin, so that nothing is left; with a place that is noise, in its middle.
    for map_from_chart in [here, moved] {
        let mut floor = corridor(0.3);
        let noise = square(&floor, &at(1.05, 0.25)).unwrap();
        floor.cells[noise] = Space::Occupied;
        let none = Ground::default().open(&mut floor, ROOM_M, &map_from_chart);
        assert!(none.stand.iter().chain(&none.pass).chain(&none.shown).all(|may| !may));
        let [from, to] = [at(0.15, 0.25), at(1.85, 0.26)].map(|p| map_from_chart * p);
        let mut ground = Ground { driven: vec![[from, to]], barred: Vec::new() };
        let open = ground.open(&mut floor, ROOM_M, &map_from_chart);
        let squares: Vec<usize> =
            (0..20).map(|x| square(&floor, &at(0.1 * f64::from(x) + 0.05, 0.25)).unwrap()).collect();
        assert!(squares[1..19].iter().all(|&n| open.stand[n]), "{map_from_chart}");
        assert!(floor.cells[noise] == Space::Free && open.pass == open.shown);
        ground.barred.push(map_from_chart * at(1.05, 0.25));
        let barred = ground.open(&mut floor, ROOM_M, &map_from_chart);
        assert!(
            !barred.stand[noise] && !barred.pass[noise] && barred.shown[noise] && barred.stand[squares[3]]
        );
    }
}

/// A drive that ended early has come as far as where the body stands; beyond that nothing is known.
#[test]
fn what_is_open_is_what_was_driven() {
    let way = [pose(2.0, 0.0), pose(2.0, 2.0)];
    let check = |end: (f64, f64), lines: usize, off: &[(f64, f64)]| {
        let mut ground = Ground::default();
        ground.drove(&pose(0.0, 0.0), &way, &pose(end.0, end.1));
        assert_eq!(ground.driven.len(), lines, "{end:?}: {:?}", ground.driven);
        let is_on = |x, y| {
            let p = Point2::new(x, y);
            ground.driven.iter().any(|line| (nearest(line, &p) - p).norm() < 0.05)
        };
        assert!(off.iter().all(|&(x, y)| !is_on(x, y)) && (lines == 0 || is_on(end.0, end.1)), "{end:?}");
    };
    check((1.0, 0.02), 2, &[(1.2, 0.0), (2.0, 1.0)]);
    check((2.0, 1.0), 2, &[(2.0, 1.2)]);
    check((2.01, 2.0), 3, &[]);
    check((0.0, 0.0), 0, &[(0.2, 0.0)]);
}

#[test]
fn a_body_that_failed_is_asked_where_it_does_not_fit() {
    let scene = "[room]\nsize_m = [5.0, 5.0]\n[[surface]]\nname = \"table\"\nsize_m = [1.0, 1.0]\nheight_m = 0.7\n[start]\nposition_m = [-1.5, 0.0]";
    let spec = SceneSpec::parse("room.toml", scene).unwrap();
    let robot = SimRobot::new(arrange(&spec, 1).unwrap(), SimOptions::default());
    let places = (-10..=10).flat_map(|x| (-10..=10).map(move |y| (0.2 * f64::from(x), 0.2 * f64::from(y))));
    let seem: Vec<Point2<f64>> = places.map(|(x, y)| Point2::new(x, y)).collect();
    let (here, way) = (pose(-1.2, 0.0), [pose(-0.9, 0.9), pose(1.2, 1.2)]);
    let mut ground = Ground::default();
    let count = ask(&mut ground, seem.clone(), &robot, &here, &way);
    let reach_m = |p: &Point2<f64>| p.coords.amax();
    assert!(count > 10 && count == ground.barred.len(), "{count}");
    assert!(ground.barred.iter().all(|p| reach_m(p) < 0.85), "what is free is not barred");
    let left: Vec<Point2<f64>> = seem.into_iter().filter(|p| !ground.barred.contains(p)).collect();
    assert_eq!(ask(&mut ground, left.clone(), &robot, &here, &way), 0, "what is known is no news");
    assert!(left.iter().any(|p| reach_m(p) < 0.85 && p.x > p.y + 0.5), "nobody asks far from the way");
    // Where nothing can be reached, nothing is learned.
    let within = vec![Point2::new(-0.2, 0.6), Point2::new(0.2, 0.6)];
    assert_eq!(ask(&mut Ground::default(), within, &robot, &here, &way), 0);
}
