//! Tests of `scans`.

use descry_memory::document::BlobInfo;
use descry_memory::scans::*;
use descry_perception::laser::Scan;
use nalgebra::Isometry2;

#[test]
fn a_sweep_comes_back_and_an_uneven_one_is_refused() {
    let pose = Isometry2::new(nalgebra::Vector2::new(1.0, 2.0), 0.3);
    let scan = |angles_rad: Vec<f64>| Scan {
        ranges_m: [1.25, f64::INFINITY, f64::NAN, 0.0].into_iter().cycle().take(angles_rad.len()).collect(),
        angles_rad,
        map_from_laser: pose,
    };
    let check = |angles_rad: Vec<f64>, fits: bool| {
        let scan = scan(angles_rad);
        let Ok(blob) = encode(&scan) else { return assert!(!fits, "{:?}", scan.angles_rad) };
        let info =
            BlobInfo { name: blob.name, form: blob.form, bytes: blob.data.len() as u64, layout: blob.layout };
        let back = decode(&info, &blob.data, pose).unwrap();
        let bits = |s: &Scan| s.ranges_m.iter().map(|r| r.to_bits()).collect::<Vec<_>>();
        assert!(fits && bits(&back) == bits(&scan) && back.map_from_laser == pose);
        assert!(back.angles_rad.iter().zip(&scan.angles_rad).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(decode(&info, &blob.data[1..], pose).is_err());
    };
    check((-90..=90).map(|d| f64::from(d).to_radians()).collect(), true);
    check(vec![0.5], true);
    check(vec![0.0, 0.1, 0.3], false);
    check(vec![], false);
    check(vec![0.1, 0.0], false);
}
