//! Tests of `noise`.

use descry_perception::noise::*;

#[test]
fn grows_with_depth_and_angle_and_ends() {
    let axial = |z, degrees: f64| axial_sigma_m(z, degrees.to_radians());
    let lateral_m = |z, angle| KINECT.lateral_sigma_m(z, angle, 525.0);
    assert!((axial(0.4, 0.0).unwrap() - 0.0012).abs() < 1e-12);
    assert!(axial(2.0, 0.0) > axial(1.0, 0.0) && axial(1.0, 80.0) > axial(1.0, 20.0));
    assert_eq!((axial(1.0, 86.0), lateral_m(1.0, 1.5)), (None, None));
    assert!((f64::from(frontal_sigma_m(1.7)) - axial(1.7, 0.0).unwrap()).abs() < 1e-8);
    assert!((lateral_m(1.0, 0.0).unwrap() - 0.8 / 525.0).abs() < 1e-12);
}
