//! Triangles of an STL file.

use std::io::Cursor;

use super::{MeshError, Point, Triangle};

/// Bytes before the triangles of a binary file: a comment, and their number.
const HEAD: usize = 84;
/// Bytes of a triangle: normal, three corners, an attribute.
const TRIANGLE: usize = 50;

/// Reads the triangles, in the unit of the file.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Triangle>, MeshError> {
    let is_text = first_word(bytes).eq_ignore_ascii_case(b"solid");
    if let Some(&[a, b, c, d]) = bytes.get(HEAD - 4..HEAD) {
        let triangles = u32::from_le_bytes([a, b, c, d]);
        let needed = HEAD + TRIANGLE * triangles as usize;
        // Many programs begin the comment of a binary file with the word that tells a text.
        if is_text && needed != bytes.len() {
            return triangles_of(one_solid(bytes));
        } else if needed > bytes.len() {
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
    } else if is_text {
        return triangles_of(one_solid(bytes));
    } else {
        return Err(MeshError::OtherFile);
    }
    let mut bytes = bytes.to_vec();
    bytes[0] = b' ';
    triangles_of(bytes)
}

/// The first five bytes that are no white space: the word that tells a text.
fn first_word(bytes: &[u8]) -> &[u8] {
    let text = bytes.trim_ascii_start();
    &text[..text.len().min(5)]
}

/// The solids of a text as one, in lower case. One that does not end leaves the text without an end.
fn one_solid(bytes: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes).to_lowercase();
    let mut all = "solid \n".to_owned();
    let (mut begun, mut ended) = (0, 0);
    for line in text.lines() {
        match line.split_whitespace().next() {
            Some("solid") => begun += 1,
            Some("endsolid") => ended += 1,
            _ => all.extend([line, "\n"]),
        }
    }
    if begun == ended {
        all += "endsolid\n";
    }
    all.into_bytes()
}

/// The triangles of a binary file, or of a text of one solid.
fn triangles_of(bytes: Vec<u8>) -> Result<Vec<Triangle>, MeshError> {
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
        for other in [TEXT.replace("solid a", "solid"), TEXT.to_uppercase(), format!("\n {TEXT}")] {
            assert_eq!(read(other.as_bytes()).unwrap(), text, "{other}");
        }
    }

    #[test]
    fn all_solids_of_a_text_are_read() {
        let two = TEXT.to_owned() + &TEXT.replace("0 2 0.5", "0 3 0.5");
        let triangles = read(two.as_bytes()).unwrap();
        assert_eq!(triangles.len(), 2);
        assert_eq!(triangles[1][2], Point::new(0.0, 3.0, 0.5));
        let cut = two.strip_suffix("endsolid a\n").unwrap();
        assert!(matches!(read(cut.as_bytes()), Err(MeshError::Stl(_))));
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
