//! What one more look at a table costs: time of merging when there are 3, 10 and 30 views, anew and with what was kept of the look before, and
//! CPU time of all its threads.

use super::table::{arrangement, judge, options};
use super::tabletop::{Draws, Thing, disturbed, look, on_ring};
use descry_perception::merge::{Merger, merge};
use descry_perception::recognise::Descry;
use descry_perception::{Merged, View};
use std::time::Instant;

/// CPU time of all threads so far, milliseconds.
fn cpu_ms() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().filter_map(Result::ok);
    let of_task = |task: std::fs::DirEntry| std::fs::read_to_string(task.path().join("schedstat")).ok();
    let first = |text: String| text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok());
    tasks.filter_map(of_task).filter_map(first).sum::<f64>() / 1e6
}

/// What came out, with how long it took and of how much CPU time, milliseconds.
fn timed<T>(of: impl FnOnce() -> Result<T, String>) -> Result<(T, String), String> {
    let (start, before) = (Instant::now(), cpu_ms());
    let found = of()?;
    let ms = start.elapsed().as_secs_f64() * 1e3;
    Ok((found, format!("{ms:.0} ({:.0})", cpu_ms() - before)))
}

/// Merges up to `count` views of some arrangements, look by look.
pub fn run(count: usize, mode: &str) -> Result<(), String> {
    println!(
        "{:>5} {:>10} {:>10}   ms (of CPU); {:>9} {:>9}  cups right, wrong",
        "views", "anew", "kept", "anew", "kept"
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
        let mut merger = Merger::default();
        for n in 1..=count {
            let wanted = [3, 10, count].contains(&n);
            let (kept, kept_ms) = timed(|| match mode {
                "anew" => Ok(None),
                _ => merger.merge(&views[..n], &options()).map(Some).map_err(|e| e.to_string()),
            })?;
            if !wanted {
                continue;
            }
            let (anew, anew_ms) = timed(|| match mode {
                "kept" => Ok(None),
                _ => merge(&views[..n], &options()).map(Some).map_err(|e| e.to_string()),
            })?;
            let score = |merged: &Option<Merged>| -> Result<String, String> {
                let Some(merged) = merged else { return Ok("-".to_owned()) };
                let percepts = judge(merged, &Descry::default())?;
                let is_right = |p: &&descry_perception::Percept| {
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
            };
            println!(
                "{n:5} {anew_ms:>10} {kept_ms:>10}                {:>9} {:>9}",
                score(&anew)?,
                score(&kept)?
            );
        }
    }
    Ok(())
}
