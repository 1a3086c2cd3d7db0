//! Sweeps of the front laser in a CARMEN log: `FLASER n range … x y theta …`, metres and radians, where x, y,
//! theta is the laser's pose.

use descry_perception::laser::Scan;
use descry_perception::nalgebra::{Isometry2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// Range from which a SICK reading means no return, metres.
const NOTHING_M: f64 = 80.0;

/// Reads all sweeps of a log.
pub fn read(path: &Path) -> Result<Vec<Scan>, String> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let lines = (1..).zip(text.lines()).filter(|(_, line)| line.starts_with("FLASER "));
    let scans: Vec<Scan> = lines
        .map(|(n, line)| scan(line).map_err(|why| format!("{}:{n}: {why}", path.display())))
        .collect::<Result<_, _>>()?;
    match scans.is_empty() {
        true => Err(format!("{}: no line begins with FLASER: give a log in CARMEN's format", path.display())),
        false => Ok(scans),
    }
}

fn scan(line: &str) -> Result<Scan, String> {
    let mut fields = line.split_whitespace().skip(1);
    let readings: usize = fields
        .next()
        .and_then(|n| n.parse().ok())
        .filter(|n| (2..=100_000).contains(n))
        .ok_or("expected a number of readings after FLASER")?;
    let mut number = |what: &str| {
        let field = fields.next().ok_or(format!("the line ends before {what}"))?;
        field.parse::<f64>().map_err(|_| format!("{field:?} is no number: expected {what}"))
    };
    let told: Vec<f64> = (0..readings).map(|_| number("a range")).collect::<Result<_, _>>()?;
    let [x_m, y_m, yaw_rad] = [number("x")?, number("y")?, number("theta")?];
    // 181 readings include both ends of half a turn; 180 leave out the last.
    let step_rad = PI / if readings % 2 == 1 { readings - 1 } else { readings } as f64;
    let scan = Scan {
        angles_rad: (0..readings).map(|i| step_rad * i as f64 - FRAC_PI_2).collect(),
        ranges_m: told.iter().map(|r| if *r >= NOTHING_M { f64::INFINITY } else { *r }).collect(),
        map_from_laser: Isometry2::new(Vector2::new(x_m, y_m), yaw_rad),
    };
    scan.check().map_err(|why| why.to_string())?;
    Ok(scan)
}
