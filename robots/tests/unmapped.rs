//! A body in a scene without a map: it knows nothing, and walls and tables stop it.

use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Failure, Place, Pose2, Robot, Watch};

const SCENE: &str = r#"
mapped = false
[stereo]
baseline_m = 0.1
disparity_sigma_px = 0.3
textured = 0.5
[[room]]
name = "west"
position_m = [-2.0, 0.0]
size_m = [3.8, 4.0]
[[room]]
name = "east"
position_m = [2.0, 0.0]
size_m = [3.8, 4.0]
[[door]]
name = "door"
position_m = [0.0, 1.0]
state = "open"
[[surface]]
name = "table"
position_m = [2.5, -0.8]
size_m = [1.2, 0.8]
height_m = 0.7
[start]
position_m = [-2.0, 1.0]
"#;

fn robot() -> SimRobot {
    let spec = SceneSpec::parse("scene", SCENE).unwrap();
    SimRobot::new(arrange(&spec, 1).unwrap(), SimOptions { seed: 1, ..SimOptions::default() })
}

#[test]
fn it_knows_nothing_of_the_scene() {
    let robot = robot();
    assert!(robot.map().is_none());
    assert!(robot.surfaces().is_empty() && robot.rooms().is_empty() && robot.doors().is_empty());
    assert_eq!(robot.description().camera.as_ref().unwrap().range_m, (0.45, 6.0));
}

#[tokio::test]
async fn walls_and_tables_stop_it_and_doors_let_it_through() {
    let check = async |from: Option<(f64, f64)>, to: (f64, f64), arrives: bool| {
        let robot = robot();
        let drive = async |(x, y): (f64, f64)| {
            robot.drive_to(&Place::Pose(Pose2::new(x, y, 0.0)), &Watch::default()).await
        };
        if let Some(from) = from {
            drive(from).await.unwrap();
        }
        let went = drive(to).await;
        let at = robot.truth().base.point();
        assert_eq!(went.is_ok(), arrives, "{to:?}: {went:?}");
        assert!(arrives || matches!(went, Err(Failure::Blocked { .. })), "{went:?}");
        assert!(at.x.abs() < 3.9 && at.y.abs() < 2.0, "{at}");
    };
    check(None, (2.0, 1.0), true).await;
    check(None, (-2.0, 3.0), false).await;
    check(None, (-6.0, 1.0), false).await;
    check(Some((-2.0, -1.0)), (2.0, -1.0), false).await;
    check(Some((2.0, 1.0)), (2.5, -0.8), false).await;
}
