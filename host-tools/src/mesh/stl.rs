//! Triangles of an STL file.

use std::io::Cursor;

use super::{MeshError, Point, Triangle};

/// Bytes before the triangles of a binary file: a comment, and their number.
const HEAD: usize = 84;
/// Bytes of a triangle: normal, three corners, an attribute.
const TRIANGLE: usize = 50;

/// Reads the triangles, in the unit of the file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let mut bytes = bytes.to_vec();
    let is_text = bytes.starts_with(b"solid");
    if let Some(&[a, b, c, d]) = bytes.get(HEAD - 4..HEAD) {
        let triangles = u32::from_le_bytes([a, b, c, d]);
        let needed = HEAD + TRIANGLE * triangles as usize;
        if is_text && needed == bytes.len() {
            // Many programs begin the comment of a binary file with the word that tells a text.
            bytes[0] = b' ';
        } else if !is_text && needed > bytes.len() {
            let found = bytes.len();
            let is_word = bytes
                .iter()
                .take(HEAD)
                .all(|own| own.is_ascii_graphic() || own.is_ascii_whitespace());
            return Err(if is_word {
                MeshError::OtherFile
            } else {
                MeshError::Truncated { found, triangles, needed }
            });
        }
    } else if !is_text {
        return Err(MeshError::OtherFile);
    }
    let fault = |error: std::io::Error| MeshError::Stl(error.to_string());
    let mut file = Cursor::new(bytes);
    let triangles = stl_io::create_stl_reader(&mut file).map_err(fault)?;
    let corner = |own: stl_io::Vertex| Point::from(own.0.map(f64::from));
    triangles.map(|own| Ok(own.map_err(fault)?.vertices.map(corner))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::read;
    use super::*;

    const TEXT: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0.5\nendloop\nendfacet\nendsolid a\n";

    /// A binary file by the letter of the format, with so many triangles in its head.
    fn binary(comment: &[u8], number: u32, triangles: &[[f32; 9]]) -> Vec<u8> {
        let mut file = comment.to_vec();
        file.resize(80, b' ');
        file.extend(number.to_le_bytes());
        for corners in triangles {
            file.extend([0; 12]);
            file.extend(corners.iter().flat_map(|own| own.to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.5];

    #[test]
    fn text_and_binary_are_the_same() {
        let text = read(TEXT.as_bytes()).unwrap();
        assert_eq!(text, [[Point::zeros(), Point::x(), Point::new(0.0, 2.0, 0.5)]]);
        for comment in [&b"\x00any"[..], b"solid by some CAD"] {
            assert_eq!(read(&binary(comment, 1, &[CORNERS])).unwrap(), text);
        }
    }

    #[test]
    fn a_damaged_file_is_named() {
        let whole = binary(b"\x00", 3, &[CORNERS; 3]);
        let error = read(&whole[..200]).unwrap_err().to_string();
        assert!(
            error.starts_with("is cut off: has 200 bytes, and its 3 triangles take 234: "),
            "{error}"
        );
        // A number that no memory holds is none to reserve for.
        assert!(matches!(
            read(&binary(b"\x00", u32::MAX, &[CORNERS])),
            Err(MeshError::Truncated { .. })
        ));
        assert!(matches!(read(&TEXT.as_bytes()[..70]), Err(MeshError::Stl(_))));
        assert!(matches!(
            read(b"# a mesh of Wavefront\nv 0 0 0\nv 1 0 0\n"),
            Err(MeshError::OtherFile)
        ));
        assert_eq!(read(&binary(b"\x00", 0, &[])), Err(MeshError::Empty));
        assert_eq!(read(b""), Err(MeshError::OtherFile));
        let pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
        assert_eq!(read(pointer), Err(MeshError::Pointer));
        let mut corners = [CORNERS; 2];
        corners[1][4] = f32::NAN;
        assert_eq!(read(&binary(b"\x00", 2, &corners)), Err(MeshError::NotFinite(2)));
    }
}
