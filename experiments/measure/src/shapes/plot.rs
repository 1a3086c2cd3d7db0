//! Plots of aligned scans like Fig. 3 and 4, as SVG.

use super::draw::{Panel, page, side_by_side};
use super::lab::{INSTANCES, NAMES, Run, circled, four_legs, map_of_the_lab, object, seed_of};
use super::options;
use super::tabletop::Draws;
use super::variations::{FAR, by_icp};
use descry_perception::laser::{Alignment, align};
use std::path::Path;

/// Fig. 4: every observation of every object, one column for each object.
fn all_objects(learnt: &[Alignment]) -> String {
    const SIDE_M: f64 = 0.9;
    const SCALE: f64 = 220.0;
    let panel = |(i, alignment): (usize, &Alignment)| {
        let mut panel = Panel {
            left: SCALE * SIDE_M * (i / INSTANCES) as f64,
            top: SCALE * SIDE_M * (i % INSTANCES) as f64,
            side_m: SIDE_M,
            scale: SCALE,
            centre: alignment.model.features().centre,
            text: String::new(),
        };
        panel.scans(alignment.model.scans(), false);
        if i % INSTANCES == 0 {
            panel.title(NAMES[i / INSTANCES]);
        }
        panel
    };
    let panels: Vec<Panel> = learnt.iter().enumerate().map(panel).collect();
    page(SCALE * SIDE_M * NAMES.len() as f64, SCALE * SIDE_M * INSTANCES as f64, &panels)
}

/// Writes all plots into a folder.
pub fn write(seed: u64, learnt: &[Alignment], dir: &Path) -> Result<(), String> {
    std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let map = map_of_the_lab(&mut Draws(seed));
    let save = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    let chair = four_legs(45.0, 3.0);
    let things = [
        ("figure-3-big-chair", object(1), 1),
        ("figure-3-recycle-bin", object(0), 0),
        ("four-legs", chair, 0),
    ];
    for (name, outline, k) in things {
        let seen = circled(&outline, &Run::default(), &map, seed_of(seed, k, 0)).1.scans;
        let aligned = align(&seen, &options(0)).map_err(|e| e.to_string())?;
        let icp = by_icp(&seen, FAR);
        let rows = [("as localised", seen), ("aligned", aligned.model.scans().to_vec()), ("by ICP", icp)];
        save(&format!("{name}.svg"), side_by_side(&rows[..2], 4.2, 180.0, true))?;
        save(&format!("{name}-near.svg"), side_by_side(&rows, 1.2, 400.0, false))?;
    }
    save("figure-4.svg", all_objects(learnt))?;
    println!("plots written to {}\n", dir.display());
    Ok(())
}
