//! The links and joints of a URDF document, as far as the import uses them. It looks at no other element or attribute.

use flexid_pipeline::input;
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Error, Node, ParsingOptions};

use super::error::UrdfError;

/// All links and joints, in the order of the file.
pub(crate) struct Robot {
    pub(crate) name: String,
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<Joint>,
}

pub(crate) struct Link {
    pub(crate) name: String,
    /// `None` without `<inertial>`.
    pub(crate) inertial: Option<Inertial>,
    /// Shapes for collisions, then those for drawings. Empty where they are not asked for.
    pub(super) shapes: [Vec<Shape>; 2],
}

/// A body in the frame of a link.
pub(super) struct Shape {
    /// Pose of the shape in the frame of the link.
    pub(super) origin: Isometry3<f64>,
    pub(super) form: Form,
}

/// The form of a body about its own origin; lengths in m.
pub(super) enum Form {
    /// A file, and what its coordinates are multiplied by.
    Mesh {
        file: String,
        scale: [f64; 3],
    },
    Box([f64; 3]),
    /// Along z.
    Cylinder {
        radius: f64,
        length: f64,
    },
    Sphere {
        radius: f64,
    },
}

pub(crate) struct Inertial {
    /// Mass, kg.
    pub(crate) mass: f64,
    /// Pose of the centre of mass in the frame of the link.
    pub(crate) centre: Isometry3<f64>,
    /// Inertia about the centre of mass, along the axes of `centre`, kg m².
    pub(crate) inertia: Matrix3<f64>,
}

pub(crate) struct Joint {
    pub(crate) name: String,
    /// Type of the joint, in the file's words: `revolute`, `fixed`…
    pub(crate) kind: String,
    /// Name of the link before.
    pub(crate) parent: String,
    /// Name of the link that it carries.
    pub(crate) child: String,
    /// Pose of the joint in the frame of the link before.
    pub(crate) origin: Isometry3<f64>,
    /// Axis of the drive, of any length.
    pub(crate) axis: Vector3<f64>,
    /// Lower and upper limit, rad or m. `None` without `<limit>`.
    pub(crate) limits: Option<[f64; 2]>,
    /// The joint that it follows.
    pub(crate) leader: Option<String>,
}

/// The kind of a file in XML that has no other.
const XML: &str = "an XML file";

impl Robot {
    /// Reads the text of a URDF file, with the shapes of its links or without them.
    pub(super) fn read(text: &str, shapes: Shapes) -> Result<Self, UrdfError> {
        let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
        let is_other = |own: &&str| !own.starts_with("a URDF") && *own != XML;
        let other = || input::seems(text).filter(is_other);
        let document = Document::parse_with_options(text, options).map_err(|error| {
            match (error, other()) {
                (Error::UnknownNamespace(prefix, _), _) if prefix == "xacro" => UrdfError::Xacro,
                (_, Some(own)) => UrdfError::OtherFile(own),
                (error, None) => UrdfError::Syntax(error.to_string()),
            }
        })?;
        let root = document.root_element();
        if root.tag_name().name() != "robot" {
            return Err(UrdfError::OtherFile(other().unwrap_or(XML)));
        }
        // An expanded file may still declare the name space, and name its elements in comments.
        let is_of_xacro =
            |node: Node| node.tag_name().namespace().is_some_and(|space| space.ends_with("xacro"));
        if document.descendants().any(is_of_xacro) {
            return Err(UrdfError::Xacro);
        }
        // Version 1.2 of URDF takes a limit that is left out as none, those before as 0.
        let version: Option<f64> =
            root.attribute("version").and_then(|own| own.trim().parse().ok());
        let unstated = if version.is_some_and(|own| own >= 1.2) { f64::INFINITY } else { 0.0 };
        let links = children(root, "link").map(|node| Link::read(node, shapes));
        let joints = children(root, "joint").map(|node| Joint::read(node, unstated));
        Ok(Self {
            name: root.attribute("name").unwrap_or_default().to_owned(),
            links: links.collect::<Result<_, _>>()?,
            joints: joints.collect::<Result<_, _>>()?,
        })
    }
}

/// The use of the shapes of links. What is not used may be anything.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shapes {
    Used,
    Unused,
}

impl Link {
    /// A link without shapes.
    pub(crate) fn new(name: &str, inertial: Option<Inertial>) -> Self {
        Self { name: name.to_owned(), inertial, shapes: Default::default() }
    }

    fn read(node: Node, shapes: Shapes) -> Result<Self, UrdfError> {
        let own = Named::new("link", node)?;
        let inertial = match child(node, "inertial") {
            Some(inertial) => {
                let [mass] = own.finite(own.child(inertial, "mass")?, "value")?;
                let inertia = own.child(inertial, "inertia")?;
                let moment = |name| own.finite::<1>(inertia, name).map(|[moment]| moment);
                let [xx, yy, zz] = [moment("ixx")?, moment("iyy")?, moment("izz")?];
                let [xy, xz, yz] = [moment("ixy")?, moment("ixz")?, moment("iyz")?];
                Some(Inertial {
                    mass,
                    centre: own.origin(inertial)?,
                    inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
                })
            }
            None => None,
        };
        let of = |name| match shapes {
            Shapes::Used => children(node, name).map(|node| Shape::read(&own, node)).collect(),
            Shapes::Unused => Ok(Vec::new()),
        };
        let shapes = [of("collision")?, of("visual")?];
        Ok(Self { name: own.name.to_owned(), inertial, shapes })
    }
}

impl Shape {
    /// Reads a `<collision>` or a `<visual>` of the link `own`.
    fn read<'a>(own: &Named<'a>, node: Node<'a, '_>) -> Result<Self, UrdfError> {
        let geometry = own.child(node, "geometry")?;
        let form = if let Some(mesh) = child(geometry, "mesh") {
            let scale = match mesh.attribute("scale") {
                Some(_) => own.finite(mesh, "scale")?,
                None => [1.0; 3],
            };
            Form::Mesh { file: own.attribute(mesh, "filename")?.to_owned(), scale }
        } else if let Some(cuboid) = child(geometry, "box") {
            Form::Box(own.finite(cuboid, "size")?)
        } else if let Some(cylinder) = child(geometry, "cylinder") {
            let of = |name| own.finite::<1>(cylinder, name).map(|[own]| own);
            Form::Cylinder { radius: of("radius")?, length: of("length")? }
        } else if let Some(sphere) = child(geometry, "sphere") {
            let [radius] = own.finite(sphere, "radius")?;
            Form::Sphere { radius }
        } else {
            let other = geometry.children().find(Node::is_element);
            let other =
                other.map_or("nothing".to_owned(), |own| format!("<{}>", own.tag_name().name()));
            let fault = format!(
                "<geometry> has {other}: must be <mesh>, <box>, <cylinder> or <sphere>; or give the link an <inertial>"
            );
            return Err(own.malformed(geometry, fault));
        };
        Ok(Self { origin: own.origin(node)?, form })
    }
}

impl Joint {
    /// Reads a joint; `unstated` is an upper limit that the file leaves out.
    fn read(node: Node, unstated: f64) -> Result<Self, UrdfError> {
        let own = Named::new("joint", node)?;
        let end = |name| own.attribute(own.child(node, name)?, "link").map(str::to_owned);
        let kind = own.attribute(node, "type")?;
        let of_drive = |name| child(node, name).filter(|_| kind != FIXED);
        let axis = match of_drive("axis") {
            Some(axis) => own.finite(axis, "xyz")?,
            None => [1.0, 0.0, 0.0],
        };
        let limits = match of_drive("limit") {
            Some(limit) => {
                let of = |name, unstated| match own.optional(limit, name, &OF_LIMIT)? {
                    Some(text) => own.numbers(limit, name, text).map(|[own]| own),
                    None => Ok(unstated),
                };
                Some([of("lower", -unstated)?, of("upper", unstated)?])
            }
            None => None,
        };
        let leader = match child(node, "mimic") {
            Some(mimic) => Some(own.attribute(mimic, "joint")?.to_owned()),
            None => None,
        };
        Ok(Self {
            name: own.name.to_owned(),
            kind: kind.to_owned(),
            parent: end("parent")?,
            child: end("child")?,
            origin: own.origin(node)?,
            axis: axis.into(),
            limits,
            leader,
        })
    }
}

/// The type of a joint without a drive.
pub(crate) const FIXED: &str = "fixed";
/// Attributes of `<limit>` and of `<origin>`.
const OF_LIMIT: [&str; 7] =
    ["lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"];
const OF_ORIGIN: [&str; 3] = ["xyz", "rpy", "quat_xyzw"];

/// The elements of this name below a node, which are in the same name space.
fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    let space = node.tag_name().namespace();
    node.children().filter(move |child| {
        let own = child.tag_name();
        child.is_element() && own.name() == name && own.namespace() == space
    })
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// A link or a joint, which errors name.
struct Named<'a> {
    /// "link" or "joint".
    kind: &'static str,
    name: &'a str,
}

impl<'a> Named<'a> {
    fn new(kind: &'static str, node: Node<'a, '_>) -> Result<Self, UrdfError> {
        match node.attribute("name") {
            Some(name) => Ok(Self { kind, name }),
            None => Err(UrdfError::Nameless { line: line(node), kind }),
        }
    }

    fn malformed(&self, at: Node, fault: String) -> UrdfError {
        let Self { kind, name } = *self;
        UrdfError::Malformed { line: line(at), kind, name: name.to_owned(), fault }
    }

    /// The element of this name below a node.
    fn child<'i>(&self, node: Node<'a, 'i>, name: &str) -> Result<Node<'a, 'i>, UrdfError> {
        child(node, name).ok_or_else(|| {
            let within = node.tag_name().name();
            let within = if within == self.kind { "" } else { &format!("<{within}> ") };
            self.malformed(node, format!("{within}has no <{name}>"))
        })
    }

    fn attribute(&self, node: Node<'a, '_>, name: &str) -> Result<&'a str, UrdfError> {
        node.attribute(name).ok_or_else(|| {
            let given: Vec<&str> = node.attributes().map(|own| own.name()).collect();
            let given = if given.is_empty() { "none".to_owned() } else { given.join(", ") };
            let element = node.tag_name().name();
            self.malformed(node, format!("<{element}> has no attribute {name}; it has {given}"))
        })
    }

    /// An attribute that may be left out. One that is none of `known` is taken for a misspelt one.
    fn optional(
        &self,
        node: Node<'a, '_>,
        name: &str,
        known: &[&str],
    ) -> Result<Option<&'a str>, UrdfError> {
        if node.has_attribute(name) || node.attributes().any(|own| !known.contains(&own.name())) {
            return self.attribute(node, name).map(Some);
        }
        Ok(None)
    }

    /// The `text` of an attribute as so many numbers.
    fn numbers<const N: usize>(
        &self,
        node: Node,
        name: &str,
        text: &str,
    ) -> Result<[f64; N], UrdfError> {
        let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
        let numbers = numbers.ok().and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        numbers.ok_or_else(|| {
            if text.contains("${") || text.contains("$(") {
                return UrdfError::Xacro;
            }
            let wanted = if N == 1 { "a number".to_owned() } else { format!("{N} numbers") };
            let element = node.tag_name().name();
            let mend =
                if text.contains(',') { ", with decimal points and without commas" } else { "" };
            self.malformed(node, format!("<{element}> has {name}={text:?}: must be {wanted}{mend}"))
        })
    }

    /// An attribute that is so many finite numbers.
    fn finite<const N: usize>(
        &self,
        node: Node<'a, '_>,
        name: &str,
    ) -> Result<[f64; N], UrdfError> {
        let text = self.attribute(node, name)?;
        self.all_finite(self.numbers(node, name, text)?)
    }

    fn all_finite<const N: usize>(&self, numbers: [f64; N]) -> Result<[f64; N], UrdfError> {
        let Self { kind, name } = *self;
        match numbers.into_iter().find(|number| !number.is_finite()) {
            Some(number) => Err(UrdfError::NotFinite { kind, name: name.to_owned(), number }),
            None => Ok(numbers),
        }
    }

    /// The pose in the `<origin>` of a node: translation, then roll, pitch, yaw about fixed axes, or since version 1.1 of URDF a quaternion.
    fn origin(&self, node: Node<'a, '_>) -> Result<Isometry3<f64>, UrdfError> {
        let Some(origin) = child(node, "origin") else { return Ok(Isometry3::identity()) };
        let optional = |name| match self.optional(origin, name, &OF_ORIGIN)? {
            Some(text) => self.all_finite(self.numbers(origin, name, text)?).map(Some),
            None => Ok(None),
        };
        let position: [f64; 3] = optional("xyz")?.unwrap_or_default();
        let turn = match (optional("rpy")?, origin.has_attribute("quat_xyzw")) {
            (Some([roll, pitch, yaw]), _) => UnitQuaternion::from_euler_angles(roll, pitch, yaw),
            (None, true) => {
                let [x, y, z, w] = self.finite(origin, "quat_xyzw")?;
                UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).ok_or_else(|| {
                    self.malformed(origin, "<origin> has the quaternion 0 0 0 0".to_owned())
                })?
            }
            (None, false) => UnitQuaternion::identity(),
        };
        Ok(Isometry3::from_parts(Translation3::from(position), turn))
    }
}

/// The line on which a node begins, from 1.
fn line(node: Node) -> u32 {
    node.document().text_pos_at(node.range().start).row
}
