//! Volume, centre and inertia of the meshes that draw a robot's links.
//!
//! | module    | holds                                                      |
//! | --------- | ---------------------------------------------------------- |
//! | `stl`     | triangles of an STL file, in text or binary                |
//! | `dae`     | triangles of a COLLADA file                                |
//! | `hull`    | the convex hull of points                                  |
//! | `parts`   | the shells of a closed mesh, all turned outwards           |
//! | `solid`   | the body within triangles, and how far they are closed     |

mod dae;
mod hull;
mod parts;
mod solid;
mod stl;
mod weld;

use nalgebra::Vector3;

pub(crate) use hull::extent;
pub use solid::{Outline, Solid};

/// A corner of a triangle, m.
pub type Point = Vector3<f64>;
/// Corners of a triangle, counter-clockwise as seen from outside.
pub type Triangle = [Point; 3];

/// Why a mesh gives no body.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// The file ends before its triangles do.
    #[error(
        "is cut off: has {found} bytes, and its {triangles} triangles take {needed}: fetch it again"
    )]
    Truncated {
        /// Size of the file, bytes.
        found: usize,
        /// Number of triangles by its head.
        triangles: u32,
        /// Size of a file with so many, bytes.
        needed: usize,
    },
    /// The file is neither STL nor COLLADA.
    #[error(
        "is no STL and no COLLADA (DAE) file: convert it to STL, for example with MeshLab or Blender"
    )]
    OtherFile,
    /// The pointer of a large-file store in place of the file.
    #[error("is a pointer of Git LFS in place of the mesh: fetch the mesh with `git lfs pull`")]
    Pointer,
    /// The text of an STL file cannot be read.
    #[error("is no STL file: {0}")]
    Stl(String),
    /// The XML of a COLLADA file cannot be read.
    #[error("is no COLLADA file that can be read: {0}")]
    Collada(String),
    /// A coordinate is NaN or infinite.
    #[error("triangle {0} has a coordinate that is not finite: export the mesh again")]
    NotFinite(usize),
    /// There is no triangle.
    #[error("has no triangles: export the mesh again")]
    Empty,
    /// The triangles lie in one plane, or in one point.
    #[error(
        "is flat, without a volume: name a mesh of the whole link, or give the link an <inertial>"
    )]
    Flat,
}

/// Reads the triangles of an STL or COLLADA file, in the unit of the file (COLLADA: m).
///
/// # Errors
/// The file is of another kind, is damaged, or has no triangles.
pub fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let triangles = if bytes.starts_with(b"version https://git-lfs") {
        return Err(MeshError::Pointer);
    } else if text.starts_with(b"<") {
        dae::read(text)?
    } else {
        stl::read(bytes)?
    };
    let is_finite = |triangle: &Triangle| triangle.iter().flatten().all(|own| own.is_finite());
    match triangles.iter().position(|triangle| !is_finite(triangle)) {
        Some(bad) => Err(MeshError::NotFinite(bad + 1)),
        None if triangles.is_empty() => Err(MeshError::Empty),
        None => Ok(triangles),
    }
}
