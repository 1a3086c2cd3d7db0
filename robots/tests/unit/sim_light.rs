//! Tests of `sim::light`.

use descry_perception::Intrinsics;
use descry_robots::sim::frame::Frame;
use descry_robots::sim::light::Light;

/// Mean colour of a grey patch under a light.
fn lit(light: &Light, cosine: f32, seed: u64, frame_number: u64) -> [f64; 3] {
    let (width, height) = (20, 20);
    let pixels = width * height;
    let mut frame = Frame {
        intrinsics: Intrinsics { width, height, fx: 20.0, fy: 20.0, cx: 10.0, cy: 10.0 },
        stamp_ns: 0,
        depth_m: vec![1.0; pixels],
        cosine: vec![cosine; pixels],
        label: vec![3; pixels],
        colour: vec![[120; 3]; pixels],
    };
    light.fall_on(&mut frame, seed, frame_number);
    [0, 1, 2].map(|k| frame.colour.iter().map(|c| f64::from(c[k])).sum::<f64>() / pixels as f64)
}

#[test]
fn light_is_drawn_by_the_seed() {
    let none = Light { gain: (1.0, 1.0), cast: 0.0, gloss: 0.0, noise: 0.0 };
    assert_eq!(lit(&none, 0.5, 1, 1), [120.0; 3], "as stated");
    let [r, g, b] = lit(&Light { gain: (0.5, 0.5), ..none }, 0.5, 1, 1);
    assert!(r < 100.0 && r == g && g == b, "dim light keeps the hue");
    let cast = Light { cast: 0.2, ..none };
    let [one, other] = [1, 2].map(|seed| lit(&cast, 0.5, seed, 1));
    assert!((one[0] - other[0]).abs() > 3.0 && one[1] == other[1], "{one:?} {other:?}");
    assert_eq!(one, lit(&cast, 0.5, 1, 9), "the cast of a scene is the same in all frames");
    let gloss = Light { gloss: 0.8, ..none };
    assert!(
        lit(&gloss, 1.0, 1, 1)[0] > 200.0 && lit(&gloss, 0.5, 1, 1)[0] < 121.0,
        "highlights face the camera"
    );
    let noise = Light { noise: 5.0, ..none };
    assert_ne!(lit(&noise, 0.5, 1, 1), lit(&noise, 0.5, 1, 2));
}
