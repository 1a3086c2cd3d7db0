//! Sensor noise from a few views of a table.

use crate::tabletop::device::{Device, KINECT};
use crate::tabletop::{Draws, Thing, on_ring};
use descry_perception::nalgebra::{Unit, Vector3};
use descry_perception::noise::{KINECT as ASSUMED, Residuals, Sensor};
use descry_perception::surface::{SurfaceOptions, find_surface};
use descry_perception::{Intrinsics, Visibility};

/// Sensor estimated from four views of a table with a box.
fn fitted(device: &Device) -> Sensor {
    let things = [Thing::Block { x: 0.3, y: 0.1, half: [0.1, 0.06], height: 0.25, turn_rad: 0.4 }];
    let mut draws = Draws(5);
    let mut residuals = Residuals::default();
    for k in 0..4 {
        let pose = on_ring(0.4 + 1.5 * f64::from(k), 1.0 + 0.2 * f64::from(k), 1.4);
        let view = device.look(&things, &pose, &pose, &mut draws);
        let seen = Visibility::from_views(std::slice::from_ref(&view));
        let options =
            SurfaceOptions { up: Some(Unit::new_normalize(Vector3::z())), ..SurfaceOptions::default() };
        let surface = find_surface(&view.cloud.transformed(&pose), &seen, &options).expect("a table");
        residuals.add(&seen.maps[0], &surface);
    }
    residuals.fit(&ASSUMED)
}

/// Standard deviation of a depth of 1.4 m along the ray: noise, steps of disparity, and rays that
/// wander on a table seen at about 50 degrees.
fn true_sigma_m(device: &Device) -> f64 {
    let z: f64 = 1.4;
    let noise = device.axial[0] + device.axial[1] * (z - 0.4).powi(2);
    let step = device.base_m.map_or(0.0, |base| z * z / (8.0 * device.camera.fx * base * 12.0_f64.sqrt()));
    noise.hypot(step).hypot(device.lateral_px * z / device.camera.fx)
}

#[test]
fn the_noise_of_each_device_comes_back() {
    let coarse = Intrinsics { width: 320, height: 240, fx: 285.0, fy: 285.0, cx: 159.5, cy: 119.5 };
    let flight = Intrinsics { width: 512, height: 424, fx: 366.0, fy: 366.0, cx: 255.5, cy: 211.5 };
    let cases = [
        ("the assumed one", KINECT),
        ("twice its noise", Device { axial: KINECT.axial.map(|a| 2.0 * a), lateral_px: 0.8, ..KINECT }),
        ("holes", Device { holes: 0.1, ..KINECT }),
        ("320 x 240", Device { camera: coarse, ..KINECT }),
        ("time of flight", Device { camera: flight, axial: [0.003, 0.001], base_m: None, ..KINECT }),
    ];
    for (name, device) in cases {
        let (found, truth) = (fitted(&device).frontal_sigma_m(1.4), true_sigma_m(&device));
        assert!((found / truth - 1.0).abs() < 0.3, "{name}: {found:.5} m, in truth {truth:.5} m");
    }
}

#[test]
fn without_a_face_in_view_the_assumed_sensor_stays() {
    assert_eq!(Residuals::default().fit(&ASSUMED), ASSUMED);
}
