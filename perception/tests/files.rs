//! Cloud files: round trips, files of other programs, and damaged files.

use descry_perception::files::{self, Loaded, pcd, ply};
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::{Cloud, Grid};
use proptest::prelude::*;

fn sample(organised: bool) -> Cloud {
    let points: Vec<Point3<f32>> = (0..12)
        .map(|i| Point3::new(i as f32 * 0.125, -0.3 + i as f32 * 0.001, 1.0 / (i + 1) as f32))
        .collect();
    let mut cloud = Cloud {
        colours: Some((0..12).map(|i| [i, 200, 255 - i]).collect()),
        normals: Some(vec![Vector3::new(0.0, 0.6, -0.8); 12]),
        labels: Some((0..12).map(|i| i * 1_000_003).collect()),
        grid: None,
        points,
    };
    if organised {
        cloud.grid = Some(Grid { width: 4, height: 3 });
        cloud.points[5] = Point3::new(f32::NAN, f32::NAN, f32::NAN);
    }
    cloud
}

fn same(a: &Cloud, b: &Cloud) -> bool {
    let bits = |c: &Cloud| -> Vec<[u32; 3]> {
        let bits = |v: f32| if v.is_nan() { u32::MAX } else { v.to_bits() };
        c.points.iter().map(|p| [bits(p.x), bits(p.y), bits(p.z)]).collect()
    };
    bits(a) == bits(b)
        && a.grid == b.grid
        && a.colours == b.colours
        && a.normals == b.normals
        && a.labels == b.labels
}

#[test]
fn pcd_comes_back_as_it_was() {
    for encoding in [pcd::PcdEncoding::Ascii, pcd::PcdEncoding::Binary, pcd::PcdEncoding::BinaryCompressed] {
        for organised in [false, true] {
            let cloud = sample(organised);
            let loaded = files::read_cloud(&pcd::write(&cloud, encoding)).unwrap();
            assert!(same(&loaded.cloud, &cloud), "{encoding:?} {organised}: {:?}", loaded.cloud);
            assert_eq!(loaded.notes, Vec::<String>::new());
        }
        for few in 0..4 {
            let bare = Cloud::from_points(sample(false).points[..few].to_vec());
            let loaded = files::read_cloud(&pcd::write(&bare, encoding)).unwrap();
            assert!(same(&loaded.cloud, &bare), "{encoding:?}, {few} points: {:?}", loaded.cloud);
        }
    }
}

#[test]
fn ply_comes_back_as_it_was() {
    for encoding in [ply::PlyEncoding::Ascii, ply::PlyEncoding::Binary] {
        let cloud = sample(false);
        assert!(
            same(&files::read_cloud(&ply::write(&cloud, encoding)).unwrap().cloud, &cloud),
            "{encoding:?}"
        );
    }
    let organised = sample(true);
    assert_eq!(files::read_cloud(&ply::write(&organised, ply::PlyEncoding::Binary)).unwrap().cloud.len(), 11);
}

fn read(text: &str) -> Result<Loaded, String> {
    files::read_cloud(text.as_bytes()).map_err(|e| e.to_string())
}

#[test]
fn fields_in_any_order_type_and_count() {
    let text = "# written by hand\nVERSION .5\nFIELDS label z _ y x rgb histogram\nSIZE 2 8 1 4 4 4 4\nTYPE U F U F F F F\n\
                COUNT 1 1 3 1 1 1 2\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n\
                7 3.5 0 0 0 2 1 4.2108e+06 9 9\n8 -3.5e-1 0 0 0 -2 -1 16711935 9 9\n";
    let loaded = read(text).unwrap();
    assert_eq!(loaded.cloud.points, vec![Point3::new(1.0, 2.0, 3.5), Point3::new(-1.0, -2.0, -0.35)]);
    assert_eq!(loaded.cloud.labels, Some(vec![7, 8]));
    assert_eq!(
        loaded.cloud.colours,
        Some(vec![[0x80, 0x80, 0x90], [255, 0, 255]]).map(|mut c| {
            let bits = 4.2108e+06f32.to_bits().to_be_bytes();
            c[0] = [bits[1], bits[2], bits[3]];
            c
        })
    );
    assert_eq!(loaded.notes, ["fields left out: histogram"]);
}

#[test]
fn windows_lines_old_headers_and_viewpoints() {
    let text = "COLUMNS x y z\r\nVIEWPOINT 1 2 3 0 1 0 0\r\nPOINTS 1\r\nDATA ascii\r\n1 2 3\r\n";
    let loaded = read(text).unwrap();
    assert_eq!((loaded.cloud.len(), loaded.cloud.grid), (1, None));
    assert_eq!(loaded.viewpoint.translation.vector, Vector3::new(1.0, 2.0, 3.0));
    assert!((loaded.viewpoint.rotation.angle() - std::f64::consts::PI).abs() < 1e-12);
}

#[test]
fn what_is_left_out_is_said() {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
    let loaded =
        read(&format!("{head}WIDTH 3\nHEIGHT 1\nDATA ascii\n1 2 3\nnan nan nan\ninf 0 0\n")).unwrap();
    assert_eq!(loaded.cloud.len(), 1);
    assert!(loaded.notes.iter().any(|n| n.starts_with("2 points without finite")), "{:?}", loaded.notes);
    assert!(loaded.notes.iter().any(|n| n.starts_with("1 points with infinite")), "{:?}", loaded.notes);
    let loaded = read(&format!("{head}WIDTH 2\nHEIGHT 1\nDATA ascii\n100 200 900\n110 210 1000\n")).unwrap();
    assert!(loaded.notes.iter().any(|n| n.contains("millimetres")), "{:?}", loaded.notes);
    assert_eq!(loaded.cloud.scaled(0.001).unit_warning(), None);
}

#[test]
fn no_return_may_be_written_as_the_place_of_the_sensor() {
    let rows = "DATA ascii\n0 0 0\n1 2 3\n-0 0 0\n4 5 6\n";
    let check = |head: &str, finite: usize, notes: &[&str]| {
        let loaded = read(&format!("FIELDS x y z\n{head}\n{rows}")).unwrap();
        assert_eq!((loaded.cloud.count_finite(), loaded.cloud.len()), (finite, 4), "{head}");
        assert_eq!(loaded.notes, notes, "{head}");
    };
    let note = "2 points at (0, 0, 0), where the sensor is, are taken as \"no return\"";
    check("WIDTH 2\nHEIGHT 2", 2, &[note]);
    check("WIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 0 1 0 0", 2, &[note]);
    check("WIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 1 1 0 0 0", 4, &[]);
    check("WIDTH 4\nHEIGHT 1", 4, &[]);
}

#[test]
fn what_far_points_look_like_is_said() {
    let seen: Vec<Point3<f64>> =
        (0..100).map(|i| Point3::new(f64::from(i % 10) * 0.1, f64::from(i / 10) * 0.1, 1.2)).collect();
    let check = |scale: f64, offset: Vector3<f64>, words: &[&str]| {
        let points = seen.iter().map(|p| (p * scale + offset).cast()).collect();
        let said = Cloud::from_points(points).unit_warning().unwrap_or_default();
        assert!(words.iter().all(|w| said.contains(w)) && words.is_empty() == said.is_empty(), "{said}");
    };
    let here = Vector3::zeros();
    check(1.0, here, &[]);
    check(1000.0, here, &["looks like millimetres; scale by 0.001"]);
    check(100.0, here, &["looks like centimetres; scale by 0.01"]);
    check(300.0, here, &["centimetres or millimetres"]);
    check(1.0, Vector3::new(0.0, 400.0, 0.0), &["401 m from the sensor", "at the origin"]);
    let utm = Vector3::new(691_234.5, 5_334_567.25, 520.0);
    check(1.0, utm, &["from the origin", "500.0 mm apart", "subtract an offset before writing"]);
    check(1e30, here, &["damaged", "order of bytes"]);
}

/// Checks that an error names the place, the expected content and a remedy.
fn check_error(text: &str, parts: &[&str]) {
    let error = read(text).unwrap_err();
    assert!(parts.iter().all(|p| error.contains(p)), "{error} lacks one of {parts:?}");
}

#[test]
fn broken_files_are_explained() {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\n";
    check_error("", &["line 1", "DATA"]);
    check_error("solid cube\n", &["line 1", "PCD"]);
    check_error(&format!("{head}DATA ascii\n1 2 3\n1 two 3\n"), &["line 8", "number for field y", "two"]);
    check_error(&format!("{head}DATA ascii\n1 2 3\n1 2\n"), &["line 8", "field z", "end of the line"]);
    check_error(&format!("{head}DATA ascii\n1 2 3\n1 2 3 4\n"), &["line 8", "\"4\""]);
    check_error(&format!("{head}DATA ascii\n11111 2 3\n"), &["2 lines of points", "found 1"]);
    check_error(&format!("{head}DATA binary\n1234"), &["byte", "24 bytes", "after 4", "cut"]);
    check_error(&format!("{head}POINTS 3\nDATA ascii\n"), &["line 6", "2 x 1", "3"]);
    check_error(&format!("{head}DATA zip\n"), &["line 6", "binary_compressed", "zip"]);
    check_error(
        "FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 1\nDATA ascii\n1 2\n",
        &["line 1", "a field z", "x y"],
    );
    check_error("FIELDS x y z\nSIZE 4 4\nDATA ascii\n", &["line 2", "3 values of SIZE"]);
    check_error("FIELDS x y z\nTYPE F F Q\nWIDTH 1\nDATA ascii\n", &["field z", "TYPE Q"]);
    check_error("FIELDS x y z\nWIDTH 4000000000\nHEIGHT 4000000000\nDATA binary\n", &["line 2", "POINTS"]);
    check_error("FIELDS x y z\nWIDTH 4000000000\nDATA ascii\n", &["byte", "cut"]);
    check_error(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
        &["line 3", "x, y and z"],
    );
    check_error("ply\nformat ascii 1.0\nelement vertex two\n", &["line 3", "COUNT"]);
    check_error("ply\nproperty float x\n", &["line 2", "element before"]);
    check_error("ply\nelement vertex 1\nproperty float x\nend_header\n", &["line 4", "format"]);
    check_error("ply\nformat ascii 1.0\nend_header\n", &["vertex"]);
    check_error(
        "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n",
        &["byte", "cut"],
    );
}

#[test]
fn what_the_header_does_not_declare_is_refused() {
    let head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\n";
    let cut = ["as the header declares", "POINTS, WIDTH and HEIGHT"];
    let [declares, mend] = cut;
    check_error(&format!("{head}DATA ascii\n1 2 3\n4 5 6\n7 8 9\n"), &["1 lines of points", "found 3", mend]);
    let bytes = "123456789abc".repeat(3);
    check_error(
        &format!("{head}DATA binary\n{bytes}"),
        &["1 points", declares, "24 bytes more, as 2 points"],
    );
    let mut packed = pcd::write(&sample(true), pcd::PcdEncoding::BinaryCompressed);
    packed.extend([7; 100]);
    let error = files::read_cloud(&packed).unwrap_err().to_string();
    assert!(cut.iter().all(|part| error.contains(part)) && error.contains("100 bytes more"), "{error}");
    let ply =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    check_error(&format!("{ply}end_header\n1 2 3\n4 5 6\n"), &["1 rows of element vertex", "up to 1 lines"]);
    check_error(&format!("{ply}end_header\n1 2 3 4\n"), &["line 8", "\"4\"", "every column"]);
    let binary = ply.replace("ascii", "binary_little_endian");
    check_error(&format!("{binary}end_header\n{bytes}"), &["1 rows of element vertex", "24 bytes more"]);
    let face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    check_error(&format!("{ply}{face}1 2 3\n4 5 6\n7 8 9\n"), &["line 11", "vertex_indices"]);
    let twice = "POINTS 1\nPOINTS 2\nDATA ascii\n1 2 3\n";
    check_error(&format!("{head}{twice}"), &["line 7", "one line POINTS", "line 6", "\"2\""]);
    check_error(&format!("{ply}{ply}"), &["line 7", "ply"]);
    check_error(&format!("{ply}format ascii 1.0\n"), &["line 7", "one line format"]);
    check_error(&format!("{ply}element vertex 2\n"), &["line 7", "one element of each name"]);
    let foo = "VIEWPOINT 0 0 0 foo 1 0 0 0\nDATA ascii\n1 2 3\n";
    check_error(&format!("{head}{foo}"), &["line 6", "qw qx qy qz", "foo"]);
}

#[test]
fn padding_and_empty_lines_are_nothing() {
    let head = "FIELDS x y z\nPOINTS 1\nPOINTS 1\n";
    assert_eq!(read(&format!("{head}DATA ascii\n1 2 3\n\n \n# end\n")).unwrap().cloud.len(), 1);
    assert_eq!(read(&format!("{head}DATA binary\n123456789abc\n")).unwrap().cloud.len(), 1);
    for encoding in [pcd::PcdEncoding::Binary, pcd::PcdEncoding::BinaryCompressed] {
        let mut padded = pcd::write(&sample(true), encoding);
        padded.resize(padded.len().next_multiple_of(4096), 0);
        assert!(same(&files::read_cloud(&padded).unwrap().cloud, &sample(true)), "{encoding:?}");
    }
    let mut ply = ply::write(&sample(false), ply::PlyEncoding::Binary);
    ply.extend(b"\n");
    assert_eq!(files::read_cloud(&ply).unwrap().cloud.len(), 12);
}

#[test]
fn ply_of_strangers() {
    let text = "ply\nformat ascii 1.0\ncomment made by a scanner\nelement camera 1\nproperty list uchar float k\n\
                element vertex 2\nproperty double x\nproperty double y\nproperty double z\nproperty float diffuse_red\n\
                property float diffuse_green\nproperty float diffuse_blue\nproperty uchar quality\nelement face 1\n\
                property list uchar int vertex_indices\nend_header\n2 0.5 0.5\n1 2 3 1.0 0.5 0 9\n\n4 5 6 0 0 1 9\n3 0 1 1\n";
    let loaded = read(text).unwrap();
    assert_eq!(loaded.cloud.points, vec![Point3::new(1.0, 2.0, 3.0), Point3::new(4.0, 5.0, 6.0)]);
    assert_eq!(loaded.cloud.colours, Some(vec![[255, 128, 0], [0, 0, 255]]));
    assert_eq!(loaded.notes, ["properties left out: quality"]);
    let mut big = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty short y\nproperty int z\nend_header\n".to_vec();
    big.extend(1.5f32.to_be_bytes());
    big.extend((-2i16).to_be_bytes());
    big.extend(3i32.to_be_bytes());
    assert_eq!(files::read_cloud(&big).unwrap().cloud.points, vec![Point3::new(1.5, -2.0, 3.0)]);
}

/// Checks that a file's cloud has these points; returns it with its notes.
fn check_points(bytes: &[u8], points: &[[f32; 3]]) -> Loaded {
    let loaded = files::read_cloud(bytes).unwrap_or_else(|e| panic!("{e}"));
    let found: Vec<[f32; 3]> = loaded.cloud.points.iter().map(|p| (*p).into()).collect();
    assert_eq!(found, points, "{:?}", String::from_utf8_lossy(bytes));
    loaded
}

#[test]
fn a_row_of_ply_may_go_on_in_the_next_line() {
    let head =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
    let text = format!("{head}end_header\n1 2\n3\n\n4\n5\n6\n");
    check_points(text.as_bytes(), &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    check_error(
        &format!("{head}end_header\n1.5 2.5 3.5\n4.5 5.5\n"),
        &["line 9", "2 rows of element vertex", "cut"],
    );
}

#[test]
fn the_camera_of_ply_is_the_viewpoint() {
    let vertices = "element vertex 4\nproperty double x\nproperty double y\nproperty double z\n";
    let names = ["view_p", "x_axis", "y_axis", "z_axis"]
        .map(|n| ["x", "y", "z"].map(|a| format!("property float {n}{a}\n")));
    let names = names.as_flattened().concat() + "property int viewportx\nproperty int viewporty\n";
    let read_at = |offset: f64, turn: &str| {
        let point = |k: u8| format!("{} 2 3\n", offset + f64::from(k));
        let points: String = (1..5).map(point).collect();
        let row = format!("{} 0 9 {turn} 2 2\n", offset + 5.0);
        read(&format!("ply\nformat ascii 1.0\n{vertices}element camera 1\n{names}end_header\n{points}{row}"))
            .unwrap()
    };
    let loaded = read_at(0.0, "0 -1 0 1 0 0 0 0 1");
    assert_eq!(loaded.viewpoint.translation.vector, Vector3::new(5.0, 0.0, 9.0));
    assert!((loaded.viewpoint * Vector3::x() - Vector3::y()).norm() < 1e-6);
    assert_eq!(loaded.cloud.grid, Some(Grid { width: 2, height: 2 }));
    let far = read_at(500_000.0, "1 0 0 0 1 0 0 0 1");
    let apart = far.viewpoint.translation.vector - far.cloud.points[0].coords.cast();
    assert!(
        (apart - Vector3::new(4.0, -2.0, 6.0)).norm() < 1e-6,
        "the sensor moves with its points: {apart}"
    );
    assert_eq!(read_at(0.0, "2 0 0 0 1 0 0 0 1").viewpoint.translation.vector, Vector3::zeros());
}

#[test]
fn clouds_of_lines_of_numbers() {
    let two = [[1.0, 2.0, 3.0], [4.0, 5.0, -0.5]];
    check_points(b"1 2 3\n4\t5 -5e-1\n", &two);
    check_points(b"# by hand\n\n1, 2, 3\n4,5,-0.5\n", &two);
    let named = check_points(b"id;Z;\"X\";y;label\n9;3;1;2;7\n9;-0.5;4;5;8\n", &two);
    assert_eq!(
        (named.cloud.labels, &named.notes[..]),
        (Some(vec![7, 8]), &["1 of 5 columns are left out".to_string()][..])
    );
    let compare = check_points(b"//X Y Z R G B\n1 2 3 255 0 7\n4 5 -0.5 1 2 3\n", &two);
    assert_eq!(compare.cloud.colours, Some(vec![[255, 0, 7], [1, 2, 3]]));
    let pts = check_points(b"2\n1 2 3 -800 255 0 7\n4 5 -0.5 12 1 2 3\n", &two);
    assert_eq!(pts.cloud.colours, Some(vec![[255, 0, 7], [1, 2, 3]]));
    let normals = check_points(b"1 2 3 0 0 1\n4 5 -0.5 0.6 0 -0.8\n", &two);
    assert_eq!((normals.cloud.normals.map(|n| n.len()), normals.cloud.colours), (Some(2), None));
    let utm = check_points(
        b"691234.25 5334567.5 520\n691235.25 5334567.5 521\n",
        &[[-0.75, -0.5, -1.0], [0.25, -0.5, 0.0]],
    );
    assert!(utm.notes[0].contains("recentred: 691235 5334568 521"), "{:?}", utm.notes);
    check_error("1 2 3\n4 5\n", &["line 2", "3 numbers", "found 2"]);
    check_error("1 2 3\n4 five 6\n", &["line 2", "a number", "five"]);
    check_error("3\n1 2 3\n", &["line 1", "3 points", "found 1"]);
    check_error("x,y,z\n1,2\n", &["line 2", "3 numbers, as there are names"]);
}

/// Array in NumPy's file format.
fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes(), data].concat()
}

#[test]
fn clouds_of_arrays() {
    let bytes: Vec<u8> = [1.0f32, 2.0, 3.0, 4.0, 5.0, -0.5].iter().flat_map(|v| v.to_le_bytes()).collect();
    check_points(&npy("<f4", "(2, 3)", &bytes), &[[1.0, 2.0, 3.0], [4.0, 5.0, -0.5]]);
    let big: Vec<u8> = (0..12).flat_map(|v| f64::from(v).to_be_bytes()).collect();
    let image = check_points(
        &npy(">f8", "(2, 2, 3)", &big),
        &[[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0], [9.0, 10.0, 11.0]],
    );
    assert_eq!(image.cloud.grid, Some(Grid { width: 2, height: 2 }));
    let error = |bytes: &[u8]| files::read_cloud(bytes).unwrap_err().to_string();
    assert!(error(&npy("<f4", "(9000000000000000000, 3)", &bytes)).contains("cut"));
    assert!(error(&npy("<f4", "(3, 3)", &bytes)).contains("cut"));
    assert!(error(&npy("<f4", "(6,)", &bytes)).contains("(points, 3)"));
    assert!(error(&npy("<c8", "(2, 3)", &bytes)).contains("<f4 or <f8"));
    assert!(error(b"\x93NUMPY\x01\x00\xff\xff{").contains("header of NPY"));
}

/// LAS file with one coloured point.
fn las(format: u8, count: u32) -> Vec<u8> {
    let mut bytes = vec![0; 227];
    bytes[..4].copy_from_slice(b"LASF");
    (bytes[24], bytes[25], bytes[104]) = (1, 2, format);
    bytes[96..100].copy_from_slice(&227u32.to_le_bytes());
    bytes[105..107].copy_from_slice(&26u16.to_le_bytes());
    bytes[107..111].copy_from_slice(&count.to_le_bytes());
    for k in 0..3 {
        bytes[131 + 8 * k..139 + 8 * k].copy_from_slice(&0.01f64.to_le_bytes());
        bytes[155 + 8 * k..163 + 8 * k].copy_from_slice(&(300_000.0 * k as f64).to_le_bytes());
    }
    for k in [125i32, -250, 375] {
        bytes.extend(k.to_le_bytes());
    }
    bytes.resize(227 + 20, 0);
    [256u16 * 9, 0, 65535].iter().for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}

#[test]
fn clouds_of_surveys() {
    let loaded = files::read_cloud(&las(2, 1)).unwrap();
    assert_eq!((loaded.cloud.len(), loaded.cloud.colours), (1, Some(vec![[9, 0, 255]])));
    assert!(
        (loaded.cloud.points[0] - Point3::new(0.25, -0.5, -0.25)).norm() < 1e-5,
        "{:?}",
        loaded.cloud.points
    );
    assert!(loaded.notes[0].contains("recentred: 1 299998 600004"), "{:?}", loaded.notes);
    let error = |bytes: &[u8]| files::read_cloud(bytes).unwrap_err().to_string();
    assert!(error(&las(2, 4_000_000_000)).contains("cut"));
    assert!(error(&las(2 | 0x80, 1)).contains("laszip"));
    assert!(error(&las(63, 1)).contains("point format"));
    assert!(error(&las(2, 1)[..200]).contains("header of LAS"));
}

fn files_of_all_kinds() -> Vec<Vec<u8>> {
    let cloud = sample(true);
    vec![
        b"4\n1 2 3 0.5 255 0 7\n4 5 6 1 1 2 3\n7 8 9 2 1 2 3\n1 2 3 0 9 9 9\n".to_vec(),
        b"x,y,z,label\n1,2,3,4\n4,5,6,7\n".to_vec(),
        npy("<f4", "(2, 2, 3)", &[7; 48]),
        las(2, 1),
        pcd::write(&cloud, pcd::PcdEncoding::Ascii),
        pcd::write(&cloud, pcd::PcdEncoding::Binary),
        pcd::write(&cloud, pcd::PcdEncoding::BinaryCompressed),
        ply::write(&cloud, ply::PlyEncoding::Ascii),
        ply::write(&cloud, ply::PlyEncoding::Binary),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn damaged_files_never_panic(
        kind in 0usize..9,
        hits in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 0..6),
        keep in 0.0f64..1.2,
    ) {
        let mut bytes = files_of_all_kinds().swap_remove(kind);
        for (at, value) in hits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        bytes.truncate((bytes.len() as f64 * keep) as usize);
        if let Ok(loaded) = files::read_cloud(&bytes) {
            prop_assert!(loaded.cloud.check().is_ok());
            prop_assert!(loaded.cloud.grid.is_some() || loaded.cloud.count_finite() == loaded.cloud.len());
        }
    }

    #[test]
    fn digits_in_headers_never_panic(numbers in proptest::collection::vec(any::<u64>(), 4), kind in 0usize..3) {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| numbers[i] >> (numbers[(i + 1) % 4] % 64));
        let data = ["ascii", "binary", "binary_compressed"][kind];
        let text = format!("FIELDS x y z w\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 {a}\nWIDTH {b}\nHEIGHT {c}\nPOINTS {d}\nDATA {data}\n0123456789abcdef");
        let _ = files::read_cloud(text.as_bytes());
        let text = format!("FIELDS x y z w\nSIZE 4 4 4 4\nCOUNT 1 1 1 {a}\nWIDTH {b}\nDATA {data}\n0123456789abcdef");
        let _ = files::read_cloud(text.as_bytes());
    }
}
