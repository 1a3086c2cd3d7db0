//! Regression test: arrangements and frames of the tabletop scenes are fixed for their seeds, bit by bit.

use descry_robots::nalgebra::Point3;
use descry_robots::sim::{SceneSpec, SimOptions, SimRobot, arrange};
use descry_robots::{Place, Pose2, Robot, Watch};
use std::hash::{DefaultHasher, Hash, Hasher};

async fn hashes(scene: &str, seed: u64) -> [u64; 2] {
    let path = format!("{}/../domains/tabletop/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let scene = arrange(&SceneSpec::parse("scene.toml", &text).unwrap(), seed).unwrap();
    let mut arranged = DefaultHasher::new();
    for o in &scene.objects {
        (&o.name, &o.kind, format!("{:?}", o.shape), o.colour).hash(&mut arranged);
        o.map_from_object.to_homogeneous().iter().for_each(|x| x.to_bits().hash(&mut arranged));
    }
    let robot = SimRobot::new(scene, SimOptions { seed, ..SimOptions::default() });
    let watch = Watch::default();
    let goal = Place::Pose(Pose2::facing(0.3, 1.35, &[0.0, 0.0].into()));
    robot.drive_to(&goal, &watch).await.unwrap();
    robot.look_at(&Point3::new(0.0, 0.0, 0.72), &watch).await.unwrap();
    let ideal = robot.true_frame();
    let sensed = robot.sense(&watch).await.unwrap();
    let mut seen = DefaultHasher::new();
    ideal.depth_m.iter().chain(&ideal.cosine).for_each(|x| x.to_bits().hash(&mut seen));
    (&ideal.label, &ideal.colour).hash(&mut seen);
    sensed.depth_m.iter().for_each(|x| x.to_bits().hash(&mut seen));
    sensed.map_from_camera.to_homogeneous().iter().for_each(|x| x.to_bits().hash(&mut seen));
    [arranged.finish(), seen.finish()]
}

#[tokio::test]
async fn seeds_keep_their_scenes_and_frames() {
    for (scene, seed, expected) in [
        ("default", 1, [0xfb66e21f9d7b5210, 0xbf87b095e3dec09e]),
        ("default", 2, [0x94f4268e6a7bbdb2, 0x619386c2588624d6]),
        ("clutter", 7, [0x6babb6e6a984085a, 0xd840ae5da3d08db4]),
        ("four-cups", 3, [0xe86eee11529fa990, 0xf68f013b8e4f8292]),
        ("ring-of-boxes", 1, [0x40bd629f2a35bf06, 0x571d0708c8d78305]),
    ] {
        let found = hashes(scene, seed).await;
        assert_eq!(found, expected, "{scene}, seed {seed}: {found:#x?}");
    }
}
