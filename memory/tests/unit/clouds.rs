//! Tests of `clouds`.

use descry_memory::clouds::*;
use descry_memory::document::BlobInfo;
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::{Cloud, Grid, Intrinsics};

#[test]
fn a_cloud_comes_back_bit_for_bit() {
    let points = vec![
        Point3::new(1.0, -0.0, f32::MIN_POSITIVE / 2.0),
        Point3::new(f32::from_bits(0x7fc0_1234), f32::INFINITY, f32::NAN),
    ];
    let bare = Cloud { points, grid: Some(Grid { width: 2, height: 1 }), ..Cloud::default() };
    let colours = Some(vec![[1, 2, 3], [255, 0, 7]]);
    let normals = Some(vec![Vector3::new(0.0, 0.6, 0.8), Vector3::new(f32::NAN, 0.0, 1.0)]);
    let labels = Some(vec![7, u32::MAX]);
    let cases = [
        bare.clone(),
        Cloud::default(),
        Cloud { colours: colours.clone(), ..bare.clone() },
        Cloud { labels: labels.clone(), ..bare.clone() },
        Cloud { colours, normals, labels, ..bare },
    ];
    let bits = |c: &Cloud| pack(c, 32);
    let camera = Intrinsics { width: 2, height: 1, fx: 0.1 + 0.2, fy: 1.0, cx: 0.5, cy: 0.0 };
    let sensing = Sensing { intrinsics: Some(camera), pose_sigma_m: 0.03, pose_sigma_rad: 1.0 / 3.0 };
    for cloud in cases {
        let blob = encode(&cloud, &sensing);
        let text = blob.layout.to_string();
        let layout = serde_json::from_str(&text).unwrap();
        let info = BlobInfo { name: blob.name, form: blob.form, bytes: blob.data.len() as u64, layout };
        let (back, sensed) = decode(&info, &blob.data).unwrap();
        assert_eq!((bits(&back), back.grid, sensed), (bits(&cloud), cloud.grid, sensing));
        assert_eq!(back.normals.is_some(), cloud.normals.is_some());
        if !cloud.is_empty() {
            assert!(decode(&info, &blob.data[1..]).is_err());
        }
    }
}
