//! Viewpoints: the stations of a body if it has any, else a ring around each surface.

use descry_perception::nalgebra::{Point2, Point3, Vector3};
use descry_robots::{Place, Pose2, PoseEstimate, Robot};

use crate::config::Candidates;
use crate::load::Domain;
use crate::own_map::OwnMap;
use crate::surface::KnownSurface;
use crate::symbol::symbol;
use crate::viewpoint::Candidate;

/// Radial offsets tried for a ring pose until the footprint fits, metres.
const OUTWARDS_M: [f64; 7] = [0.0, 0.1, 0.2, -0.1, 0.3, -0.2, 0.4];

/// Viewpoints, and the index of the one at which the body stands.
pub fn candidates(
    robot: &dyn Robot,
    own_map: &dyn OwnMap,
    surfaces: &[KnownSurface],
    config: &Candidates,
    here: &PoseEstimate,
) -> (Vec<Candidate>, usize) {
    if let Some(stations) = robot.stations() {
        let all: Vec<Candidate> = stations
            .iter()
            .map(|s| Candidate { symbol: station_symbol(&s.name), place: Place::Station(s.name.clone()) })
            .collect();
        let at = stations.iter().position(|s| Some(&s.name) == here.station.as_ref()).unwrap_or(0);
        return (all, at);
    }
    let mut all = vec![Candidate { symbol: "start".into(), place: here.place() }];
    for surface in surfaces {
        let Some(centre) = surface.centre() else { continue };
        let ring = ring(robot, own_map, &here.place(), &centre, config);
        // Boards one above the other are looked at from the same poses.
        let own = ring.into_iter().filter(|(_, place)| !all.iter().any(|known| is_same(&known.place, place)));
        let own: Vec<Candidate> =
            own.map(|(k, place)| Candidate { symbol: format!("{}-{k}", surface.symbol), place }).collect();
        all.extend(own);
    }
    (all, 0)
}

/// True if two poses are the same viewpoint.
pub fn is_same(one: &Place, other: &Place) -> bool {
    const SAME_M: f64 = 0.01;
    const SAME_RAD: f64 = 0.02;
    match (one, other) {
        (Place::Pose(one), Place::Pose(other)) => {
            let turned_rad = (one.yaw_rad - other.yaw_rad).rem_euclid(std::f64::consts::TAU);
            (one.point() - other.point()).norm() < SAME_M
                && turned_rad.min(std::f64::consts::TAU - turned_rad) < SAME_RAD
        }
        (one, other) => one == other,
    }
}

/// Symbol of a station; a PDDL symbol must not begin with a digit.
fn station_symbol(name: &str) -> String {
    let is_number = name.starts_with(|c: char| c.is_ascii_digit());
    if is_number { symbol(&format!("station {name}")) } else { symbol(name) }
}

/// Poses around a point that face it, numbered from 1; a pose is dropped if it is unreachable at every
/// offset of [`OUTWARDS_M`].
pub(crate) fn ring(
    robot: &dyn Robot,
    own_map: &dyn OwnMap,
    from: &Place,
    centre: &Point3<f64>,
    config: &Candidates,
) -> Vec<(usize, Place)> {
    let pose = |k: usize, outwards_m: f64| {
        let angle = std::f64::consts::TAU * k as f64 / config.poses as f64;
        let distance_m = config.distance_m + outwards_m;
        let at = Point2::new(centre.x + distance_m * angle.cos(), centre.y + distance_m * angle.sin());
        Place::Pose(Pose2::facing(at.x, at.y, &centre.xy()))
    };
    (0..config.poses)
        .filter_map(|k| {
            let tries: Vec<Place> = OUTWARDS_M.iter().map(|&d| pose(k, d)).collect();
            let travel = own_map.travel(robot, from, &tries, &[]);
            let fits = travel.iter().position(Result::is_ok)?;
            Some((k + 1, tries[fits].clone()))
        })
        .collect()
}

/// Supporting surfaces: those of the body's map, or else those named by the domain.
pub fn surfaces(domain: &Domain, robot: &dyn Robot) -> Vec<KnownSurface> {
    let up = robot.description().up.unwrap_or_else(Vector3::z);
    let floor = |name: &Option<String>| {
        let room = robot.rooms().iter().find(|room| Some(&room.name) == name.as_ref());
        room.map(|room| room.outline_m.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect())
            .unwrap_or_default()
    };
    let on_map = robot.surfaces().iter().map(|hint| KnownSurface {
        symbol: symbol(&hint.name),
        name: hint.name.clone(),
        room: hint.room.clone(),
        floor: floor(&hint.room),
        whole: true,
        outline: hint.outline_m.iter().map(|p| Point3::new(p.x, p.y, hint.height_m)).collect(),
        up,
        doubtful: None,
        placed: None,
        displaced_m: 0.0,
        sensor_doubt: 0.0,
    });
    let named =
        domain.config.surfaces.iter().filter(|_| robot.surfaces().is_empty()).map(|name| KnownSurface {
            symbol: symbol(name),
            name: name.clone(),
            room: None,
            floor: Vec::new(),
            whole: false,
            outline: Vec::new(),
            up,
            doubtful: None,
            placed: None,
            displaced_m: 0.0,
            sensor_doubt: 0.0,
        });
    on_map.chain(named).collect()
}
