//! Clouds with garbage bytes: an answer or a refusal in bounded time and memory, never a panic.

use descry_perception::files::read_cloud;
use descry_perception::segment::{SceneOptions, segment};
use descry_perception::surface::SurfaceError;
use descry_perception::{Cloud, Visibility};
use nalgebra::Point3;
use proptest::prelude::*;

/// Coordinate with arbitrary bits, mostly as of a table.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![3 => -0.5_f32..0.5, 1 => any::<u32>().prop_map(f32::from_bits)]
}

/// A binary PLY file that announces any number of rows of any properties, with any bytes behind.
fn file() -> impl Strategy<Value = Vec<u8>> {
    let name = prop::sample::select(vec!["x", "y", "z", "red", "nx", "label", "other"]);
    let kind = prop::sample::select(vec!["float", "double", "uchar", "list uchar int", "list uint float"]);
    let property = (kind, name).prop_map(|(kind, name)| format!("property {kind} {name}\n"));
    let form = prop::sample::select(vec!["ascii", "binary_little_endian", "binary_big_endian"]);
    let count = prop_oneof![0_u32..40, any::<u32>()];
    let body = prop::collection::vec(any::<u8>(), 0..400);
    (form, count, prop::collection::vec(property, 0..6), body).prop_map(|(form, count, properties, body)| {
        let head =
            format!("ply\nformat {form} 1.0\nelement vertex {count}\n{}end_header\n", properties.concat());
        [head.into_bytes(), body].concat()
    })
}

/// A PCD file with any sizes and counts.
fn pcd() -> impl Strategy<Value = Vec<u8>> {
    let form = prop::sample::select(vec!["ascii", "binary", "binary_compressed"]);
    let count = || prop_oneof![0_u32..40, any::<u32>()];
    let body = prop::collection::vec(any::<u8>(), 0..400);
    (form, count(), count(), count(), 0_u32..5000, body).prop_map(|(form, width, height, points, each, body)| {
        let head = format!(
            "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 {each}\nWIDTH {width}\nHEIGHT {height}\nPOINTS {points}\nDATA {form}\n"
        );
        [head.into_bytes(), body].concat()
    })
}

fn check(points: Vec<Point3<f32>>) -> Result<(), TestCaseError> {
    let cloud = Cloud::from_points(points);
    let seen = Visibility::from_viewpoints(&cloud, &[nalgebra::Point3::origin()]);
    if let Ok(scene) = segment(&cloud, &seen, &SceneOptions::default()) {
        prop_assert!(scene.surface.hull.iter().all(|p| p.iter().all(|c| c.is_finite())));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_bits_as_coordinates_are_answered(
        points in prop::collection::vec([coordinate(), coordinate(), coordinate()], 0..400)
    ) {
        check(points.into_iter().map(Point3::from).collect())?;
    }

    #[test]
    fn any_header_is_read_or_refused(bytes in prop_oneof![file(), pcd()]) {
        if let Ok(loaded) = read_cloud(&bytes) {
            prop_assert!(loaded.cloud.len() <= bytes.len());
        }
    }
}

#[test]
fn a_cloud_of_damaged_coordinates_is_refused_with_the_reason() {
    let at = |i: u32| f32::from_bits(0x7000_0000 + i.wrapping_mul(2_654_435_761) % 0x0f00_0000);
    let points = (0..3000).map(|i| Point3::new(at(3 * i), -at(3 * i + 1), at(3 * i + 2))).collect();
    let cloud = Cloud::from_points(points);
    let seen = Visibility::from_viewpoints(&cloud, &[nalgebra::Point3::origin()]);
    let found = segment(&cloud, &seen, &SceneOptions::default()).map(|scene| scene.segments.len());
    assert!(matches!(found, Err(SurfaceError::TooFar { found: 3000, far: 3000 })), "{found:?}");
}
