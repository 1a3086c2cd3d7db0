//! Simulated depth cameras: the assumed one, and others.

use super::{Draws, Thing, nearest};
use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::{Intrinsics, View};

/// The errors of a depth camera.
#[derive(Clone, Copy, Debug)]
pub struct Device {
    pub camera: Intrinsics,
    /// Axial standard deviation at 0.4 m, metres, and its growth with the squared depth beyond.
    pub axial: [f64; 2],
    /// Spread across the ray, pixels.
    pub lateral_px: f64,
    /// Baseline to the projector, metres, for disparity in eighths of a pixel. `None`: time of
    /// flight, with a common periodic distance error and mixed pixels at depth edges.
    pub base_m: Option<f64>,
    /// Share of the returns that are lost, in patches.
    pub holes: f64,
}

/// Camera of paper 004, with the noise of Nguyen et al.
pub const KINECT: Device = Device {
    camera: Intrinsics { width: 640, height: 480, fx: 589.0, fy: 609.0, cx: 319.5, cy: 239.5 },
    axial: [0.0012, 0.0019],
    lateral_px: 0.4,
    base_m: Some(0.075),
    holes: 0.0,
};

impl Device {
    /// View from the true pose, labelled with the stated pose.
    pub fn look(
        &self,
        things: &[Thing],
        truth: &Isometry3<f64>,
        stated: &Isometry3<f64>,
        draws: &mut Draws,
    ) -> View {
        let hit = |eye: &Point3<f64>, ray: &Vector3<f64>| nearest(things, eye, ray).map(|z| (z, 0));
        self.see(hit, truth, stated, draws).0
    }

    /// View rendered by `hit`, which gives the end of a ray from the eye and its label.
    pub(super) fn see(
        &self,
        hit: impl Fn(&Point3<f64>, &Vector3<f64>) -> Option<(f64, u32)>,
        truth: &Isometry3<f64>,
        stated: &Isometry3<f64>,
        draws: &mut Draws,
    ) -> (View, Vec<u32>) {
        let eye = Point3::from(truth.translation.vector);
        let camera = self.camera;
        let mut depths = vec![f32::NAN; camera.width * camera.height];
        let mut said = vec![0; depths.len()];
        for (i, (depth, said)) in depths.iter_mut().zip(&mut said).enumerate() {
            let (u, v) = ((i % camera.width) as f64, (i / camera.width) as f64);
            let mut ray = || {
                // The ray wanders by less than a pixel: noise across it, and frayed edges.
                let (du, dv) = (self.lateral_px * draws.normal(), self.lateral_px * draws.normal());
                truth.rotation * camera.unproject(u + du, v + dv, 1.0).coords
            };
            let Some((mut z, what)) = hit(&eye, &ray()) else { continue };
            *said = what;
            if self.base_m.is_none() {
                let beside = hit(&eye, &ray()).map_or(z, |(z, _)| z);
                z = 0.5 * (z + beside);
                // A few millimetres in waves of decimetres, as cameras of this kind have them after calibration.
                z += 0.004 * (std::f64::consts::TAU * z / 0.3).sin();
            }
            let sigma = self.axial[0] + self.axial[1] * (z - 0.4) * (z - 0.4);
            let noisy = z + sigma * draws.normal();
            *depth = match self.base_m {
                Some(base) => {
                    let disparity = (8.0 * camera.fx * base / noisy).round() / 8.0;
                    (camera.fx * base / disparity) as f32
                }
                None => noisy as f32,
            };
        }
        if self.holes > 0.0 {
            self.lose(&mut depths, truth, draws);
        }
        let view = View {
            stamp_ns: 0,
            cloud: camera.cloud_from_depth(&depths).expect("the camera is sound"),
            intrinsics: Some(camera),
            world_from_camera: *stated,
            pose_sigma_m: 0.03,
            pose_sigma_rad: 0.035,
        };
        (view, said)
    }

    /// Removes the returns most likely to be lost: in patches, on steep faces, at depth edges, and
    /// on dark spots that are dark from all sides.
    fn lose(&self, depths: &mut [f32], truth: &Isometry3<f64>, draws: &mut Draws) {
        const PATCH_PX: usize = 10;
        let (width, height) = (self.camera.width, self.camera.height);
        let columns = width / PATCH_PX + 2;
        let patches: Vec<f64> = (0..columns * (height / PATCH_PX + 2)).map(|_| draws.normal()).collect();
        let patch = |u: usize, v: usize| {
            let (i, j) = (u / PATCH_PX, v / PATCH_PX);
            let [a, b] = [u, v].map(|p| (p % PATCH_PX) as f64 / PATCH_PX as f64);
            let at = |i: usize, j: usize| patches[j * columns + i];
            (1.0 - b) * ((1.0 - a) * at(i, j) + a * at(i + 1, j))
                + b * ((1.0 - a) * at(i, j + 1) + a * at(i + 1, j + 1))
        };
        let scores: Vec<f64> = (0..depths.len())
            .map(|pixel| {
                let (u, v) = (pixel % width, pixel / width);
                let z = f64::from(depths[pixel]);
                if !z.is_finite() {
                    return f64::NEG_INFINITY;
                }
                // Depth over three pixels to each side: how much more than a level face of a table it changes.
                let at = |u: usize, v: usize| f64::from(depths[v.min(height - 1) * width + u.min(width - 1)]);
                let steps =
                    [at(u.saturating_sub(3), v) - at(u + 3, v), at(u, v.saturating_sub(3)) - at(u, v + 3)];
                let steep =
                    steps.map(|s| if s.is_finite() { s.abs() * self.camera.fx / (6.0 * z) } else { 0.0 });
                let steep = (steep[0].max(steep[1]) - 1.5).clamp(0.0, 2.0);
                patch(u, v) + steep + 1.5 * dark(&(truth * self.camera.unproject(u as f64, v as f64, z)))
            })
            .collect();
        let mut sorted: Vec<f64> = scores.iter().copied().filter(|s| s.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let Some(&limit) = sorted.get((sorted.len() as f64 * (1.0 - self.holes)) as usize) else { return };
        for (depth, _) in depths.iter_mut().zip(scores).filter(|(_, score)| *score >= limit) {
            *depth = f32::NAN;
        }
    }
}

/// 1 in one of eight 4-cm cubes of the world, else 0.
fn dark(p: &Point3<f64>) -> f64 {
    let cell = |k: usize| {
        ((p[k] / 0.04 + 0.3).floor() as i64 as u64).wrapping_mul([0x9E37_79B9, 0x85EB_CA6B, 0xC2B2_AE35][k])
    };
    if Draws(cell(0) ^ cell(1) ^ cell(2)).next() < 0.125 { 1.0 } else { 0.0 }
}
