//! Tests of `learning::recognition::group`.

use descry_perception::learning::recognition::feature::Feature;
use descry_perception::learning::recognition::group::*;
use nalgebra::{Isometry3, Point3, Vector3};

#[test]
fn a_thing_stands_where_single_matches_say() {
    let feature = |at: [f32; 3], normal: [f32; 3]| Feature {
        at: Point3::from(at),
        normal: Vector3::from(normal).normalize(),
    };
    let model = [
        feature([0.04, 0.0, 0.02], [1.0, 0.0, 0.1]),
        feature([0.0, 0.04, 0.05], [0.0, 1.0, 0.0]),
        feature([-0.02, 0.03, 0.09], [-0.4, 0.8, 0.0]),
        // What faces up does not say how it is turned.
        feature([0.0, 0.0, 0.1], [0.0, 0.0, 1.0]),
    ];
    // In the scene, y is down.
    let up = [Vector3::z(), -Vector3::y()];
    let upright = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let truth = Isometry3::translation(0.3, 0.1, 1.2) * upright * Isometry3::rotation(Vector3::z() * 0.7);
    // Places are a centimetre off, more than groups allow to differ.
    let off = [[0.008, 0.0, -0.004], [-0.008, 0.004, 0.0], [0.0, -0.006, 0.008], [0.0; 3]];
    let scene: Vec<Feature> = model
        .iter()
        .zip(off)
        .map(|(f, off)| Feature {
            at: (truth * f.at.cast::<f64>()).cast() + Vector3::from(off),
            normal: (truth.rotation * f.normal.cast::<f64>()).cast(),
        })
        .collect();
    let matches: Vec<Correspondence> =
        model.iter().zip(&scene).map(|(model, scene)| Correspondence { model, scene, off: 1.0 }).collect();
    let found = standing(&matches, &up, 9);
    assert_eq!(found.len(), 1);
    let pose = found[0].scene_from_model;
    assert_eq!(found[0].matches, 3);
    assert!((pose.translation.vector - truth.translation.vector).norm() < 0.015, "{pose}");
    assert!(pose.rotation.angle_to(&truth.rotation) < 0.1, "{pose}");
    assert!((pose.rotation * up[0]).angle(&up[1]) < 1e-6);
    // Two are too few.
    assert!(standing(&matches[..2], &up, 9).is_empty());
}
