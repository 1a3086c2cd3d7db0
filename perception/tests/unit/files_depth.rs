//! Tests of `files::depth`.

use descry_perception::files::depth::*;

#[test]
fn a_pgm_of_millimetres() {
    let mut file = b"P5\n3 1\n65535\n".to_vec();
    file.extend([0x04, 0xD2, 0, 0, 0xFF, 0xFF]);
    let image = read(&file, 0.001).unwrap();
    assert_eq!((image.width, image.height), (3, 1));
    assert!((image.depths_m[0] - 1.234).abs() < 1e-6);
    assert!(image.depths_m[1].is_nan() && image.depths_m[2].is_nan());
}

#[test]
fn eight_bits_are_no_depth() {
    let error = read(b"P5\n1 1\n255\n\x07", 0.001).unwrap_err().to_string();
    assert!(error.contains("16 bits"), "{error}");
    assert!(read(b"rubbish", 0.001).is_err());
}
