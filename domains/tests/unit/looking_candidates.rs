//! Tests of `looking::candidates`.

use descry_domains::abilities::surveying::chart::Chart;
use descry_domains::load::Domain;
use descry_domains::looking::candidates::*;
use descry_perception::nalgebra::Isometry3;
use descry_robots::PoseEstimate;
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};

#[test]
fn boards_one_above_the_other_are_looked_at_from_the_same_poses() {
    let domain = Domain::load("home").expect("a built-in domain");
    let spec = SceneSpec::parse("default.toml", &domain.scenes["default"]).expect("a scene");
    let robot = SimRobot::new(arrange(&spec, 1).expect("an arrangement"), SimOptions::default());
    let here = PoseEstimate {
        stamp_ns: 0,
        map_from_base: Isometry3::translation(-0.5, 0.0, 0.0),
        sigma_m: 0.0,
        sigma_rad: 0.0,
        station: None,
    };
    let all = surfaces(&domain, &robot);
    let chart = Chart::begin(&domain, None, &robot);
    let (poses, _) = candidates(&robot, &chart, &all, &domain.config.candidates, &here);
    let around = |surface: &str| poses.iter().filter(|pose| pose.symbol.starts_with(surface)).count();
    assert!(around("lower-board-") > 0 && around("desk-") > 0);
    assert_eq!(around("upper-board-"), 0, "{:?}", poses.iter().map(|p| &p.symbol).collect::<Vec<_>>());
    for (n, one) in poses.iter().enumerate() {
        assert!(poses[..n].iter().all(|other| !is_same(&one.place, &other.place)), "{}", one.symbol);
    }
}
