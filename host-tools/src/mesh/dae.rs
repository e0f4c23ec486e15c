//! Triangles of a COLLADA file (versions 1.4 and 1.5): the geometries of its scene, each at its node, in m.
//!
//! The axis that points up is not looked at, as by rviz and other readers of URDF.

use std::collections::HashMap;
use std::rc::Rc;

use nalgebra::{Matrix4, Rotation3, Unit, Vector3};
use roxmltree::{Document, Node, NodeId, ParsingOptions};

use super::{MeshError, Point, Triangle};

/// Largest number of nodes and instances, and of triangles: a hundred and ten times those of a link. A few lines of XML may ask for any number.
const MOST_NODES: usize = 10_000;
const MOST_TRIANGLES: usize = 1_000_000;

/// Reads the triangles, m.
pub(super) fn read(text: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let text = str::from_utf8(text).map_err(|_| fault("must be UTF-8"))?;
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(text, options).map_err(|error| fault(&error.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "COLLADA" {
        return Err(MeshError::OtherFile);
    }
    let with_id = root.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
    let mut file =
        File { by_id: with_id.collect(), positions: HashMap::new(), geometries: HashMap::new() };
    let unit = child(root, "asset").and_then(|asset| child(asset, "unit"));
    let metre = match unit.and_then(|unit| unit.attribute("meter")) {
        Some(text) => {
            text.trim().parse().map_err(|_| fault(&format!("<unit> has meter={text:?}")))?
        }
        None => 1.0,
    };
    let scene = child(root, "scene").and_then(|scene| child(scene, "instance_visual_scene"));
    let scene = match scene {
        Some(instance) => Some(file.at(instance, "url")?),
        None => root.descendants().find(|node| {
            node.has_tag_name((node.tag_name().namespace().unwrap_or(""), "visual_scene"))
        }),
    };
    let mut triangles = Vec::new();
    let unit = Matrix4::new_scaling(metre);
    match scene {
        Some(scene) => file.of_scene(scene, unit, &mut triangles)?,
        None => {
            let geometries = root.descendants().filter(|node| is(*node, "geometry"));
            geometries
                .into_iter()
                .try_for_each(|own| file.of_geometry(own, &unit, &mut triangles))?;
        }
    }
    Ok(triangles)
}

fn fault(what: &str) -> MeshError {
    MeshError::Collada(what.split_whitespace().collect::<Vec<_>>().join(" "))
}

fn is(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|own| is(*own, name))
}

/// The numbers of an element's text.
fn numbers<T: std::str::FromStr>(node: Node) -> Result<Vec<T>, MeshError> {
    let all = node.text().unwrap_or_default().split_ascii_whitespace().map(str::parse);
    all.collect::<Result<_, _>>()
        .map_err(|_| fault(&format!("<{}> has what is no number", node.tag_name().name())))
}

struct File<'a, 'i> {
    by_id: HashMap<&'a str, Node<'a, 'i>>,
    /// The numbers of the arrays that are read, and the triangles of the geometries, in the unit of the file.
    positions: HashMap<NodeId, Rc<[f64]>>,
    geometries: HashMap<NodeId, Rc<[Triangle]>>,
}

impl<'a, 'i> File<'a, 'i> {
    /// The element that an attribute names.
    fn at(&self, node: Node<'a, 'i>, attribute: &str) -> Result<Node<'a, 'i>, MeshError> {
        let name = node.attribute(attribute).unwrap_or_default();
        let found = name.strip_prefix('#').and_then(|id| self.by_id.get(id)).copied();
        found.ok_or_else(|| {
            fault(&format!(
                "<{}> names {name:?}, which the file does not have",
                node.tag_name().name()
            ))
        })
    }

    /// Adds the triangles of a scene.
    fn of_scene(
        &mut self,
        scene: Node<'a, 'i>,
        unit: Matrix4<f64>,
        into: &mut Vec<Triangle>,
    ) -> Result<(), MeshError> {
        let mut open = vec![(scene, unit)];
        let mut visited = 0;
        while let Some((node, above)) = open.pop() {
            visited += 1;
            let mut pose = above;
            for part in node.children().filter(Node::is_element) {
                if visited + open.len() > MOST_NODES {
                    return Err(fault("its nodes are too many, or hold one another"));
                }
                match part.tag_name().name() {
                    // A node's own come before what it holds.
                    "matrix" | "translate" | "rotate" | "scale" => pose *= transform(part)?,
                    "node" => open.push((part, pose)),
                    "instance_node" => open.push((self.at(part, "url")?, pose)),
                    "instance_geometry" => {
                        visited += 1;
                        self.of_geometry(self.at(part, "url")?, &pose, into)?;
                    }
                    other @ ("lookat" | "skew") => {
                        return Err(fault(&format!(
                            "has <{other}>: export it with <matrix>, or as STL"
                        )));
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Adds the triangles of a geometry.
    fn of_geometry(
        &mut self,
        geometry: Node<'a, 'i>,
        pose: &Matrix4<f64>,
        into: &mut Vec<Triangle>,
    ) -> Result<(), MeshError> {
        let own = match self.geometries.get(&geometry.id()) {
            Some(own) => own.clone(),
            None => {
                let own: Rc<[Triangle]> = self.triangles(geometry)?.into();
                self.geometries.insert(geometry.id(), own.clone());
                own
            }
        };
        let place = |own: Point| pose.transform_point(&own.into()).coords;
        into.extend(own.iter().map(|corners| corners.map(place)));
        is_few(into)
    }

    /// The triangles of a geometry, in the unit of the file.
    fn triangles(&mut self, geometry: Node<'a, 'i>) -> Result<Vec<Triangle>, MeshError> {
        let mut into = Vec::new();
        let Some(mesh) = child(geometry, "mesh") else { return Ok(into) };
        for part in mesh.children().filter(Node::is_element) {
            let kind = part.tag_name().name();
            if !["triangles", "polylist", "polygons", "trifans", "tristrips"].contains(&kind) {
                continue;
            }
            if ["trifans", "tristrips"].contains(&kind) {
                return Err(fault(&format!("has <{kind}>: export it with triangles, or as STL")));
            }
            let corners = self.corners(part)?;
            let polygons: Vec<usize> = match kind {
                "polylist" => {
                    let count = child(part, "vcount");
                    numbers(
                        count
                            .ok_or_else(|| fault("<polylist> has no <vcount>: export it again"))?,
                    )?
                }
                "triangles" => vec![3; corners.iter().map(Vec::len).sum::<usize>() / 3],
                _ => corners.iter().map(Vec::len).collect(),
            };
            let mut rest = corners.concat().into_iter();
            for count in polygons {
                let own: Vec<Point> = rest.by_ref().take(count).collect();
                if own.len() < count {
                    return Err(fault(&format!(
                        "<{kind}> has fewer corners than its polygons take: cut off?"
                    )));
                }
                // A fan: right for the convex polygons of exporters.
                let [first, others @ ..] = own.as_slice() else { continue };
                into.extend(others.windows(2).map(|pair| [*first, pair[0], pair[1]]));
            }
            is_few(&into)?;
        }
        Ok(into)
    }

    /// The corners of each `<p>` of a primitive, in the unit of the file.
    fn corners(&mut self, part: Node<'a, 'i>) -> Result<Vec<Vec<Point>>, MeshError> {
        let inputs = || part.children().filter(|own| is(*own, "input"));
        let offset = |input: Node| input.attribute("offset").unwrap_or("0").trim().parse::<usize>();
        let offsets: Result<Vec<usize>, _> = inputs().map(offset).collect();
        let offsets = offsets.map_err(|_| fault("<input> has an offset that is no number"))?;
        let stride = offsets.iter().max().map_or(1, |most| most.saturating_add(1));
        let vertex =
            inputs().zip(&offsets).find(|(input, _)| input.attribute("semantic") == Some("VERTEX"));
        let (vertex, &offset) = vertex.ok_or_else(|| fault("a mesh has no VERTEX"))?;
        let vertices = self.at(vertex, "source")?;
        let position = vertices
            .children()
            .find(|own| is(*own, "input") && own.attribute("semantic") == Some("POSITION"));
        let source =
            self.at(position.ok_or_else(|| fault("<vertices> has no POSITION"))?, "source")?;
        let array =
            child(source, "float_array").ok_or_else(|| fault("<source> has no <float_array>"))?;
        let positions = match self.positions.get(&array.id()) {
            Some(own) => own.clone(),
            None => {
                let own: Rc<[f64]> = numbers(array)?.into();
                self.positions.insert(array.id(), own.clone());
                own
            }
        };
        let place = |index: &usize| {
            let own = index.checked_mul(3).and_then(|at| positions.get(at..at.checked_add(3)?));
            let own = own.ok_or_else(|| {
                fault(&format!(
                    "a corner has the index {index}, and there are {} positions",
                    positions.len() / 3
                ))
            })?;
            Ok(Point::from_column_slice(own))
        };
        let of = |p: Node| {
            let indices: Vec<usize> = numbers(p)?;
            indices.iter().skip(offset).step_by(stride).map(place).collect()
        };
        part.children().filter(|own| is(*own, "p")).map(of).collect()
    }
}

/// Refuses more triangles than a mesh may have.
fn is_few(triangles: &[Triangle]) -> Result<(), MeshError> {
    if triangles.len() > MOST_TRIANGLES {
        return Err(fault("has more than a million triangles: name a simpler mesh"));
    }
    Ok(())
}

/// The transformation of a `<matrix>`, `<translate>`, `<rotate>` (axis, degrees) or `<scale>`.
fn transform(node: Node) -> Result<Matrix4<f64>, MeshError> {
    let own: Vec<f64> = numbers(node)?;
    match (node.tag_name().name(), own.as_slice()) {
        ("matrix", own) if own.len() == 16 => Ok(Matrix4::from_row_slice(own)),
        ("translate", &[x, y, z]) => Ok(Matrix4::new_translation(&Vector3::new(x, y, z))),
        ("scale", &[x, y, z]) => Ok(Matrix4::new_nonuniform_scaling(&Vector3::new(x, y, z))),
        ("rotate", &[x, y, z, degrees]) => {
            let axis = Unit::try_new(Vector3::new(x, y, z), 1e-9);
            Ok(axis.map_or_else(Matrix4::identity, |axis| {
                Rotation3::from_axis_angle(&axis, degrees.to_radians()).to_homogeneous()
            }))
        }
        (name, own) => Err(fault(&format!("<{name}> has {} numbers", own.len()))),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Outline, Solid, read};
    use super::*;

    /// A box of 2 x 4 x 6 in mm: its lower half of two quads as polygons, the rest as a list and as triangles. The scene turns it by a quarter
    /// about z, then moves it.
    const BOX: &str = r##"<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="s"><float_array id="a" count="24">0 0 0  2 0 0  0 4 0  2 4 0  0 0 6  2 0 6  0 4 6  2 4 6</float_array></source>
    <vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
    <polygons count="2"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 3 1</p><p>4 5 7 6</p></polygons>
    <polylist count="2"><input semantic="NORMAL" source="#n" offset="0"/><input semantic="VERTEX" source="#v" offset="1"/>
      <vcount>4 4</vcount><p>9 0 9 4 9 6 9 2  9 1 9 3 9 7 9 5</p></polylist>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 5 0 5 4 2 6 7 2 7 3</p></triangles>
  </mesh></geometry></library_geometries>
  <library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
  <library_visual_scenes><visual_scene id="x"><node>
    <translate>10 0 0</translate><rotate>0 0 1 90</rotate><node><instance_node url="#n"/></node>
  </node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#x"/></scene>
</COLLADA>"##;

    #[test]
    fn the_scene_is_read_in_its_unit() {
        let (solid, outline) = Solid::of_mesh(&read(BOX.as_bytes()).unwrap()).unwrap();
        assert_eq!(outline, Outline::Closed);
        assert!((solid.volume - 48e-9).abs() < 1e-15, "{}", solid.volume);
        // A quarter turn takes (1, 2, 3) to (-2, 1, 3).
        assert!((solid.centre - Point::new(8e-3, 1e-3, 3e-3)).norm() < 1e-12, "{}", solid.centre);
        let along = |own: usize| solid.inertia[(own, own)] / 48e-9 * 12e6;
        assert!(
            (along(0) - 40.0).abs() < 1e-6 && (along(1) - 52.0).abs() < 1e-6,
            "{}",
            solid.inertia
        );
    }

    #[test]
    fn a_file_without_a_scene_is_its_geometries() {
        let text = BOX
            .replace("visual_scene", "scene_of_none")
            .replace("<scene>", "<none>")
            .replace("</scene>", "</none>");
        let (solid, _) = Solid::of_mesh(&read(text.as_bytes()).unwrap()).unwrap();
        assert!((solid.centre - Point::new(1e-3, 2e-3, 3e-3)).norm() < 1e-12, "{}", solid.centre);
    }

    #[test]
    fn mistakes_are_named() {
        for (from, to, says) in [
            (
                "url=\"#g\"",
                "url=\"#h\"",
                "<instance_geometry> names \"#h\", which the file does not have",
            ),
            ("<p>0 1 5", "<p>0 1 8", "a corner has the index 8, and there are 8 positions"),
            ("<p>0 1 5", "<p>0 1 x", "<p> has what is no number"),
            ("<vcount>4 4<", "<vcount>4 5<", "<polylist> has fewer corners than its polygons take"),
            ("url=\"#g\"", "url=\"#n\"", "has no triangles"),
            ("<instance_geometry url=\"#g\"/>", "<instance_node url=\"#n\"/>", "hold one another"),
            ("<translate>10 0 0", "<translate>10 0", "<translate> has 2 numbers"),
            ("meter=\"0.001\"", "meter=\"mm\"", "<unit> has meter=\"mm\""),
            ("<vcount>4 4</vcount>", "", "<polylist> has no <vcount>: export it again"),
            ("<translate>10 0 0</translate>", "<lookat>1 0 0</lookat>", "has <lookat>: export it"),
            ("</COLLADA>", "", "is no COLLADA file that can be read: "),
        ] {
            assert!(BOX.contains(from), "{from}");
            let read = read(BOX.replacen(from, to, 1).as_bytes());
            match read {
                Err(error) => assert!(error.to_string().contains(says), "{to}: {error}"),
                // What a geometry does not hold is no triangle.
                Ok(triangles) => panic!("{to}: {} triangles", triangles.len()),
            }
        }
        assert_eq!(read(b"<robot name=\"r\"/>"), Err(MeshError::OtherFile));
    }

    /// A node that holds itself ten thousand times asks for a hundred million places, and one with as many instances for as many meshes.
    #[test]
    fn what_asks_for_too_much_is_refused() {
        let own = "<instance_geometry url=\"#g\"/>";
        for (many, says) in [
            ("<instance_node url=\"#n\"/>".repeat(10_001), "its nodes are too many"),
            (own.repeat(10_001), "its nodes are too many"),
        ] {
            let error = read(BOX.replace(own, &many).as_bytes()).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        let more = "<p>0 1 5 0 5 4 2 6 7 2 7 3".to_owned() + &" 0 1 5".repeat(999);
        let text =
            BOX.replace("<p>0 1 5 0 5 4 2 6 7 2 7 3", &more).replace(own, &own.repeat(1_100));
        let error = read(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("more than a million triangles"), "{error}");
    }
}
