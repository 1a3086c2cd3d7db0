//! Poses and cameras as text: rows of numbers.

use crate::input::InputError;
use crate::recorded::settings::CameraSettings;
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Tolerance on the entries of a rotation matrix, since files may give few digits.
const ROTATION_TOLERANCE: f64 = 0.03;

/// Tolerance on the fixed entries of a camera matrix.
const CAMERA_TOLERANCE: f64 = 1e-6;

/// A pose; `None` if tracking was lost (entries that are not finite).
pub(crate) type MaybePose = Option<Isometry3<f64>>;

/// The numbers of each line that is neither empty nor a comment, with the byte offset of the line.
pub(crate) fn rows(file: &str, text: &str) -> Result<Vec<(usize, Vec<f64>)>, InputError> {
    let mut rows = Vec::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let here = start;
        start += line.len();
        let content = line.split('#').next().unwrap_or("");
        if content.trim().is_empty() {
            continue;
        }
        let mut numbers = Vec::new();
        for word in content.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty()) {
            let number = word.parse::<f64>().map_err(|_| {
                // `word` is part of `text`, so its address says where it stands.
                let byte = word.as_ptr() as usize - text.as_ptr() as usize;
                InputError::at(file, text, byte, format!("\"{word}\" is no number"), "write numbers only")
            })?;
            numbers.push(number);
        }
        rows.push((here, numbers));
    }
    Ok(rows)
}

/// Rows of a square matrix, `size` lines of `size` numbers, with the byte offset of each line.
fn matrix(file: &str, text: &str, size: usize, what: &str) -> Result<Vec<(usize, Vec<f64>)>, InputError> {
    let rows = rows(file, text)?;
    if let Some((byte, row)) = rows.iter().find(|(_, row)| row.len() != size) {
        let problem = format!("{} numbers in a line, expected {size}", row.len());
        return Err(InputError::at(file, text, *byte, problem, format!("write {what}, row by row")));
    }
    if rows.len() != size {
        let problem = format!("{} lines of numbers, expected {size}", rows.len());
        return Err(InputError::at(file, text, text.len(), problem, format!("write {what}, row by row")));
    }
    Ok(rows)
}

/// Parses a 4x4 `world_from_camera`.
pub(crate) fn matrix_pose(file: &str, text: &str) -> Result<MaybePose, InputError> {
    let rows = matrix(file, text, 4, "the 4x4 matrix world_from_camera")?;
    if rows.iter().flat_map(|(_, row)| row).any(|x| !x.is_finite()) {
        return Ok(None);
    }
    let (last_byte, last) = &rows[3];
    let expected = [0.0, 0.0, 0.0, 1.0];
    if last.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1e-3) {
        let problem = "the last line of a pose is 0 0 0 1";
        return Err(InputError::at(
            file,
            text,
            *last_byte,
            problem,
            "write the matrix row by row, in metres",
        ));
    }
    let entry = |r: usize, c: usize| rows[r].1[c];
    let linear = Matrix3::from_fn(entry);
    let translation = Translation3::new(entry(0, 3), entry(1, 3), entry(2, 3));
    let off = (linear * linear.transpose() - Matrix3::identity()).abs().max();
    if off > ROTATION_TOLERANCE || linear.determinant() < 0.0 {
        let problem = format!("the upper left 3x3 part is no rotation (off by {off:.3})");
        let mend = "world_from_camera holds a rotation without scale or mirror";
        return Err(InputError::at(file, text, rows[0].0, problem, mend));
    }
    let nearest = linear.svd(true, true);
    let rotation = match (nearest.u, nearest.v_t) {
        (Some(u), Some(v_t)) => Rotation3::from_matrix_unchecked(u * v_t),
        _ => Rotation3::from_matrix(&linear),
    };
    Ok(Some(Isometry3::from_parts(translation, UnitQuaternion::from_rotation_matrix(&rotation))))
}

/// Parses lines `tx ty tz qx qy qz qw`, each a `world_from_camera`.
pub(crate) fn listed_poses(file: &str, text: &str) -> Result<Vec<MaybePose>, InputError> {
    rows(file, text)?
        .into_iter()
        .map(|(byte, row)| {
            let &[x, y, z, qx, qy, qz, qw] = row.as_slice() else {
                let problem = format!("{} numbers in a line, expected 7", row.len());
                return Err(InputError::at(file, text, byte, problem, "write tx ty tz qx qy qz qw"));
            };
            of_seven(file, text, byte, [x, y, z, qx, qy, qz, qw])
        })
        .collect()
}

/// Pose from the numbers `tx ty tz qx qy qz qw` at a byte of a text.
pub(crate) fn of_seven(
    file: &str,
    text: &str,
    byte: usize,
    [x, y, z, qx, qy, qz, qw]: [f64; 7],
) -> Result<MaybePose, InputError> {
    if [x, y, z, qx, qy, qz, qw].iter().any(|v| !v.is_finite()) {
        return Ok(None);
    }
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    if (quaternion.norm() - 1.0).abs() > ROTATION_TOLERANCE {
        let problem = format!("the quaternion has length {:.3}, expected 1", quaternion.norm());
        return Err(InputError::at(file, text, byte, problem, "write tx ty tz qx qy qz qw"));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok(Some(Isometry3::from_parts(Vector3::new(x, y, z).into(), rotation)))
}

/// Pose at a time between two poses that are at most `gap_s` apart, or at the time of one, else `None`. Poses
/// are in order of time, seconds.
pub(crate) fn interpolated(
    poses: &[(f64, Isometry3<f64>)],
    stamp_s: f64,
    gap_s: f64,
) -> Option<Isometry3<f64>> {
    let after = poses.partition_point(|(s, _)| *s < stamp_s);
    let (later_s, later) = poses.get(after)?;
    if *later_s == stamp_s {
        return Some(*later);
    }
    let (earlier_s, earlier) = poses.get(after.checked_sub(1)?)?;
    let part = (stamp_s - earlier_s) / (later_s - earlier_s);
    (later_s - earlier_s <= gap_s).then(|| {
        let shift = earlier.translation.vector.lerp(&later.translation.vector, part);
        let half_turned = earlier.rotation.try_slerp(&later.rotation, part, 1e-9);
        Isometry3::from_parts(shift.into(), half_turned.unwrap_or(later.rotation))
    })
}

/// Parses a 3x3 camera matrix for images of a size, columns and rows.
pub(crate) fn camera_matrix(
    file: &str,
    text: &str,
    size: (usize, usize),
) -> Result<CameraSettings, InputError> {
    let rows = matrix(file, text, 3, "the 3x3 camera matrix")?;
    let entry = |r: usize, c: usize| rows[r].1[c];
    let wrong = |row: usize, problem: String| {
        Err(InputError::at(file, text, rows[row].0, problem, "write fx 0 cx / 0 fy cy / 0 0 1, in pixels"))
    };
    let camera = CameraSettings { fx: entry(0, 0), fy: entry(1, 1), cx: entry(0, 2), cy: entry(1, 2) };
    let focal = |r: usize| entry(r, r).is_finite() && entry(r, r) > 0.0;
    if let Some(r) = (0..2).find(|&r| !focal(r)) {
        return wrong(r, format!("a focal length of {}, expected pixels above zero", entry(r, r)));
    }
    for (r, c, expected) in [(0, 1, 0.0), (1, 0, 0.0), (2, 0, 0.0), (2, 1, 0.0), (2, 2, 1.0)] {
        let found = entry(r, c);
        if !(found.is_finite() && (found - expected).abs() <= CAMERA_TOLERANCE) {
            return wrong(r, format!("{found} in column {}, expected {expected}", c + 1));
        }
    }
    match camera.off_image(size) {
        Some((row, problem)) => wrong(row, problem),
        None => Ok(camera),
    }
}
