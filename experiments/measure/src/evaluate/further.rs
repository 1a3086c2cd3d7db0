//! Cost of one more view of a table: wall-clock and CPU time of merging against the number of views, from
//! scratch, incrementally, and incrementally with the work done ahead of the next view.

use super::table::{arrangement, judge, options};
use super::tabletop::{Draws, Thing, disturbed, look, on_ring};
use descry_perception::merge::{Merger, merge};
use descry_perception::recognise::Descry;
use descry_perception::{Merged, Percept, View};
use std::time::Instant;

/// CPU time of all threads since the start, milliseconds.
fn cpu_ms() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().filter_map(Result::ok);
    let of_task = |task: std::fs::DirEntry| std::fs::read_to_string(task.path().join("schedstat")).ok();
    let first = |text: String| text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok());
    tasks.filter_map(of_task).filter_map(first).sum::<f64>() / 1e6
}

/// Repetitions of each merge; the least time counts.
const REPETITIONS: usize = 7;

/// Minimum wall-clock and CPU time, milliseconds.
#[derive(Clone, Copy)]
struct Least {
    wall_ms: f64,
    cpu_ms: f64,
}

impl Least {
    /// No measurement yet.
    const NONE: Least = Least { wall_ms: f64::INFINITY, cpu_ms: f64::INFINITY };

    fn time<T>(&mut self, of: impl FnOnce() -> T) -> T {
        let (start, before) = (Instant::now(), cpu_ms());
        let found = of();
        self.wall_ms = self.wall_ms.min(start.elapsed().as_secs_f64() * 1e3);
        self.cpu_ms = self.cpu_ms.min(cpu_ms() - before);
        found
    }

    fn words(&self) -> String {
        if self.wall_ms.is_finite() {
            format!("{:.0} ({:.0})", self.wall_ms, self.cpu_ms)
        } else {
            "-".to_owned()
        }
    }
}

/// Merges up to `count` views of some arrangements, one by one.
pub fn run(count: usize, mode: &str) -> Result<(), String> {
    println!(
        "{:>5} {:>10} {:>10} {:>10}   ms (of CPU), least of {REPETITIONS}; {:>9} {:>9}  cups right, wrong",
        "views", "anew", "kept", "ahead", "anew", "kept"
    );
    for seed in 1..=2 {
        let mut draws = Draws(seed);
        let things = arrangement(&mut draws);
        let bare: Vec<Thing> = things.iter().map(|t| t.0).collect();
        let views: Vec<View> = (0..count)
            .map(|i| {
                let angle = 2.4 * i as f64 + 0.3 * draws.next();
                let truth = on_ring(angle, 1.1 + 0.5 * draws.next(), 1.3 + 0.2 * draws.next());
                let stated = disturbed(&truth, 0.03, 0.035, &mut draws);
                look(&bare, &truth, &stated, &mut draws)
            })
            .collect();
        let mut looks = vec![[Least::NONE; 3]; count];
        let mut scores = vec![["-".to_owned(), "-".to_owned()]; count];
        for repetition in 0..REPETITIONS {
            let mut merger = Merger::default();
            for (n, (look, score)) in (1..).zip(looks.iter_mut().zip(&mut scores)) {
                let views = &views[..n];
                let merged = [
                    (mode != "kept").then(|| look[0].time(|| merge(views, &options()))),
                    (mode != "anew").then(|| look[1].time(|| merger.merge(views, &options()))),
                ];
                if mode != "anew" {
                    let views = views.to_vec();
                    look[2].time(|| {
                        merger.go_ahead(views);
                        merger.wait();
                    });
                }
                for (merged, score) in merged.into_iter().zip(score).filter(|_| repetition == 0) {
                    if let Some(merged) = merged {
                        *score = of_cups(&merged.map_err(|e| e.to_string())?, &things)?;
                    }
                }
            }
        }
        for (n, (look, score)) in (1..).zip(looks.iter().zip(&scores)) {
            let [anew, kept, ahead] = look.map(|least| least.words());
            println!(
                "{n:5} {anew:>10} {kept:>10} {ahead:>10}                 {:>9} {:>9}",
                score[0], score[1]
            );
        }
    }
    Ok(())
}

/// Number of correct and of wrong names, and of views left out.
fn of_cups(merged: &Merged, things: &[(Thing, Option<&str>)]) -> Result<String, String> {
    let percepts = judge(merged, &Descry::default())?;
    let is_right = |p: &&Percept| {
        let (label, at) = (p.label.as_deref(), p.position_m);
        let near = |thing: &Thing| match *thing {
            Thing::Cup { x, y, .. } => (x - at.x).hypot(y - at.y) < 0.05,
            _ => false,
        };
        things.iter().any(|(thing, name)| label == *name && near(thing))
    };
    let named = || percepts.iter().filter(|p| p.label.is_some());
    let right = named().filter(is_right).count();
    let left_out = merged.fits.iter().filter(|fit| !fit.used).count();
    Ok(format!("{right} {} -{left_out}", named().count() - right))
}
