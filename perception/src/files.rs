//! Clouds and depth images from bytes and to bytes, without a file system.

mod columns;
pub mod depth;
mod error;
mod las;
mod loaded;
#[doc(hidden)]
pub mod lzf;
mod npy;
pub mod pcd;
pub mod ply;
mod text;

pub use error::{FileError, Place};
pub use loaded::Loaded;

/// Reads a point cloud (PCD, PLY, NPY, LAS, or text: XYZ, CSV, PTS); the format is detected from the first bytes.
///
/// # Errors
/// If the format is none of these, or the file is damaged.
pub fn read_cloud(bytes: &[u8]) -> Result<Loaded, FileError> {
    if bytes.starts_with(b"ply") {
        return ply::read(bytes);
    }
    if bytes.starts_with(npy::MAGIC) {
        return npy::read(bytes);
    }
    if bytes.starts_with(las::MAGIC) {
        return las::read(bytes);
    }
    if text::is(bytes) {
        return text::read(bytes);
    }
    pcd::read(bytes)
}
