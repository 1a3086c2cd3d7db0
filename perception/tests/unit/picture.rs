//! Tests of `picture`.

use descry_perception::cloud::Cloud;
use descry_perception::picture::*;
use nalgebra::Point3;

fn options() -> PictureOptions {
    PictureOptions {
        width: 40,
        height: 30,
        eye: Point3::new(0.0, -2.0, 0.0),
        target: Point3::origin(),
        ..Default::default()
    }
}

#[test]
fn a_point_shows_where_it_is_in_its_colour() {
    let cloud = Cloud::from_points(vec![Point3::origin(), Point3::new(f32::NAN, 0.0, 0.0)]);
    let bytes = png(&cloud, &[3, 0], &options()).expect("a sound view");
    let image = image::load_from_memory(&bytes).expect("a PNG").to_rgb8();
    let green = |x: u32, y: u32| {
        let [red, green, _] = image.get_pixel(x, y).0;
        green > 100 && green > red
    };
    // The middle falls between pixels: which side it rounds to does not matter.
    let shown: Vec<(u32, u32)> =
        (0..40).flat_map(|x| (0..30).map(move |y| (x, y))).filter(|&(x, y)| green(x, y)).collect();
    assert_eq!(shown.len(), 1, "{shown:?}");
    assert!((19..=20).contains(&shown[0].0) && (14..=15).contains(&shown[0].1), "{shown:?}");
}

#[test]
fn what_gives_no_picture_is_said() {
    let cloud = Cloud::from_points(vec![Point3::origin()]);
    assert!(matches!(png(&cloud, &[], &options()), Err(PictureError::Labels { labels: 0, points: 1 })));
    let blind = PictureOptions { eye: Point3::origin(), ..options() };
    assert!(matches!(png(&cloud, &[0], &blind), Err(PictureError::View { .. })));
}
