//! Good inputs of every kind, read from the tree or made here.

use std::fs;
use std::path::{Path, PathBuf};

use descry_memory::{Blob, Draft, Durability, Form, LocalOptions, LocalStore, stores::Store};
use descry_perception::cloud::Cloud;
use descry_perception::files::{pcd, ply};
use descry_perception::nalgebra::Point3;

use super::judges::FILE;

/// Files of a folder of the tree, sorted, with those of its folders.
fn below(folder: &str) -> Vec<PathBuf> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            match entry.path().is_dir() {
                true => walk(&entry.path(), found),
                false => found.push(entry.path()),
            }
        }
    }
    let mut found = Vec::new();
    walk(&root().join(folder), &mut found);
    found.sort();
    found
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn with_end(folder: &str, end: &str) -> Vec<PathBuf> {
    below(folder).into_iter().filter(|path| path.extension().is_some_and(|e| e == end)).collect()
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

/// Several files as one input.
fn joined(files: &[(String, String)]) -> Vec<u8> {
    files.iter().map(|(name, text)| format!("{FILE}{name}\n{text}")).collect::<String>().into_bytes()
}

/// Domains with the problem beside them; small ones.
pub fn pddl() -> Vec<Vec<u8>> {
    let all = ["planner/tests/data", "planner/tests/broken", "docs/cookbook", "cli/tests/data", "domains"];
    let files: Vec<PathBuf> = all.into_iter().flat_map(|folder| with_end(folder, "pddl")).collect();
    let is_problem = |path: &&PathBuf| text(path).contains("(problem");
    let domains = files.iter().filter(|path| !is_problem(path));
    let pair = |domain: &PathBuf| {
        let beside = files.iter().filter(is_problem).find(|problem| problem.parent() == domain.parent());
        let problem = beside.map(|path| text(path)).unwrap_or_default();
        joined(&[("domain.pddl".into(), text(domain)), ("problem.pddl".into(), problem)])
    };
    domains.map(pair).filter(|input| input.len() < 12_000).collect()
}

/// Folders of domains, the built-in ones and those of the cookbook.
pub fn domains() -> Vec<Vec<u8>> {
    let of = |config: PathBuf| {
        let folder = config.parent().expect("a file lies in a folder").to_path_buf();
        let inside = below(&folder.display().to_string());
        let named = inside.iter().filter_map(|path| {
            let name = path.strip_prefix(&folder).ok()?.display().to_string();
            let is_text = name.ends_with(".toml") || name.ends_with(".pddl");
            is_text.then(|| (name, text(path)))
        });
        joined(&named.collect::<Vec<_>>())
    };
    let mut configs = with_end("domains", "toml");
    configs.extend(with_end("docs/cookbook", "toml"));
    configs.retain(|path| path.file_name().is_some_and(|name| name == "domain.toml"));
    configs.into_iter().map(of).collect()
}

/// Scenes of the built-in domains.
pub fn scenes() -> Vec<Vec<u8>> {
    let mut all = with_end("domains", "toml");
    all.extend(with_end("robots/tests/scenes", "toml"));
    all.retain(|path| path.parent().is_some_and(|folder| folder.ends_with("scenes")));
    all.into_iter().map(|path| text(&path).into_bytes()).collect()
}

/// Sentences that the tests know.
pub fn phrases() -> Vec<Vec<u8>> {
    let said = text(&root().join("domains/tests/phrases.toml"));
    let quoted = said.lines().filter_map(|line| line.strip_prefix("say = ")?.trim().trim_matches('"').into());
    quoted.map(|said: &str| said.as_bytes().to_vec()).collect()
}

fn points() -> Vec<Point3<f32>> {
    (0..40).map(|n| Point3::new(n as f32 * 0.01, (n % 7) as f32 * 0.02, 0.7)).collect()
}

/// A cloud in each form.
pub fn clouds() -> Vec<Vec<u8>> {
    let cloud = Cloud { points: points(), ..Cloud::default() };
    let lines = |between: &str, head: &str| {
        let line = |p: &Point3<f32>| format!("{}{between}{}{between}{}\n", p.x, p.y, p.z);
        (head.to_string() + &points().iter().map(line).collect::<String>()).into_bytes()
    };
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (40, 3), }";
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend_from_slice(&(118_u16).to_le_bytes());
    npy.extend_from_slice(format!("{header:<117}\n").as_bytes());
    npy.extend(points().iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f32::to_le_bytes));
    let mut all = vec![npy, lines(" ", ""), lines(",", "x,y,z\n"), lines(" ", "40\n")];
    for form in [pcd::PcdEncoding::Ascii, pcd::PcdEncoding::Binary, pcd::PcdEncoding::BinaryCompressed] {
        all.push(pcd::write(&cloud, form));
    }
    for form in [ply::PlyEncoding::Ascii, ply::PlyEncoding::Binary] {
        all.push(ply::write(&cloud, form));
    }
    all
}

/// A depth image as PNG and as PGM.
pub fn depths() -> Vec<Vec<u8>> {
    let mut pgm = b"P5\n8 6\n65535\n".to_vec();
    pgm.extend((0..48_u16).flat_map(|n| (700 + n).to_be_bytes()));
    let pngs = with_end("robots/tests", "png").into_iter().filter_map(|path| fs::read(path).ok());
    pngs.filter(|bytes| bytes.len() < 20_000).take(4).chain([pgm]).collect()
}

/// A segment of a closed record, and of one whose process was killed.
pub fn records() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder can be made");
    let place = folder.path().join("run");
    let options = LocalOptions { durability: Durability::Process, ..LocalOptions::default() };
    let store = LocalStore::create(&place, "", options).expect("a record can be made");
    for n in 0..3_i64 {
        let mut draft = Draft::new("scan", n * 1000);
        draft.meta.body = serde_json::json!({ "n": n });
        let data = vec![n as u8; 300];
        let (name, layout) = ("data".into(), serde_json::Value::Null);
        draft.blobs.push(Blob { name, form: Form::Bytes, layout, data: data.into() });
        store.append(&[draft]).expect("it is written");
    }
    let segment = place.join("segments/00000001.mcap");
    let killed = fs::read(&segment).expect("it is there");
    drop(store);
    vec![killed, fs::read(&segment).expect("it is there")]
}

/// Messages of a body, from its hello to its answers.
pub fn bodies() -> Vec<Vec<u8>> {
    let hello = r#"{"hello": {"protocol": 1, "name": "fuzzed", "simulated": true, "now_ns": 0, "pose_sigma_m": 0.03, "pose_sigma_rad": 0.03, "base": {"footprint": {"disc": {"radius_m": 0.25}}, "linear_m_s": 0.4, "angular_rad_s": 0.8}, "camera": {"width": 4, "height": 3, "fx": 4, "fy": 4, "cx": 1.5, "cy": 1, "range_m": [0.5, 6]}, "head": {"base_from_head": [0, 0, 1.4], "pan_limit_rad": 2.6, "tilt_down_rad": 1.2, "tilt_up_rad": 0.8}, "map": {"resolution_m": 0.5, "origin_m": [-2.5, -2.5], "width": 10, "height": 10}, "surfaces": [{"name": "table", "outline_m": [[1, 1], [2, 1], [2, 2], [1, 2]], "height_m": 0.72}]}, "bytes": 100}"#;
    let still = r#"{"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}"#;
    let mut said = format!("{hello}\n").into_bytes();
    said.extend([0; 100]);
    let answers = [
        r#"{"id": 1, "now_ns": 1000, "accepted": {}}"#,
        r#"{"id": 1, "now_ns": 1000, "done": {"map_from_base": STILL, "sigma_m": 0.03, "sigma_rad": 0.03}}"#,
        r#"{"id": 2, "now_ns": 2000, "accepted": {}}"#,
        r#"{"id": 2, "now_ns": 9000, "feedback": {"fraction": 0.5, "distance_m": 0.5}}"#,
        r#"{"id": 2, "now_ns": 90000, "done": {"map_from_base": STILL, "distance_m": 1.0}}"#,
        r#"{"id": 3, "now_ns": 99000, "done": {"miss_rad": 0.001}}"#,
        r#"{"id": 4, "now_ns": 100000, "done": {"map_from_base": STILL, "base_from_camera": STILL}, "bytes": 24}"#,
    ];
    for answer in answers {
        said.extend(format!("{}\n", answer.replace("STILL", still)).into_bytes());
    }
    said.extend([1; 24]);
    vec![said]
}
