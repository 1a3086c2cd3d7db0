//! Downhill simplex method (Nelder and Mead 1965) with coefficients for many dimensions (Gao and Han 2012).

/// Result of the simplex search.
pub struct Found {
    /// Best point found.
    pub at: Vec<f64>,
    /// Value of the function at the best point.
    pub cost: f64,
    pub converged: bool,
    pub iterations: usize,
    pub evaluations: usize,
}

/// Size of the simplex at which it has converged, as a fraction of the initial steps.
const FINEST: f64 = 1e-4;

/// Minimises a function near the origin by the Nelder-Mead simplex with the given initial steps and about `most`
/// evaluations. Converged once the corners lie within a ten-thousandth of these steps, or their values differ by a
/// share of at most `settle`.
pub fn simplex(cost: impl Fn(&[f64]) -> f64, steps: &[f64], most: usize, settle: f64) -> Found {
    let n = steps.len();
    let mut corners: Vec<(f64, Vec<f64>)> = (0..=n)
        .map(|i| {
            let at: Vec<f64> = (0..n).map(|k| if k + 1 == i { steps[k] } else { 0.0 }).collect();
            (cost(&at), at)
        })
        .collect();
    let mut found = Found { at: Vec::new(), cost: 0.0, converged: false, iterations: 0, evaluations: n + 1 };
    let d = n.max(2) as f64;
    let (expand, contract, shrink) = (1.0 + 2.0 / d, 0.75 - 0.5 / d, 1.0 - 1.0 / d);
    loop {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.converged = settled(&corners, steps, settle);
        if found.converged || found.evaluations >= most {
            break;
        }
        found.iterations += 1;
        let middle: Vec<f64> =
            (0..n).map(|k| corners[..n].iter().map(|c| c.1[k]).sum::<f64>() / n as f64).collect();
        let mut attempt = |reach: f64| {
            let worst = &corners[n].1;
            let at: Vec<f64> = middle.iter().zip(worst).map(|(m, w)| m + reach * (m - w)).collect();
            found.evaluations += 1;
            (cost(&at), at)
        };
        let reflected = attempt(1.0);
        let (best, second, worst) = (corners[0].0, corners[n - 1].0, corners[n].0);
        let replacement = if reflected.0 < best {
            let expanded = attempt(expand);
            Some(if expanded.0 < reflected.0 { expanded } else { reflected })
        } else if reflected.0 < second {
            Some(reflected)
        } else {
            let bar = reflected.0.min(worst);
            let contracted = attempt(if reflected.0 < worst { contract } else { -contract });
            (contracted.0 < bar).then_some(contracted)
        };
        match replacement {
            Some(corner) => corners[n] = corner,
            None => {
                let best = corners[0].1.clone();
                for corner in &mut corners[1..] {
                    let at: Vec<f64> =
                        best.iter().zip(&corner.1).map(|(b, c)| b + shrink * (c - b)).collect();
                    *corner = (cost(&at), at);
                }
                found.evaluations += n;
            }
        }
    }
    (found.cost, found.at) = corners.swap_remove(0);
    found
}

fn settled(corners: &[(f64, Vec<f64>)], steps: &[f64], settle: f64) -> bool {
    let (best, worst) = (&corners[0], &corners[corners.len() - 1]);
    let near = |c: &(f64, Vec<f64>)| {
        c.1.iter().zip(&best.1).zip(steps).all(|((a, b), step)| (a - b).abs() <= FINEST * step)
    };
    worst.0 - best.0 <= settle * best.0 || corners.iter().all(near)
}
