//! Small synthetic recordings.

use descry_robots::image::{ImageBuffer, Luma, Rgb, RgbImage};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Size of a frame, pixels.
pub const SIZE: (u32, u32) = (16, 12);
/// Depth of pixel (column, row) of frame `k`, millimetres; the first pixel has no return, the second an overflow.
pub fn depth_mm(k: usize, column: u32, row: u32) -> u16 {
    match (column, row) {
        (0, 0) => 0,
        (1, 0) => u16::MAX,
        _ => (1000 + 100 * k as u32 + 10 * column + row) as u16,
    }
}

fn write_depth(path: &Path, k: usize) {
    let image: ImageBuffer<Luma<u16>, Vec<u16>> =
        ImageBuffer::from_fn(SIZE.0, SIZE.1, |u, v| Luma([depth_mm(k, u, v)]));
    if path.extension().is_some_and(|ending| ending == "pgm") {
        let mut bytes = format!("P5\n{} {}\n65535\n", SIZE.0, SIZE.1).into_bytes();
        image.pixels().for_each(|pixel| bytes.extend(pixel.0[0].to_be_bytes()));
        fs::write(path, bytes).unwrap();
    } else {
        image.save(path).unwrap();
    }
}

fn write(path: &Path, text: &str) {
    fs::write(path, text).unwrap();
}

/// Three frames as `NAME.depth.png` with 4x4 poses, the second with colour.
pub fn side_by_side() -> TempDir {
    let folder = TempDir::new().unwrap();
    let path = |name: String| folder.path().join(name);
    write(&path("camera-intrinsics.txt".into()), "20.0 0.0 8.0\n0.0 21.0 6.0\n0.0 0.0 1.0\n");
    for (k, number) in [9, 10, 100].into_iter().enumerate() {
        write_depth(&path(format!("frame-{number}.depth.png")), k);
        let pose = format!("0 0 1 {k}.5\n-1 0 0 0.25\n0 -1 0 1.2\n0 0 0 1\n");
        write(&path(format!("frame-{number}.pose.txt")), &pose);
    }
    let colour = RgbImage::from_fn(SIZE.0, SIZE.1, |u, v| Rgb([u as u8, v as u8, 7]));
    colour.save(path("frame-10.color.png".into())).unwrap();
    folder
}

/// Three frames as `depth/NAME.pgm` with one list of poses and a `recording.toml`.
pub fn listed() -> TempDir {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("depth")).unwrap();
    fs::create_dir(path("color")).unwrap();
    for (k, number) in [2, 10, 1].into_iter().enumerate() {
        write_depth(&path(&format!("depth/{number}.pgm")), k);
        let colour = RgbImage::from_fn(SIZE.0, SIZE.1, |u, _| Rgb([u as u8, 0, number as u8]));
        colour.save(path(&format!("color/{number}.png"))).unwrap();
    }
    write(&path("pose.txt"), "0 0 0 0 0 0 1\n1 0 0 0 0 0.7071068 0.7071068\n# the last\n\n2 0 0 0 0 0 -1\n");
    let settings =
        "start = \"2\"\nregistered = true\nup = [0, 0, 2]\n[camera]\nfx = 20\nfy = 21\ncx = 8\ncy = 6\n";
    write(&path("recording.toml"), settings);
    folder
}
