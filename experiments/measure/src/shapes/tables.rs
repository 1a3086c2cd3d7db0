//! The paper's tables with our numbers.

use super::lab::{
    self, INSTANCES, NAMES, Run, circled, f_c_range, map_of_the_lab, models, named, paper, relocalised,
    rounded_with,
};
use super::tabletop::Draws;
use super::{METHODS, options};
use descry_perception::laser::{
    Alignment, FitOptions, KnownShape, RecogniseOptions, ShapeModel, Verdict, align, classes, groups,
    nearest, recognise_scan,
};
use descry_perception::nalgebra::Isometry2;

/// Mean and sample standard deviation of values.
pub fn mean_and_spread(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, (squares / (values.len() as f64 - 1.0).max(1.0)).sqrt())
}

/// Prints the alignment errors of Fig. 5, by every method.
pub fn alignment(seed: u64) {
    println!(
        "Fig. 5: 25 models; BV (m²) mean and greatest, longest exterior error (cm); the paper: under 1 cm after"
    );
    println!(
        "{:<27} {:>9} {:>8} {:>6}   {:>9} {:>9} {:>6} {:>10}",
        "", "BV before", "most", "ext", "BV after", "most", "ext", "converged"
    );
    for (method, (name, ..)) in METHODS.iter().enumerate() {
        let all = models(seed, &Run::default(), &options(method));
        let column = |of: &dyn Fn(&Alignment) -> f64| {
            let values: Vec<f64> = all.iter().map(of).collect();
            (values.iter().sum::<f64>() / values.len() as f64, values.iter().copied().fold(0.0, f64::max))
        };
        let (before, most_before) = column(&|a| a.before.boundary_m2);
        let (after, most_after) = column(&|a| a.after.boundary_m2);
        let ext = [column(&|a| a.before.exterior_m).1, column(&|a| a.after.exterior_m).1].map(|m| 100.0 * m);
        let converged = all.iter().filter(|a| a.converged).count();
        println!(
            "{name:<27} {before:>9.4} {most_before:>8.4} {:>6.2}   {after:>9.6} {most_after:>9.6} {:>6.2} {converged:>7}/25",
            ext[0], ext[1]
        );
    }
}

/// Prints Fig. 7, and recognition by features alone.
pub fn features(learnt: &[Alignment]) {
    println!("\nFig. 7: area (cm²) and perimeter (cm) of hulls, spreads; [the paper]");
    let all: Vec<_> = learnt.iter().map(|a| a.model.features()).collect();
    for (k, name) in NAMES.iter().enumerate() {
        let own = &all[k * INSTANCES..][..INSTANCES];
        let (area, area_spread) = mean_and_spread(&own.iter().map(|f| 1e4 * f.area_m2).collect::<Vec<_>>());
        let (round, round_spread) =
            mean_and_spread(&own.iter().map(|f| 1e2 * f.perimeter_m).collect::<Vec<_>>());
        let [a, sa, p, sp] = paper::FEATURES[k];
        println!(
            "{name:<12} {area:>5.0} {area_spread:>3.0} [{a:>4} {sa:>2}]   {round:>6.1} {round_spread:>4.1} [{p:>5} {sp}]"
        );
    }
    // Each instance is named by the classes of the other four.
    let right = (0..learnt.len()).filter(|&left_out| {
        let others = (0..learnt.len()).filter(|&i| i != left_out);
        let known = classes(others.map(|i| (NAMES[i / INSTANCES], &learnt[i].model)));
        nearest(&known, &all[left_out]).is_some_and(|n| n.class.name == NAMES[left_out / INSTANCES])
    });
    println!(
        "by features alone, each instance left out in turn: {} of {} right",
        right.count(),
        learnt.len()
    );
    let found = groups(&all, 6.0);
    let told: Vec<String> = found
        .iter()
        .map(|group| {
            let count = |k: usize| group.iter().filter(|&&i| i / INSTANCES == k).count();
            let parts =
                (0..NAMES.len()).filter(|&k| count(k) > 0).map(|k| format!("{} {}", count(k), NAMES[k]));
            parts.collect::<Vec<_>>().join(" + ")
        })
        .collect();
    println!("clusters without names: {}", told.join("; "));
}

/// Prints Fig. 8, and the threshold that separates all objects.
pub fn f_c(learnt: &[Alignment]) {
    println!("\nFig. 8: f_C (m²), least to greatest over all pairs of instances; [the paper]");
    let (mut same, mut other) = ((0.0_f64, 0.0_f64), (f64::INFINITY, f64::INFINITY));
    for (a, name) in NAMES.iter().enumerate() {
        print!("{name:<12}");
        for b in 0..=a {
            let [(low, high), (low_m, high_m)] = f_c_range(learnt, a, b, &FitOptions::default());
            let (paper_low, paper_high) = paper::F_C[a][b];
            print!("  {low:.4}-{high:.4} [{paper_low:.3}-{paper_high:.3}]");
            if a == b {
                same = (same.0.max(high), same.1.max(high_m));
            } else {
                other = (other.0.min(low), other.1.min(low_m));
            }
        }
        println!();
    }
    println!(
        "one threshold tells all apart: f_C {:.4} m²; the same object at most {:.4}, another at least {:.4}: a factor of {:.1}",
        (same.0 * other.0).sqrt(),
        same.0,
        other.0,
        other.0 / same.0
    );
    println!(
        "by the root of the violation a pair of scans, whatever their number: at most {:.2} mm, at least {:.2} mm",
        1e3 * same.1,
        1e3 * other.1
    );
}

/// Prints results for other outlines of the recycle-bin, whose published area and perimeter leave one
/// parameter open.
pub fn recycle_bins(seed: u64, learnt: &[Alignment]) {
    println!(
        "\nrecycle-bin and garbage-can, f_C (m²) [0.013-0.039], for other outlines with the same hull area and perimeter"
    );
    let map = map_of_the_lab(&mut Draws(seed));
    for radius_cm in [7.0, 9.0, lab::RECYCLE_RADIUS_CM, 12.5] {
        let mut all = learnt.to_vec();
        let outline = rounded_with(932.0, 113.7, radius_cm);
        for (i, alignment) in all.iter_mut().take(INSTANCES).enumerate() {
            let (_, seen) = circled(&outline, &Run::default(), &map, lab::seed_of(seed, 0, i));
            *alignment = align(&seen.scans, &options(0)).expect("the object was seen");
        }
        let [own, _] = f_c_range(&all, 0, 0, &FitOptions::default());
        let [range, _] = f_c_range(&all, 2, 0, &FitOptions::default());
        let area: Vec<f64> = all[..INSTANCES].iter().map(|a| 1e4 * a.model.features().area_m2).collect();
        let (area, spread) = mean_and_spread(&area);
        println!(
            "corners of {radius_cm:>4} cm: {:.4}-{:.4}; among themselves {:.4}-{:.4}; area {area:.0} ± {spread:.0} cm² [932 ± 39]",
            range.0, range.1, own.0, own.1
        );
    }
}

/// Prints Fig. 9, and the same for every scan of every instance on every other instance.
pub fn localisation(seed: u64, learnt: &[Alignment]) {
    println!(
        "\nFig. 9: a scan moved by 0.1 m, 0.1 m, 0.1 rad and localised: position (m), angle (rad), BV (m²), longest exterior (m); [the paper]"
    );
    let fit_options = FitOptions::default();
    let mut draws = Draws(seed);
    for (k, rows) in paper::LOCALISATION.iter().enumerate() {
        for (i, row) in rows.iter().enumerate() {
            let [canonical, instance] = [0, i + 1].map(|i| &learnt[k * INSTANCES + i].model);
            let found = relocalised(canonical, instance, (draws.next() * 100.0) as usize, &fit_options);
            let name = if i == 0 { NAMES[k] } else { "" };
            println!(
                "{name:<12} {:.3} {:.3} {:.4} {:.4}   {row:.3?}",
                found.position_m,
                found.angle_rad,
                found.fit.between.boundary_m2,
                found.fit.between.exterior_m
            );
        }
    }
    let mut all: Vec<(f64, f64, f64)> = Vec::new();
    for k in 0..NAMES.len() {
        for (i, j) in (0..INSTANCES).flat_map(|i| (0..INSTANCES).map(move |j| (i, j))).filter(|(i, j)| i != j)
        {
            let [canonical, instance] = [i, j].map(|i| &learnt[k * INSTANCES + i].model);
            for scan in 0..instance.scans().len() {
                let found = relocalised(canonical, instance, scan, &fit_options);
                all.push((found.position_m, found.angle_rad, found.fit.between.exterior_m));
            }
        }
    }
    let share = |of: &dyn Fn(&(f64, f64, f64)) -> bool| {
        100.0 * all.iter().filter(|a| of(a)).count() as f64 / all.len() as f64
    };
    let most = |of: &dyn Fn(&(f64, f64, f64)) -> f64| all.iter().map(of).fold(0.0, f64::max);
    println!(
        "all {} scans on all other models of their object: {:.1} % within 1 cm, {:.1} % within 3 cm, the farthest {:.3} m; exterior at most {:.4} m",
        all.len(),
        share(&|a| a.0 < paper::TYPICAL_M),
        share(&|a| a.0 < paper::FARTHEST_M),
        most(&|a| a.0),
        most(&|a| a.2)
    );
}

/// Prints recognition and localisation of single scans without an initial pose: each scan against all
/// models but its own.
pub fn single_scans(learnt: &[Alignment]) {
    let known = named(learnt);
    let (mut scans, mut right, mut among, mut wrong, mut missed, mut off_m) = (0, 0, 0, 0, 0, Vec::new());
    for (i, alignment) in learnt.iter().enumerate() {
        let own = NAMES[i / INSTANCES];
        let others: Vec<KnownShape> =
            known.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, shape)| shape.clone()).collect();
        for posed in alignment.model.scans() {
            let found = recognise_scan(&posed.scan, &others, &RecogniseOptions::default());
            scans += 1;
            match &found.verdict {
                Verdict::Is(name) if name == own => right += 1,
                Verdict::OneOf(names) if names.iter().any(|n| n == own) => among += 1,
                Verdict::Unknown => missed += 1,
                _ => wrong += 1,
            }
            let same = found.candidates.iter().find(|c| others[c.index].name == own);
            let centre = |model: &ShapeModel, pose: &Isometry2<f64>| pose.inverse() * model.features().centre;
            off_m.extend(same.map(|c| {
                let there = centre(&others[c.index].model, &c.fit.model_from_other);
                (there - centre(&alignment.model, &posed.model_from_laser)).norm()
            }));
        }
    }
    let within = |limit: f64| 100.0 * off_m.iter().filter(|m| **m < limit).count() as f64 / scans as f64;
    println!(
        "\none scan, no pose to start from, {scans} scans against the other 24 models: {right} named right, {among} left among several with the right one, {missed} unknown, {wrong} wrong"
    );
    println!(
        "the middle of the right object: {:.1} % within 1 cm, {:.1} % within 3 cm, {:.1} % within 10 cm",
        within(0.01),
        within(0.03),
        within(0.1)
    );
}
