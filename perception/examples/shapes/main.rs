//! probe
#[path = "../../tests/lab/mod.rs"]
mod lab;
#[path = "../../tests/tabletop/mod.rs"]
mod tabletop;
use descry_perception::laser::*;
use lab::*;
use tabletop::Draws;
fn main() {
    let run = Run::default();
    let map = map_of_the_lab(&mut Draws(99));
    for solver in [Solver::LeastSquares, Solver::Simplex] {
        let options = SolverOptions { solver, ..Default::default() };
        let mut models = vec![]; let (mut worst, mut bv, mut time, mut conv) = (0.0f64, 0.0f64, std::time::Duration::ZERO, 0);
        for c in 0..5 {
            for k in 0..5 {
                let mut d = Draws(1000 + c as u64 * 10 + k);
                let lab = Lab::with(&object(c), &mut d);
                let scans = lab.circle(&run, &mut d);
                let seen = seen(&lab, &scans, &map, &run, &mut d);
                let t = std::time::Instant::now();
                let a = align(&seen, &options).unwrap();
                let el = t.elapsed();
                let f = a.model.features();
                if std::env::var("V").is_ok() { println!(
                    "{:12} n {}/{} before {:.4} {:.3} after {:.6} ext {:.4} int {:.4} conv {} it {} ev {} area {:.0} per {:.1} {:?}",
                    NAMES[c], seen.len(), scans.len(), a.before.boundary_m2, a.before.exterior_m, a.after.boundary_m2, a.after.exterior_m, a.after.interior_m,
                    a.converged, a.iterations, a.evaluations, f.area_m2 * 1e4, f.perimeter_m * 100.0, el
                ); }
                worst = worst.max(a.after.exterior_m); bv = bv.max(a.after.boundary_m2); time += el; conv += a.converged as usize;
                models.push(a.model);
            }
        }
        println!("{solver:?} worst ext {worst:.5} bv {bv:.6} {:?} conv {conv}", time / 25);
        for c in 0..5 { let m: f64 = (0..5).map(|k| models[c*5+k].features().area_m2*1e4).sum::<f64>()/5.0;
          let sd = ((0..5).map(|k| (models[c*5+k].features().area_m2*1e4-m).powi(2)).sum::<f64>()/4.0).sqrt();
          let p: f64 = (0..5).map(|k| models[c*5+k].features().perimeter_m*1e2).sum::<f64>()/5.0;
          let sp = ((0..5).map(|k| (models[c*5+k].features().perimeter_m*1e2-p).powi(2)).sum::<f64>()/4.0).sqrt();
          println!("{:12} {m:.0} {sd:.0}   {p:.1} {sp:.1}", NAMES[c]); }
        for a in 0..5 {
            for b in 0..=a {
                let mut lo = f64::MAX; let mut hi = 0.0f64; let mut lp = f64::MAX; let mut hp = 0.0f64;
                let t = std::time::Instant::now(); let mut n = 0;
                for i in 0..5 { for j in 0..5 { if a == b && j >= i { continue; }
                    let f = fit(&models[a*5+i], &models[b*5+j], &FitOptions { solver: options, ..Default::default() });
                    lo = lo.min(f.f_c_m2); hi = hi.max(f.f_c_m2); lp = lp.min(f.between.per_pair_m()); hp = hp.max(f.between.per_pair_m()); n += 1;
                }}
                println!("{:12} {:12} {:.4}-{:.4}  per pair {:.4}-{:.4} {:?}", NAMES[a], NAMES[b], lo, hi, lp, hp, t.elapsed() / n);
            }
        }
    }
}
