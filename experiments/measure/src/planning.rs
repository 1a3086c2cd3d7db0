//! Time of a planning round in the tabletop domain: `cargo run --release -p descry-measure --bin planning`
//!
//! Posts on a table hide parts of the table from parts of the room; a view shows the unoccluded spots,
//! and is expected to raise the confidence by the share of newly shown spots. For 5, 20 and 100
//! candidate poses, prints a JSON line: planning time from the text on (least and median of several
//! rounds, each with an empty cache), the share of the attachments in that time, their calls, and the
//! plan.

use std::f64::consts::TAU;
use std::time::Instant;

use descry_planner::{
    Answer, Attachment, Attachments, Call, CallError, FactValue, Options, Outcome, Read, Source, Task, plan,
};
use serde_json::json;

const DOMAIN: &str = include_str!("../../../domains/tabletop/domain.pddl");
const ROUNDS: usize = 15;

/// Speed of a drive, as in the simulated room.
const SPEED_M_PER_S: f64 = 0.5;
/// Posts on the table: x, y and radius, metres.
const POSTS_M: [[f64; 3]; 4] = [[0.1, 0.05, 0.09], [-0.2, -0.1, 0.07], [0.15, -0.3, 0.08], [-0.1, 0.3, 0.06]];

/// Poses around a table, and the visibility of its spots from each.
struct Room {
    poses_m: Vec<[f64; 2]>,
    shown: Vec<Vec<bool>>,
}

impl Room {
    fn new(poses: usize) -> Room {
        let golden = TAU * 0.618_033_988_75;
        let pose = |n: usize| {
            let (angle, radius_m) = (golden * n as f64, 1.2 + 0.4 * n as f64 / poses as f64);
            [radius_m * angle.cos(), radius_m * angle.sin()]
        };
        let poses_m: Vec<[f64; 2]> = (0..poses).map(pose).collect();
        let spots: Vec<[f64; 2]> = (0..9)
            .flat_map(|i| (0..17).map(move |j| [f64::from(i) * 0.1 - 0.4, f64::from(j) * 0.1 - 0.8]))
            .collect();
        let seen = |pose: &[f64; 2]| {
            spots.iter().map(|spot| POSTS_M.iter().all(|post| passes(*pose, *spot, *post))).collect()
        };
        Room { shown: poses_m.iter().map(seen).collect(), poses_m }
    }

    fn drive_s(&self, from: usize, to: usize) -> f64 {
        let ([x, y], [u, v]) = (self.poses_m[from], self.poses_m[to]);
        (x - u).hypot(y - v) / SPEED_M_PER_S
    }

    fn share_settled(&self, from: usize, earlier: &[usize]) -> f64 {
        let fresh = |spot: usize| self.shown[from][spot] && !earlier.iter().any(|&p| self.shown[p][spot]);
        let spots = self.shown[from].len();
        (0..spots).filter(|&spot| fresh(spot)).count() as f64 / spots as f64
    }
}

/// True if the segment from `a` to `b` keeps clear of a post.
fn passes(a: [f64; 2], b: [f64; 2], [x, y, radius_m]: [f64; 3]) -> bool {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let along = (((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    (a[0] + along * dx - x).hypot(a[1] + along * dy - y) > radius_m
}

/// Attachment that answers one module from the room.
struct Answers {
    room: std::sync::Arc<Room>,
    reads: bool,
    answer: fn(&Room, usize, &Call) -> Result<Answer, CallError>,
}

impl Attachment for Answers {
    fn reads(&self) -> Vec<Read> {
        if self.reads { vec![Read::All("observed".into())] } else { Vec::new() }
    }

    fn evaluate(&self, call: &Call) -> Result<Answer, CallError> {
        (self.answer)(&self.room, pose(&call.arguments[0])?, call)
    }
}

fn pose(name: &str) -> Result<usize, CallError> {
    let number = name.strip_prefix('p').and_then(|number| number.parse().ok());
    number.ok_or_else(|| CallError::Failed(format!("`{name}` is no pose")))
}

fn gain(room: &Room, from: usize, call: &Call) -> Result<Answer, CallError> {
    let taken = call.readings.iter().filter(|reading| reading.value == FactValue::Truth(true));
    let earlier: Result<Vec<usize>, CallError> = taken.map(|reading| pose(&reading.arguments[0])).collect();
    Ok(Answer::Number(room.share_settled(from, &earlier?)))
}

fn attachments(room: &std::sync::Arc<Room>) -> Attachments {
    let started = Instant::now();
    let mut attachments = Attachments::new().with_clock(move || started.elapsed().as_secs_f64());
    let mut insert = |name: &str, reads, answer| {
        attachments.insert(name, Answers { room: std::sync::Arc::clone(room), reads, answer });
    };
    insert("path-cost", false, |room, from, call| {
        Ok(Answer::Number(room.drive_s(from, pose(&call.arguments[1])?)))
    });
    insert("can-see", false, |_, _, _| Ok(Answer::Truth(true)));
    insert("worth-a-look", false, |_, _, _| Ok(Answer::Truth(true)));
    insert("expected-gain", true, gain);
    insert("expected-clarity", true, gain);
    attachments
}

fn problem(poses: usize, goal: &str) -> Source {
    let names: Vec<String> = (0..poses).map(|n| format!("p{n}")).collect();
    let text = format!(
        "(define (problem round) (:domain tabletop) (:objects {} - pose table - surface cup - thing)
         (:init (at p0) (time-left) (= (confidence cup) 0) (= (clarity table) 0)) (:goal {goal}) (:metric minimize (total-time)))",
        names.join(" ")
    );
    Source::new("problem", text)
}

fn main() {
    for poses in [5, 20, 100] {
        let room = std::sync::Arc::new(Room::new(poses));
        let every: Vec<usize> = (0..poses).collect();
        let most = (0..room.shown[0].len()).filter(|&spot| every.iter().any(|&p| room.shown[p][spot]));
        let wanted = 0.9 * most.count() as f64 / room.shown[0].len() as f64;
        let problem = problem(poses, &format!("(>= (confidence cup) {wanted:.6})"));
        let mut times_ms = Vec::new();
        let mut last = None;
        for _ in 0..ROUNDS {
            let started = Instant::now();
            let attachments = attachments(&room);
            let task = Task::read(&Source::new("domain", DOMAIN), &problem);
            let task = task.unwrap_or_else(|findings| panic!("{}", findings.render(false)));
            let found = plan(&task, &attachments, &Options::default(), &|| false, &mut |_| {});
            times_ms.push(started.elapsed().as_secs_f64() * 1e3);
            last = Some(found.unwrap_or_else(|error| panic!("{error}")));
        }
        times_ms.sort_by(f64::total_cmp);
        let Some(found) = last else { return };
        let Outcome::Solved { plan, statistics } = &found else { panic!("{found:?}") };
        let attached_s: f64 = statistics.attachments.values().map(|calls| calls.time_s).sum();
        let line = json!({
            "poses": poses, "ms_min": times_ms[0], "ms_median": times_ms[ROUNDS / 2], "attachments_ms": attached_s * 1e3,
            "evaluated": statistics.evaluated, "steps": plan.steps.len(), "makespan_s": plan.makespan_s(),
            "attachments": statistics.attachments,
        });
        println!("{line}");
    }
}
