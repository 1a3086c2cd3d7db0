//! Every body of this crate keeps the promises of bodies, and a body that does not is found out.

use crate::{folders, scenes};
use descry_robots::conformance;
use descry_robots::recorded::RecordedRobot;
use descry_robots::sim::{SimOptions, SimRobot};
use descry_robots::{
    Description, Driven, Failure, Grasp, Grasped, Hand, Looked, OccupancyGrid, Place, Placed, Placing,
    PoseEstimate, Robot, Scanned, Sensed, Stamp, Station, SurfaceHint, Travel, Watch, async_trait, nalgebra,
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
        let robot = RecordedRobot::open(folder.path()).unwrap();
        conformance::check(&robot).await.unwrap();
    }
}

#[tokio::test]
#[ignore = "data: the frames of ../shared/data/kitchen"]
async fn a_real_recording_conforms() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/kitchen");
    conformance::check(&RecordedRobot::open(&path).unwrap()).await.unwrap();
}

/// A body that breaks one promise and keeps the others.
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
    async fn grasp(&self, grasp: &Grasp, watch: &Watch<'_>) -> Result<Grasped, Failure> {
        match self.honest.grasp(grasp, watch).await {
            Err(Failure::Slipped { .. }) if self.lie == Lie::Greedy => {
                Ok(Grasped { width_m: grasp.width_m, duration_s: 1.0 })
            }
            answer => answer,
        }
    }
    async fn place(&self, placing: &Placing, watch: &Watch<'_>) -> Result<Placed, Failure> {
        self.honest.place(placing, watch).await
    }
    async fn hand(&self) -> Result<Hand, Failure> {
        if self.lie == Lie::Numb { Ok(Hand { holds: true }) } else { self.honest.hand().await }
    }
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
        let breach = conformance::check(&Liar { honest: simulated(1), lie }).await.unwrap_err();
        assert_eq!(breach.promise, promise, "{lie:?}: {breach}");
    }
}
