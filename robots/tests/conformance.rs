//! Every body of this crate passes the conformance test, and violations are detected.

use crate::{folders, scenes};
use descry_robots::conformance;
use descry_robots::recorded::RecordedRobot;
use descry_robots::sim::{SimOptions, SimRobot};
use descry_robots::{
    Answer, Description, Driven, Failure, Grasped, Hand, Looked, OccupancyGrid, Place, PoseEstimate, Request,
    Robot, Scanned, Sensed, Stamp, Station, SurfaceHint, Travel, Watch, async_trait, nalgebra,
};

fn simulated(seed: u64) -> SimRobot {
    let scene = scenes::cup_on_a_table(seed);
    SimRobot::new(scene, SimOptions { seed, ..SimOptions::default() })
}

#[tokio::test]
async fn the_simulated_body_conforms() {
    for seed in 0..3 {
        conformance::check(&simulated(seed)).await.unwrap();
    }
}

#[tokio::test]
async fn recordings_conform() {
    for folder in [folders::side_by_side(), folders::listed()] {
        let robot = RecordedRobot::open(folder.path()).unwrap().0;
        conformance::check(&robot).await.unwrap();
    }
}

#[tokio::test]
#[ignore = "data: the frames of ../shared/data/kitchen"]
async fn a_real_recording_conforms() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/kitchen");
    conformance::check(&RecordedRobot::open(&path).unwrap().0).await.unwrap();
}

/// A body that violates one promise and keeps the others.
struct Liar {
    honest: SimRobot,
    lie: Lie,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lie {
    Backwards,
    Unstoppable,
    WrongChain,
    Everywhere,
    Moody,
    Numb,
    Greedy,
    ShortSweep,
    Blind,
    Mirrored,
    UpsideDown,
    TenTimes,
    Covered,
    Late,
}

#[async_trait]
impl Robot for Liar {
    fn description(&self) -> &Description {
        self.honest.description()
    }
    fn now_ns(&self) -> Stamp {
        if self.lie == Lie::Backwards { -self.honest.now_ns() } else { self.honest.now_ns() }
    }
    fn map(&self) -> Option<&OccupancyGrid> {
        self.honest.map()
    }
    fn surfaces(&self) -> &[SurfaceHint] {
        self.honest.surfaces()
    }
    fn stations(&self) -> Option<&[Station]> {
        None
    }
    fn travel(&self, from: &Place, to: &[Place], shut: &[String]) -> Vec<Result<Travel, Failure>> {
        let mut answers = self.honest.travel(from, to, shut);
        if self.lie == Lie::Moody {
            answers.pop();
        }
        answers
    }
    fn camera_at(
        &self,
        place: &Place,
        look_at: Option<&nalgebra::Point3<f64>>,
    ) -> Result<nalgebra::Isometry3<f64>, Failure> {
        self.honest.camera_at(place, look_at)
    }
    async fn pose(&self) -> Result<PoseEstimate, Failure> {
        self.honest.pose().await
    }
    async fn drive_to(&self, to: &Place, watch: &Watch<'_>) -> Result<Driven, Failure> {
        match (self.lie, self.honest.drive_to(to, watch).await) {
            (Lie::Everywhere, Err(Failure::Unreachable { .. })) => Ok(Driven {
                distance_m: 0.0,
                duration_s: 0.0,
                map_from_base: nalgebra::Isometry3::identity(),
            }),
            (Lie::Unstoppable, Err(Failure::Cancelled { .. })) => {
                self.honest.drive_to(to, &Watch::default()).await
            }
            (_, answer) => answer,
        }
    }
    async fn look_at(&self, point: &nalgebra::Point3<f64>, watch: &Watch<'_>) -> Result<Looked, Failure> {
        self.honest.look_at(point, watch).await
    }
    async fn sense(&self, watch: &Watch<'_>) -> Result<Sensed, Failure> {
        let mut sensed = self.honest.sense(watch).await?;
        match self.lie {
            Lie::Mirrored => shuffle(&mut sensed, |u, v, (width, _)| (width - 1 - u, v)),
            Lie::UpsideDown => shuffle(&mut sensed, |u, v, (width, height)| (width - 1 - u, height - 1 - v)),
            Lie::TenTimes => sensed.depth_m.iter_mut().for_each(|d| *d *= 10.0),
            Lie::Covered => sensed.depth_m.fill(0.0),
            Lie::Late => sensed.stamp_ns -= 133_000_000,
            _ => {}
        }
        if let Ok(cloud) = sensed.intrinsics.cloud_from_depth(&sensed.depth_m) {
            sensed.cloud.points = cloud.points;
        }
        if self.lie == Lie::WrongChain {
            sensed.transforms.reverse();
        }
        Ok(sensed)
    }
    async fn scan(&self, watch: &Watch<'_>) -> Result<Scanned, Failure> {
        let mut scanned = self.honest.scan(watch).await?;
        if self.lie == Lie::ShortSweep {
            scanned.scan.ranges_m.pop();
        }
        match self.lie {
            Lie::Blind => Err(Failure::Unable { because: "there is no laser".into() }),
            _ => Ok(scanned),
        }
    }
    async fn manipulate(&self, request: &Request, watch: &Watch<'_>) -> Result<Answer, Failure> {
        match (request, self.honest.manipulate(request, watch).await) {
            (Request::Grasp(grasp), Err(Failure::Slipped { .. })) if self.lie == Lie::Greedy => {
                Ok(Answer::Grasped(Grasped { width_m: grasp.width_m, duration_s: 1.0 }))
            }
            (_, answer) => answer,
        }
    }
    async fn hand(&self) -> Result<Hand, Failure> {
        if self.lie == Lie::Numb { Ok(Hand { holds: true }) } else { self.honest.hand().await }
    }
}

/// Permutes the pixels of a frame.
fn shuffle(sensed: &mut Sensed, from: impl Fn(usize, usize, (usize, usize)) -> (usize, usize)) {
    let size = (sensed.intrinsics.width, sensed.intrinsics.height);
    let moved = |pixel: usize| {
        let (u, v) = from(pixel % size.0, pixel / size.0, size);
        sensed.depth_m[v * size.0 + u]
    };
    sensed.depth_m = (0..size.0 * size.1).map(moved).collect();
}

#[tokio::test]
async fn images_that_lie_are_refused() {
    let promise = "the camera shows the surfaces of the map where they are";
    for lie in [Lie::Mirrored, Lie::UpsideDown, Lie::TenTimes, Lie::Covered] {
        let breaches = conformance::check(&Liar { honest: simulated(1), lie }).await.unwrap_err().0;
        assert!(breaches.iter().any(|b| b.promise == promise), "{lie:?}: {breaches:?}");
    }
}

#[tokio::test]
async fn all_broken_promises_are_told_at_once() {
    let breaches = conformance::check(&Liar { honest: simulated(1), lie: Lie::Late }).await.unwrap_err().0;
    let late = breaches.iter().filter(|b| b.promise == "a frame is of now").count();
    assert_eq!(late, 3, "each frame of the check is late: {breaches:?}");
}

#[tokio::test]
async fn broken_promises_are_found() {
    for (lie, promise) in [
        (Lie::Backwards, "a frame is of now"),
        (Lie::Unstoppable, "a drive can be stopped"),
        (Lie::WrongChain, "the chain is map, base, camera"),
        (Lie::Everywhere, "a place that is none is unreachable, with a reason"),
        (Lie::Moody, "each question about a route has an answer"),
        (Lie::ShortSweep, "angles, ranges and pose of a sweep go together"),
        (Lie::Blind, "a body with a laser sweeps it"),
        (Lie::Numb, "a hand feels whether it holds something"),
        (Lie::Greedy, "a hand that closes on nothing says so"),
    ] {
        let breaches = conformance::check(&Liar { honest: simulated(1), lie }).await.unwrap_err().0;
        assert_eq!(breaches[0].promise, promise, "{lie:?}: {breaches:?}");
    }
}
