//! Simulated frames in bags of ROS 2: MCAP and SQLite.

use super::writers::Shot;
use descry_robots::nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A message in CDR, little endian.
struct Out(Vec<u8>);

impl Out {
    fn new() -> Out {
        Out(vec![0, 1, 0, 0])
    }

    fn put<const N: usize>(mut self, bytes: [u8; N]) -> Out {
        let at = (self.0.len() - 4).next_multiple_of(N) + 4;
        self.0.resize(at, 0);
        self.0.extend(bytes);
        self
    }

    fn u32(self, value: usize) -> Out {
        self.put((value as u32).to_le_bytes())
    }

    fn numbers(self, values: &[f64]) -> Out {
        values.iter().fold(self, |out, v| out.put(v.to_le_bytes()))
    }

    fn bytes(self, bytes: &[u8]) -> Out {
        let mut out = self.u32(bytes.len());
        out.0.extend(bytes);
        out
    }

    fn text(self, text: &str) -> Out {
        self.bytes(&[text.as_bytes(), &[0]].concat())
    }

    fn header(self, stamp_ns: u64, frame: &str) -> Out {
        let (s, ns) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
        self.u32(s as usize).u32(ns as usize).text(frame)
    }

    fn transform(self, stamp_ns: u64, parent: &str, child: &str, pose: &Isometry3<f64>) -> Out {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let out = self.u32(1).header(stamp_ns, parent).text(child);
        out.numbers(&[t.x, t.y, t.z, q.x, q.y, q.z, q.w])
    }
}

/// A message with its topic, type and time.
pub struct Message {
    pub topic: &'static str,
    pub kind: &'static str,
    pub stamp_ns: u64,
    pub data: Vec<u8>,
}

const TF: &str = "tf2_msgs/msg/TFMessage";

/// Depth as 16UC1 or 32FC1, the camera, and a camera on a base that moves in the map.
pub fn messages(shots: &[Shot], metres: bool) -> Vec<Message> {
    let turn = UnitQuaternion::from_euler_angles(-1.57, 0.1, -1.57);
    let base_from_camera = Isometry3::from_parts(Translation3::new(0.1, 0.0, 1.2), turn);
    let mut all = Vec::new();
    let mut add = |topic, kind, stamp_ns, out: Out| all.push(Message { topic, kind, stamp_ns, data: out.0 });
    add("/tf_static", TF, 0, Out::new().transform(0, "base_link", "camera_optical", &base_from_camera));
    for (i, shot) in shots.iter().enumerate() {
        let stamp_ns = 5_000_000_000 + i as u64 * 2_000_000_000;
        let (width, height) = shot.size;
        let c = shot.camera;
        let info =
            Out::new().header(stamp_ns, "camera_optical").u32(height).u32(width).text("plumb_bob").u32(5);
        let info = info.numbers(&[0.0; 5]).numbers(&[c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0]);
        let info = info.numbers(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).numbers(&[0.0; 12]);
        add("/camera/depth/camera_info", "sensor_msgs/msg/CameraInfo", stamp_ns, info);
        let map_from_base = shot.stated * base_from_camera.inverse();
        for stamp_ns in [stamp_ns - 100_000_000, stamp_ns + 100_000_000] {
            add("/tf", TF, stamp_ns, Out::new().transform(stamp_ns, "map", "base_link", &map_from_base));
        }
        let pixel = |d: &f32| match (metres, d.is_finite()) {
            (true, _) => d.to_le_bytes().to_vec(),
            (false, true) => ((d * 1000.0).round() as u16).to_le_bytes().to_vec(),
            (false, false) => vec![0; 2],
        };
        let pixels: Vec<u8> = shot.depth_m.iter().flat_map(pixel).collect();
        let (encoding, size) = if metres { ("32FC1", 4) } else { ("16UC1", 2) };
        let image = Out::new().header(stamp_ns, "camera_optical").u32(height).u32(width).text(encoding);
        let image = image.put([0]).u32(size * width).bytes(&pixels);
        add("/camera/depth/image_raw", "sensor_msgs/msg/Image", stamp_ns, image);
    }
    all
}

/// A record of MCAP: its kind, its length, and its content.
fn record(kind: u8, content: &[&[u8]]) -> Vec<u8> {
    let content = content.concat();
    [&[kind][..], &(content.len() as u64).to_le_bytes(), &content].concat()
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

/// Writes messages as MCAP: one half in a chunk, the other outside of chunks.
pub fn write_mcap(path: &Path, messages: &[Message]) {
    const MAGIC: &[u8] = b"\x89MCAP0\r\n";
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut parts = [Vec::new(), Vec::new()];
    let mut channels = BTreeMap::new();
    for (n, m) in messages.iter().enumerate() {
        let (next, part) = (channels.len() as u16 + 1, &mut parts[n * 2 / messages.len()]);
        let id = *channels.entry(m.topic).or_insert_with(|| {
            part.extend(record(3, &[&next.to_le_bytes(), &text(m.kind), &text("ros2msg"), &[0; 4]]));
            let ids = [next.to_le_bytes(), next.to_le_bytes()].concat();
            part.extend(record(4, &[&ids, &text(m.topic), &text("cdr"), &[0; 4]]));
            next
        });
        let stamp = m.stamp_ns.to_le_bytes();
        part.extend(record(5, &[&id.to_le_bytes(), &(n as u32).to_le_bytes(), &stamp, &stamp, &m.data]));
    }
    let [packed, plain] = parts;
    let size = (packed.len() as u64).to_le_bytes();
    let chunk = record(6, &[&[0; 16], &size, &[0; 4], &text(""), &size, &packed]);
    let end = [record(15, &[&[0; 4]]), record(2, &[&[0; 20]])].concat();
    let head = record(1, &[&text("ros2"), &text("")]);
    fs::write(path, [MAGIC, &head, &chunk, &plain, &end, MAGIC].concat()).unwrap();
}

fn write_sqlite(path: &Path, messages: &[Message]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let bag = rusqlite::Connection::open(path).unwrap();
    let tables = "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT);
                  CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);";
    bag.execute_batch(tables).unwrap();
    let mut topics = BTreeMap::new();
    for m in messages {
        let next = topics.len() as i64 + 1;
        let id = *topics.entry(m.topic).or_insert_with(|| {
            let text = "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr', '')";
            bag.execute(text, rusqlite::params![next, m.topic, m.kind]).unwrap();
            next
        });
        let text = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        bag.execute(text, rusqlite::params![id, m.stamp_ns as i64, m.data]).unwrap();
    }
}

/// A bag in MCAP, with depth in metres.
pub fn mcap(folder: &Path, shots: &[Shot]) {
    write_mcap(&folder.join("drive_0.mcap"), &messages(shots, true));
}

/// A bag in SQLite, with depth in millimetres.
pub fn sqlite(folder: &Path, shots: &[Shot]) {
    write_sqlite(&folder.join("drive_0.db3"), &messages(shots, false));
}
