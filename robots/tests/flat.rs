//! A flat: rooms, walls and doors, boards, a hand, and faults.

use descry_robots::conformance;
use descry_robots::nalgebra::{Point2, Point3, Vector3};
use descry_robots::sim::world::LABEL_ROOM;
use descry_robots::sim::{FaultPlan, SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::truth::TrueObject;
use descry_robots::{
    Answer, Failure, Grasp, Place, Placing, Pose2, Poured, Pouring, Request, Robot, Travel, Watch,
};

const FLAT: &str = r#"
[[room]]
name = "kitchen"
position_m = [-2.05, 0.0]
size_m = [4.0, 4.0]
[[room]]
name = "hall"
position_m = [2.05, 0.0]
size_m = [4.0, 4.0]
[[door]]
name = "north door"
position_m = [0.0, 1.2]
state = "open"
[[door]]
name = "south door"
position_m = [0.0, -1.2]
state = "open"
[[surface]]
name = "table"
position_m = [-2.2, 0.0]
size_m = [1.2, 0.8]
height_m = 0.75
[[surface]]
name = "lower board"
kind = "board"
uprights = true
position_m = [2.4, 1.83]
size_m = [1.0, 0.3]
height_m = 0.8
[[surface]]
name = "upper board"
kind = "board"
position_m = [2.4, 1.83]
size_m = [1.0, 0.3]
height_m = 1.15
[start]
position_m = [1.5, -1.0]
[[object]]
name = "cup"
shape.cup = { diameter_m = 0.07, height_m = 0.1 }
position_m = [0.2, 0.1]
on = "table"
[[object]]
name = "jug"
shape.cylinder = { diameter_m = 0.1, height_m = 0.2 }
position_m = [0.2, 0.0]
on = "lower board"
[[object]]
name = "crate"
shape.box = { size_m = [0.2, 0.2, 0.2] }
position_m = [-0.4, 0.0]
on = "table"
"#;

fn spec(text: &str) -> SceneSpec {
    SceneSpec::parse("flat.toml", text).unwrap_or_else(|e| panic!("{e}"))
}

fn robot_in(text: &str, seed: u64, faults: &str) -> SimRobot {
    let faults = FaultPlan::parse("faults.toml", faults).unwrap_or_else(|e| panic!("{e}"));
    SimRobot::new(arrange(&spec(text), seed).unwrap(), SimOptions { seed, faults, ..SimOptions::default() })
}

fn shut(door: &str) -> String {
    let open = format!("name = \"{door}\"\nposition_m = [0.0, 1.2]\nstate = \"open\"");
    let open_south = open.replace("1.2]", "-1.2]");
    let from = if FLAT.contains(&open) { open } else { open_south };
    assert!(FLAT.contains(&from));
    FLAT.replace(&from, &from.replace("open", "shut"))
}

fn both_shut() -> String {
    FLAT.replace("state = \"open\"", "state = \"shut\"")
}

fn at(x_m: f64, y_m: f64) -> Place {
    Place::Pose(Pose2::facing(x_m, y_m, &Point2::new(-2.2, 0.0)))
}

async fn drive(robot: &SimRobot, place: &Place) -> Result<(), Failure> {
    robot.drive_to(place, &Watch::default()).await.map(|_| ())
}

/// Opens a door, retrying after slips.
async fn open(robot: &SimRobot, door: &str) {
    for _ in 0..20 {
        match robot.open_door(door, &Watch::default()).await {
            Err(Failure::Slipped { .. }) => {}
            answer => {
                answer.unwrap();
                return;
            }
        }
    }
    panic!("\"{door}\" stays shut");
}

fn object(robot: &SimRobot, name: &str) -> TrueObject {
    robot.truth().objects.into_iter().find(|o| o.name == name).unwrap()
}

#[test]
fn mistakes_are_drawn_at_their_place() {
    for (from, to, line, words) in [
        ("name = \"hall\"", "name = \"kitchen\"", 7, &["second room", "\"kitchen\""][..]),
        ("name = \"hall\"\n", "", 6, &["without a name"]),
        ("position_m = [2.05, 0.0]", "position_m = [1.9, 0.0]", 8, &["overlap"]),
        ("position_m = [2.05, 0.0]", "position_m = [200.0, 0.0]", 8, &["spread over"]),
        ("[[room]]\nname = \"hall\"", "[[room]]\nnam = \"hall\"", 7, &["unknown field `nam`"]),
        ("position_m = [0.0, 1.2]", "position_m = [0.3, 1.2]", 12, &["not in a wall between two rooms"]),
        ("position_m = [0.0, 1.2]", "position_m = [0.0, 1.8]", 12, &["not in a wall"]),
        ("position_m = [0.0, 1.2]", "position_m = [0.0, -0.9]", 16, &["overlap"]),
        ("name = \"south door\"", "name = \"north door\"", 15, &["second door"]),
        ("state = \"open\"", "state = \"ajar\"", 13, &["ajar", "open"]),
        ("state = \"open\"", "state = \"open\"\nshut_chance = 0.5", 14, &["keep one"]),
        ("state = \"open\"", "shut_chance = 1.5", 13, &["no chance"]),
        ("state = \"open\"", "width_m = 0.0", 13, &["above zero"]),
        ("state = \"open\"", "height_m = 3.0", 13, &["higher than its wall"]),
        ("position_m = [-2.2, 0.0]", "position_m = [-0.3, 0.0]", 20, &["not within one room"]),
        ("kind = \"board\"", "kind = \"table\"", 26, &["stands on legs"]),
        ("kind = \"board\"", "kind = \"plank\"", 25, &["plank", "board"]),
        ("on = \"table\"", "on = 3", 42, &["one, or a list"]),
        ("on = \"table\"", "on = [\"table\", \"sink\"]", 42, &["no surface \"sink\"", "upper board"]),
        ("on = \"table\"", "on = [\"table\", \"table\"]", 42, &["twice"]),
        ("on = \"table\"", "on = [\"table\", \"lower board\"]\nweights = [1.0]", 43, &["1 weights for 2"]),
        ("on = \"table\"", "on = [\"table\", \"lower board\"]\nweights = [0.0, 0]", 43, &["no weights"]),
        ("on = \"table\"", "on = \"table\"\napart_from = \"jug\"", 43, &["no object \"jug\" comes before"]),
        ("on = \"lower board\"", "on = [\"lower board\"]\napart_from = \"cup\"", 48, &["no other surface"]),
        ("height_m = 0.2 }", "height_m = 0.4 }", 47, &["0.320 m", "lower board"]),
    ] {
        assert!(FLAT.contains(from), "{from}");
        let text = FLAT.replacen(from, to, 1);
        let error = SceneSpec::parse("flat.toml", &text).expect_err(to);
        let drawn = error.to_string();
        assert_eq!(error.line, line, "{to}: {drawn}");
        for word in words {
            assert!(drawn.contains(word), "no {word:?} in: {drawn}");
        }
    }
}

#[test]
fn what_is_neither_floor_nor_opening_is_wall() {
    let scene = arrange(&spec(FLAT), 1).unwrap();
    assert_eq!((scene.room.size_m, scene.room.position_m), ([8.1, 4.0], [0.0, 0.0]));
    for i in 0..810 {
        for j in 0..400 {
            let p = Point2::new(-4.045 + 0.01 * f64::from(i), -1.995 + 0.01 * f64::from(j));
            let floor = scene.rooms.iter().any(|r| r.holds(&p, 0.0));
            let opening = scene.doors.iter().any(|d| {
                let off = (p - d.doorway.centre_m).abs();
                off.x < 0.05 && off.y < 0.45
            });
            let walls = scene.walls.iter().filter(|w| w.blocks(&p, 0.0)).count();
            assert_eq!(walls, usize::from(!floor && !opening), "at {p}");
        }
    }
    let lintels: Vec<_> = scene.walls.iter().filter(|w| w.low.z > 0.0).collect();
    assert!(lintels.len() == 2 && lintels.iter().all(|w| w.low.z == 2.0 && w.high.z == 2.5));
    // Rooms that touch have no wall between them.
    let touching = FLAT.replace("[2.05, 0.0]", "[1.95, 0.0]").replace("[[door]]", "[[obstacle]]");
    let cut = touching.find("[[obstacle]]").unwrap();
    let rest = touching.find("[[surface]]").unwrap();
    let scene = arrange(&spec(&format!("{}{}", &touching[..cut], &touching[rest..])), 1).unwrap();
    assert!(scene.walls.is_empty(), "{:?}", scene.walls);
}

#[test]
fn the_map_knows_rooms_doors_and_surfaces() {
    let robot = robot_in(&both_shut(), 1, "");
    let names: Vec<&str> = robot.rooms().iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["kitchen", "hall"]);
    let door = &robot.doors()[0];
    assert_eq!((door.name.as_str(), door.width_m), ("north door", 0.9));
    assert!((door.centre_m - Point2::new(0.0, 1.2)).norm() < 1e-9);
    assert!((door.along_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
    assert_eq!(door.between, ["kitchen", "hall"]);
    let rooms: Vec<_> = robot.surfaces().iter().map(|s| s.room.as_deref()).collect();
    assert_eq!(rooms, [Some("kitchen"), Some("hall"), Some("hall")]);
    let map = robot.map().unwrap();
    assert!(!map.is_occupied(&door.centre_m) && map.is_occupied(&Point2::new(0.0, 0.0)));
    assert!(robot.truth().doors.iter().all(|d| d.shut), "the truth is another matter");
}

/// A shut door fills its opening in the image, an open one is transparent.
#[tokio::test]
async fn doors_and_boards_are_seen() {
    for (text, range_m) in [(FLAT.to_string(), 5.0..6.0), (both_shut(), 1.3..1.5)] {
        let robot = robot_in(&text, 1, "");
        drive(&robot, &at(1.4, 1.2)).await.unwrap();
        robot.look_at(&Point3::new(0.0, 1.2, 1.4), &Watch::default()).await.unwrap();
        let frame = robot.true_frame();
        let middle = 240 * 640 + 320;
        assert!(range_m.contains(&frame.depth_m[middle]), "{} m", frame.depth_m[middle]);
        assert_eq!(frame.label[middle], LABEL_ROOM);
    }
    let robot = robot_in(FLAT, 1, "");
    drive(&robot, &Place::Pose(Pose2::facing(2.4, 0.6, &Point2::new(2.4, 1.8)))).await.unwrap();
    robot.look_at(&Point3::new(2.4, 1.83, 0.9), &Watch::default()).await.unwrap();
    let frame = robot.true_frame();
    let jug = frame.label.iter().filter(|&&l| l == descry_robots::sim::world::LABEL_OBJECT + 1).count();
    assert!(jug > 2000, "{jug} pixels of the jug between the boards");
    let share = robot.true_visible_share("jug", &robot.truth().base);
    assert!(share > 0.5, "{share} of the jug is seen");
    assert_eq!(robot.true_visible_share("cup", &robot.truth().base), 0.0, "the wall hides the cup");
}

fn travel(robot: &SimRobot, from: &Place, to: &Place, shut: &[&str]) -> Result<Travel, Failure> {
    let shut: Vec<String> = shut.iter().map(|s| (*s).to_string()).collect();
    robot.travel(from, std::slice::from_ref(to), &shut).remove(0)
}

#[test]
fn routes_go_round_by_the_doors_that_are_not_named() {
    let robot = robot_in(&both_shut(), 1, "");
    let (here, there) = (at(1.0, 1.2), at(-1.0, 1.2));
    let open = travel(&robot, &here, &there, &[]).unwrap();
    let detour = travel(&robot, &here, &there, &["north door"]).unwrap();
    assert!((open.distance_m - 2.0).abs() < 1e-6, "{open:?}: all doors count as open");
    assert!(detour.distance_m > 3.5, "{detour:?}");
    let none = travel(&robot, &here, &there, &["south door", "north door"]);
    assert!(matches!(none, Err(Failure::Unreachable { .. })), "{none:?}");
    assert_eq!(travel(&robot, &here, &there, &["south door"]), Ok(open));
    let unknown = travel(&robot, &here, &there, &["cat flap"]).unwrap_err();
    assert!(unknown.to_string().contains("cat flap"), "{unknown}");
}

#[tokio::test]
async fn a_shut_door_stops_the_base_until_it_is_opened() {
    for seed in 0..20 {
        let robot = robot_in(&both_shut(), seed, "");
        let goal = at(-1.0, 1.2);
        drive(&robot, &at(1.4, 1.2)).await.unwrap();
        let blocked = drive(&robot, &goal).await.unwrap_err();
        assert!(matches!(&blocked, Failure::Blocked { by: Some(d), .. } if d == "north door"), "{blocked}");
        let here = robot.truth().base;
        assert!(here.x_m > 0.12 && here.x_m < 0.45, "it stands before the door: {here:?}");
        // It goes round by the door that it takes for open, and learns of that one too.
        let blocked = drive(&robot, &goal).await.unwrap_err();
        assert!(matches!(&blocked, Failure::Blocked { by: Some(d), .. } if d == "south door"), "{blocked}");
        let far = robot.open_door("north door", &Watch::default()).await;
        assert!(matches!(far, Err(Failure::Unreachable { .. })), "{far:?}");
        // With both seen shut it goes to the nearest and says so again.
        let blocked = drive(&robot, &goal).await.unwrap_err();
        let Failure::Blocked { by: Some(door), .. } = blocked else { panic!("{blocked}") };
        open(&robot, &door).await;
        drive(&robot, &goal).await.unwrap();
        assert!(robot.truth().base.x_m < -0.8);
        assert_eq!(robot.truth().doors.iter().filter(|d| d.shut).count(), 1);
        drive(&robot, &at(1.4, -1.2)).await.unwrap();
    }
}

#[tokio::test]
async fn one_open_door_is_enough() {
    let robot = robot_in(&shut("north door"), 3, "");
    drive(&robot, &at(1.4, 1.2)).await.unwrap();
    let goal = at(-1.0, 1.2);
    assert!(matches!(drive(&robot, &goal).await, Err(Failure::Blocked { .. })));
    drive(&robot, &goal).await.unwrap();
    assert!(robot.truth().doors[0].shut);
}

fn grasp_of(o: &TrueObject, width_m: f64) -> Grasp {
    Grasp { object: o.centre_m, width_m }
}

async fn take(robot: &SimRobot, name: &str, width_m: f64) {
    for _ in 0..20 {
        match robot.grasp(&grasp_of(&object(robot, name), width_m), &Watch::default()).await {
            Err(Failure::Slipped { .. }) => {}
            answer => {
                assert!((answer.unwrap().width_m - width_m).abs() < 1e-9);
                return;
            }
        }
    }
    panic!("it always slips");
}

#[tokio::test]
async fn a_cup_is_carried_to_another_room() {
    let mut off_m: Vec<f64> = Vec::new();
    for seed in 0..20 {
        let robot = robot_in(FLAT, seed, "");
        drive(&robot, &at(-1.2, 0.2)).await.unwrap();
        take(&robot, "cup", 0.07).await;
        let cup = object(&robot, "cup");
        assert!(robot.hand().await.unwrap().holds && cup.in_hand && cup.present);
        assert_eq!((cup.surface, cup.room.as_deref()), (None, Some("kitchen")));
        let label = descry_robots::sim::world::LABEL_OBJECT;
        robot.look_at(&Point3::new(-2.0, 0.1, 0.8), &Watch::default()).await.unwrap();
        assert!(!robot.true_frame().label.contains(&label), "what is held is not in the scene");
        let push = descry_robots::Push {
            object: object(&robot, "crate").centre_m,
            direction: [1.0, 0.0].into(),
            distance_m: 0.1,
        };
        let pushed = robot.push_aside(&push, &Watch::default()).await;
        assert!(matches!(pushed, Err(Failure::Unable { .. })), "{pushed:?}");
        drive(&robot, &Place::Pose(Pose2::facing(2.2, 0.9, &Point2::new(2.2, 1.8)))).await.unwrap();
        let cup = object(&robot, "cup");
        assert_eq!(cup.room.as_deref(), Some("hall"));
        assert!((cup.centre_m.xy() - robot.truth().base.point()).norm() < 0.5, "it travels with the base");
        let foot = Point3::new(2.15, 1.8, 1.15);
        robot.place(&Placing { foot }, &Watch::default()).await.unwrap();
        let cup = object(&robot, "cup");
        assert_eq!((cup.surface.as_deref(), cup.room.as_deref()), (Some("upper board"), Some("hall")));
        assert!(!cup.in_hand && !robot.hand().await.unwrap().holds);
        assert!((cup.map_from_object.translation.z - 1.15).abs() < 1e-9, "it stands on the board");
        off_m.push((cup.centre_m.xy() - foot.xy()).norm());
    }
    let mean_m = off_m.iter().sum::<f64>() / off_m.len() as f64;
    assert!(mean_m > 0.005 && mean_m < 0.08, "{mean_m} m off on average");
}

#[tokio::test]
async fn the_hand_does_not_reach_through_a_wall() {
    let robot = robot_in(&FLAT.replace("position_m = [-2.2, 0.0]", "position_m = [-0.7, 0.0]"), 4, "");
    drive(&robot, &at(1.0, 0.1)).await.unwrap();
    let walled = robot.grasp(&grasp_of(&object(&robot, "cup"), 0.07), &Watch::default()).await;
    let Err(Failure::Unreachable { because }) = &walled else { panic!("{walled:?}") };
    assert!(because.contains("wall"), "{because}");
    drive(&robot, &at(-0.9, -1.2)).await.unwrap();
    take(&robot, "cup", 0.07).await;
}

#[tokio::test]
async fn a_hand_has_limits() {
    let robot = robot_in(FLAT, 4, "");
    let watch = Watch::default();
    let far = robot.grasp(&grasp_of(&object(&robot, "cup"), 0.07), &watch).await;
    assert!(matches!(far, Err(Failure::Unreachable { .. })), "{far:?}");
    drive(&robot, &at(-1.2, 0.2)).await.unwrap();
    let wide = robot.grasp(&grasp_of(&object(&robot, "crate"), 0.2), &watch).await;
    assert!(matches!(wide, Err(Failure::Unable { .. })), "{wide:?}");
    drive(&robot, &at(-3.2, 0.2)).await.unwrap();
    let wider = robot.grasp(&grasp_of(&object(&robot, "crate"), 0.1), &watch).await;
    assert!(matches!(wider, Err(Failure::Slipped { .. })), "{wider:?}: wider than it was said to be");
    drive(&robot, &at(-1.2, 0.2)).await.unwrap();
    // The cup is not taken through the height of another board.
    let mut above = grasp_of(&object(&robot, "cup"), 0.07);
    above.object.z += 0.3;
    assert!(matches!(robot.grasp(&above, &watch).await, Err(Failure::Slipped { .. })));
    take(&robot, "cup", 0.07).await;
    let place = |foot: Point3<f64>| Placing { foot };
    let on_floor = robot.place(&place(Point3::new(-1.0, 0.9, 0.75)), &watch).await;
    assert!(matches!(on_floor, Err(Failure::Unreachable { .. })), "{on_floor:?}: there is no surface");
    let crate_ = object(&robot, "crate").centre_m;
    let taken = robot.place(&place(Point3::new(crate_.x, crate_.y, 0.75)), &watch).await;
    assert!(matches!(taken, Err(Failure::Blocked { .. })), "{taken:?}");
    assert!(robot.hand().await.unwrap().holds, "what is not put down is still held");
    // Beyond the edge it is put down inside.
    robot.place(&place(Point3::new(-1.62, 0.0, 0.75)), &watch).await.unwrap();
    let cup = object(&robot, "cup");
    assert!(cup.centre_m.x <= -1.6 - 0.035 + 1e-9, "{}", cup.centre_m);
    let empty = robot.place(&place(Point3::new(-1.9, 0.0, 0.75)), &watch).await;
    assert!(matches!(empty, Err(Failure::Unable { .. })), "{empty:?}");
}

/// Pours a cup of 0.2 l at a distance from the centre of a bowl with some content; returns the answer and the last event.
async fn pour(in_bowl_l: f64, aside_m: f64, takes: bool) -> (Result<Answer, Failure>, String) {
    let cup = "shape.cup = { diameter_m = 0.07, height_m = 0.1 }";
    let bowl =
        "name = \"bowl\"\nshape.cup = { diameter_m = 0.16, height_m = 0.08 }\nposition_m = [0.3, -0.15]";
    let text = FLAT.replace(cup, &format!("{cup}\nholds_l = 0.2"));
    let robot =
        robot_in(&format!("{text}[[object]]\n{bowl}\non = \"table\"\nholds_l = {in_bowl_l}\n"), 3, "");
    drive(&robot, &at(-1.2, 0.2)).await.unwrap();
    if takes {
        take(&robot, "cup", 0.07).await;
    }
    let over = object(&robot, "bowl").centre_m + Vector3::new(aside_m, 0.0, 0.04);
    let answer = robot.manipulate(&Request::Pour(Pouring { over }), &Watch::default()).await;
    (answer, robot.truth().events.last().map_or(String::new(), |event| event.what.clone()))
}

#[tokio::test]
async fn a_vessel_is_emptied_into_the_one_below_or_spilt() {
    let (poured, said) = pour(0.0, 0.0, true).await;
    assert!(matches!(poured, Ok(Answer::Poured(Poured { litres: 0.2, .. }))), "{poured:?}");
    assert_eq!(said, "the hand pours 0.20 l of \"cup\" into \"bowl\"");
    for (in_bowl_l, aside_m, said) in
        [(0.0, 0.2, "0.20 l of \"cup\" are spilt"), (1.4, 0.0, "0.17 l of \"cup\" run over \"bowl\"")]
    {
        let (spilt, event) = pour(in_bowl_l, aside_m, true).await;
        assert!(matches!(spilt, Err(Failure::Slipped { .. })), "{spilt:?}");
        assert_eq!(event, said);
    }
    let (far, event) = pour(0.0, 3.0, true).await;
    assert!(matches!(far, Err(Failure::Unreachable { .. })) && !event.contains(" l "), "{far:?}, {event}");
    let (empty, _) = pour(0.0, 0.0, false).await;
    assert!(matches!(empty, Err(Failure::Unable { .. })), "{empty:?}");
    let too_full =
        FLAT.replace("height_m = 0.1 }\nposition_m", "height_m = 0.1 }\nholds_l = 3.0\nposition_m");
    let refused = SceneSpec::parse("flat.toml", &too_full).unwrap_err().to_string();
    assert!(refused.contains("3 l are not in it") && refused.contains("0 to 0.31 l"), "{refused}");
}

#[tokio::test]
async fn a_hand_slips_now_and_then() {
    let (mut slipped, mut displaced) = (0, 0);
    for seed in 0..100 {
        let robot = robot_in(FLAT, seed, "");
        drive(&robot, &at(-1.2, 0.2)).await.unwrap();
        let before = object(&robot, "cup");
        match robot.grasp(&grasp_of(&before, 0.07), &Watch::default()).await {
            Ok(_) => assert!(object(&robot, "cup").in_hand),
            Err(Failure::Slipped { .. }) => {
                slipped += 1;
                let after = object(&robot, "cup");
                let moved_m = (after.centre_m - before.centre_m).norm();
                assert!(!after.in_hand && after.surface.as_deref() == Some("table") && moved_m < 0.05);
                displaced += usize::from(moved_m > 0.0);
            }
            Err(other) => panic!("{other}"),
        }
    }
    assert!((3..25).contains(&slipped) && displaced > 0, "{slipped} of 100 slipped, {displaced} displaced");
}

#[tokio::test]
async fn mishaps_happen_as_declared() {
    let fault = |text: &str| robot_in(FLAT, 5, &format!("[[fault]]\n{text}\n"));
    let robot = fault("kind = \"door_shut\"\nat = 2\ndoor = \"north door\"");
    drive(&robot, &at(1.4, 1.2)).await.unwrap();
    let blocked = drive(&robot, &at(-1.0, 1.2)).await;
    assert!(
        matches!(&blocked, Err(Failure::Blocked { by: Some(d), .. }) if d == "north door"),
        "{blocked:?}"
    );

    let robot = fault("kind = \"door_shut\"\nat = 1");
    drive(&robot, &at(1.4, -1.2)).await.unwrap();
    assert_eq!(robot.truth().doors.iter().filter(|d| d.shut).count(), 1, "the seed chooses one");

    let both = "kind = \"door_shut\"\nat = 1\ndoor = \"north door\"\n[[fault]]\nkind = \"door_shut\"\nat = 1\ndoor = \"south door\"";
    let robot = fault(both);
    drive(&robot, &at(1.4, -1.2)).await.unwrap();
    assert_eq!(robot.truth().doors.iter().filter(|d| d.shut).count(), 2, "both at one drive");

    let robot = fault("kind = \"grasp_slips\"\nchance = 1.0");
    drive(&robot, &at(-1.2, 0.2)).await.unwrap();
    for _ in 0..5 {
        let answer = robot.grasp(&grasp_of(&object(&robot, "cup"), 0.07), &Watch::default()).await;
        assert!(matches!(answer, Err(Failure::Slipped { .. })), "{answer:?}");
    }

    let robot = fault("kind = \"object_dropped\"\nat = 2");
    drive(&robot, &at(-1.2, 0.2)).await.unwrap();
    take(&robot, "cup", 0.07).await;
    drive(&robot, &at(1.5, 0.5)).await.unwrap();
    let cup = object(&robot, "cup");
    assert!(!robot.hand().await.unwrap().holds, "the hand feels that it is empty");
    assert!(cup.present && !cup.in_hand && cup.surface.is_none());
    assert!((cup.centre_m.z - 0.05).abs() < 1e-9, "it lies on the floor");

    for (to, expected) in [("\nto = \"upper board\"", Some("upper board")), ("", None)] {
        let robot = fault(&format!("kind = \"object_relocated\"\nat = 1\nobject = \"cup\"{to}"));
        drive(&robot, &at(1.4, 1.2)).await.unwrap();
        let surface = object(&robot, "cup").surface.unwrap();
        assert!(surface != "table" && expected.is_none_or(|e| e == surface), "{surface}");
        assert!(robot.truth().events.iter().any(|e| e.what.contains(&surface)));
    }
    for (text, line, word) in [
        ("kind = \"object_moved\"\nat = 1\nto = \"desk\"", 4, "object_relocated"),
        ("kind = \"grasp_slips\"\nat = 1\ndoor = \"desk\"", 4, "door_shut"),
    ] {
        let error = FaultPlan::parse("faults.toml", &format!("[[fault]]\n{text}\n")).unwrap_err();
        assert!(error.line == line && error.to_string().contains(word), "{error}");
    }
}

#[tokio::test]
async fn a_body_in_a_flat_conforms() {
    for seed in 0..3 {
        let robot = robot_in(FLAT, seed, "");
        conformance::check(&robot).await.unwrap();
        let placing = Placing { foot: Point3::new(-1.9, -0.15, 0.75) };
        let grasp = grasp_of(&object(&robot, "cup"), 0.07);
        conformance::check_carrying(&robot, &at(-1.2, 0.2), &grasp, &placing).await.unwrap();
    }
}
