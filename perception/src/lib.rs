//! From views to percepts, models and maps.
//!
//! ```
//! use descry_perception::nalgebra::Point3;
//! use descry_perception::recognise::Descry;
//! use descry_perception::segment::{SceneOptions, segment};
//! use descry_perception::{Cloud, ObjectModel, Recogniser, Visibility};
//!
//! // A table of 1 m by .8 m, and the side of a tin of 8 cm that turns to the camera.
//! let table = (0..200).flat_map(|i| (0..160).map(move |j| [0.005 * i as f32 - 0.5, 0.005 * j as f32 - 0.4, 0.72]));
//! let tin = (0..60).flat_map(|i| (0..60).map(move |j| {
//!     let angle = 3.1416 + 3.1416 * (i as f32 / 60.0 - 0.5);
//!     [0.04 * angle.cos(), 0.04 * angle.sin(), 0.72 + 0.002 * j as f32]
//! }));
//! let points = table.chain(tin).map(Point3::from).collect();
//! let cloud = Cloud { points, ..Cloud::default() };
//!
//! let seen = Visibility::from_viewpoints(&cloud, &[Point3::new(-1.4, 0.0, 1.4)]);
//! let scene = segment(&cloud, &seen, &SceneOptions::default())?;
//! assert!((0.6..0.9).contains(&scene.surface.area_m2), "{} m²", scene.surface.area_m2);
//! let models: [ObjectModel; 0] = []; // what is known; nothing is: so all that stands there is unknown
//! let percepts = Descry::default().recognise(&scene, &seen, &models);
//! assert_eq!(percepts.len(), 1);
//! assert_eq!(percepts[0].label, None);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod calibration;
pub mod camera;
pub mod cloud;
pub mod cluster;
#[doc(hidden)]
pub mod draw;
pub mod files;
pub mod hull;
pub mod laser;
#[doc(hidden)]
pub mod lattice;
pub mod learning;
pub mod locate;
pub mod mapping;
pub mod merge;
pub mod neighbours;
pub mod noise;
pub mod normals;
pub mod occupancy;
pub mod outliers;
#[doc(hidden)]
pub mod outline;
pub mod picture;
pub mod plane;
#[doc(hidden)]
pub mod pool;
pub mod recognise;
pub mod register;
#[doc(hidden)]
pub mod round;
#[doc(hidden)]
pub mod scale;
pub mod segment;
#[doc(hidden)]
pub mod spread;
pub mod surface;
pub mod view;
pub mod visibility;
pub mod voxel;

pub use camera::{CameraError, Intrinsics};
pub use cloud::{Cloud, CloudError, Grid};
pub use hull::Hull;
pub use merge::{MergeError, MergeOptions, Merged, ViewFit};
pub use nalgebra;
pub use neighbours::{Neighbour, Neighbours};
pub use plane::Plane;
pub use recognise::{Evidence, ObjectModel, Percept, Recogniser, Sighting, Stance};
pub use segment::{Scene, Segment};
pub use surface::Surface;
pub use view::View;
pub use visibility::Visibility;
