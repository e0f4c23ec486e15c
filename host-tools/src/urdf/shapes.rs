//! The bodies of links by the shapes that the file has for them, at a density of 1.
//!
//! Meshes for collisions are closed more often than those for drawings: they are taken where a link has some.

use std::f64::consts::PI;
use std::io::Read;
use std::path::{Path, PathBuf};

use flexid_pipeline::input;
use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};

use super::body::Body;
use super::document::{Form, Link, Shape};
use super::error::UrdfError;
use crate::mesh::{self, Outline, Solid, Triangle};

/// Largest mesh that is read, bytes: ten times those of published robots.
const LARGEST: u64 = 256 << 20;

/// The shapes of a link as one body.
pub(super) struct Drawn {
    /// The body at a density of 1 kg/m³, in the frame of the link.
    pub(super) body: Body,
    /// Diagonal of the largest shape, m.
    pub(super) size: f64,
    /// The shapes in words.
    pub(super) named: String,
    /// Warnings about them, one sentence each.
    pub(super) warnings: Vec<String>,
}

/// The body of a link, whose meshes lie at paths relative to the `folder` of the file. `None` if it has no shape, as a frame.
///
/// # Errors
/// A mesh is not there, cannot be read, or has no volume.
pub(super) fn of_link(link: &Link, folder: &Path) -> Result<Option<Drawn>, UrdfError> {
    let has_mesh =
        |shapes: &&Vec<Shape>| shapes.iter().any(|own| matches!(own.form, Form::Mesh { .. }));
    let all = || link.shapes.iter();
    let Some(shapes) = all().find(has_mesh).or_else(|| all().find(|own| !own.is_empty())) else {
        return Ok(None);
    };
    let mut drawn =
        Drawn { body: Body::default(), size: 0.0, named: String::new(), warnings: Vec::new() };
    for Shape { origin, form } in shapes {
        let (solid, size, named) = match form {
            Form::Mesh { file, scale } => {
                let path = find(file, folder).map_err(|mend| UrdfError::NoMesh {
                    link: link.name.clone(),
                    file: file.clone(),
                    mend,
                })?;
                let fault =
                    |fault| UrdfError::Mesh { link: link.name.clone(), file: path.clone(), fault };
                let no_file =
                    |mend| UrdfError::NoMesh { link: link.name.clone(), file: file.clone(), mend };
                let bytes = bytes(&path).map_err(no_file)?;
                let triangles: Vec<Triangle> = mesh::read(&bytes).map_err(fault)?;
                let by = Vector3::from(*scale);
                let triangles: Vec<Triangle> = triangles
                    .iter()
                    .map(|own| own.map(|corner| corner.component_mul(&by)))
                    .collect();
                let (solid, outline) = Solid::of_mesh(&triangles).map_err(fault)?;
                let (lower, upper) = mesh::extent(triangles.iter().flatten());
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                let (kind, why) = match outline {
                    Outline::Closed => ("closed", None),
                    Outline::Open => ("convex hull", Some("is not closed")),
                    Outline::Nested => {
                        ("convex hull", Some("has closed parts that hold one another"))
                    }
                };
                drawn.warnings.extend(why.map(|why| {
                    format!(
                        "the mesh {name} of link '{}' {why}: its convex hull is taken",
                        link.name
                    )
                }));
                (solid, (upper - lower).norm(), format!("{name} ({kind})"))
            }
            Form::Box(size) => (cuboid(*size), Vector3::from(*size).norm(), "box".to_owned()),
            Form::Cylinder { radius, length } => {
                (cylinder(*radius, *length), length.hypot(2.0 * radius), "cylinder".to_owned())
            }
            Form::Sphere { radius } => (ball(*radius), 2.0 * radius, "sphere".to_owned()),
        };
        // NaN is no volume.
        if !(solid.volume > 0.0 && solid.volume.is_finite()) {
            return Err(UrdfError::Shape(link.name.clone()));
        }
        let centre = origin * Isometry3::from(Translation3::from(solid.centre));
        drawn.body.add(&Body::new(solid.volume, &centre, &solid.inertia));
        drawn.size = drawn.size.max(size);
        drawn.named = [drawn.named.as_str(), &named]
            .into_iter()
            .filter(|own| !own.is_empty())
            .collect::<Vec<_>>()
            .join(" + ");
    }
    Ok(Some(drawn))
}

fn of_moments(volume: f64, moments: [f64; 3]) -> Solid {
    Solid {
        volume,
        centre: Vector3::zeros(),
        inertia: Matrix3::from_diagonal(&moments.into()) * volume,
    }
}

/// A volume of sizes that are all positive, or NaN.
fn volume(factor: f64, sizes: &[f64]) -> f64 {
    if sizes.iter().all(|own| *own > 0.0) {
        factor * sizes.iter().product::<f64>()
    } else {
        f64::NAN
    }
}

fn cuboid([x, y, z]: [f64; 3]) -> Solid {
    let moment = |a: f64, b: f64| (a * a + b * b) / 12.0;
    of_moments(volume(1.0, &[x, y, z]), [moment(y, z), moment(x, z), moment(x, y)])
}

fn cylinder(radius: f64, length: f64) -> Solid {
    let across = radius * radius / 4.0 + length * length / 12.0;
    of_moments(volume(PI, &[radius, radius, length]), [across, across, radius * radius / 2.0])
}

fn ball(radius: f64) -> Solid {
    of_moments(volume(4.0 / 3.0 * PI, &[radius; 3]), [0.4 * radius * radius; 3])
}

/// The path of a mesh that a file in `folder` names: `package://NAME/…` below a folder NAME, which is the file's own, one above it or beside
/// one of these; `file://…`; or a path relative to the file. The error says where it was looked for, and the mend.
fn find(file: &str, folder: &Path) -> Result<PathBuf, String> {
    let package = ["package://", "model://"].iter().find_map(|scheme| file.strip_prefix(scheme));
    let Some(package) = package else {
        let path = folder.join(file.strip_prefix("file://").unwrap_or(file));
        return if path.is_file() {
            Ok(path)
        } else {
            Err(format!("{} is not there: put the mesh there, or correct filename", path.display()))
        };
    };
    let (name, rest) = package.split_once('/').unwrap_or((package, ""));
    let from = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let from = from.canonicalize().unwrap_or_else(|_| from.to_path_buf());
    let places = from.ancestors().flat_map(|above| {
        let own = above.file_name().is_some_and(|own| own == name).then(|| above.join(rest));
        own.into_iter().chain([above.join(package)])
    });
    let found = places.into_iter().find(|path| path.is_file());
    found.ok_or_else(|| {
        format!("no folder {name} with {rest} is in {} or above it: put the package's folder beside the URDF file", from.display())
    })
}

/// The bytes of a regular file.
fn bytes(path: &Path) -> Result<Vec<u8>, String> {
    let unreadable = |error: std::io::Error| input::unreadable(path, &error).to_string();
    let Some(file) = input::open_regular(path).map_err(unreadable)? else {
        return Err(format!("{} is a pipe or a device: name a regular file", path.display()));
    };
    let mut bytes = Vec::new();
    file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST {
        return Err(format!("{} is larger than 256 MiB: name a simpler mesh", path.display()));
    }
    Ok(bytes)
}
