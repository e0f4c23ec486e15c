//! MAT files of MATLAB up to version 7 ("MAT-File Format", MathWorks): the numeric variables at the top.
//!
//! A vector is a channel of its name; each of its elements is one too, `q(1)`, if they are few. Of a matrix each column is one, `F(:,1)`, or each
//! row, `F(1,:)`, along the longer side. The crate `matfile` is not used: MATLAB stores whole numbers of an array of doubles as small integers, at
//! which it gives up the whole file.

use std::io::{self, BufReader, Read};

use flate2::read::ZlibDecoder;

use super::channels::{Channel, Group, LARGEST};
use super::layout::Layout;

/// Kinds of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of numeric arrays: double, single, and integers of 8 to 64 bits.
const NUMERIC: std::ops::RangeInclusive<u8> = 6..=15;
/// Most elements of a vector, and most columns of a matrix, that are channels of their own.
const MOST: usize = 12;

/// Reads the variables that the layout wants; of others the names.
///
/// # Errors
/// The file is damaged or cut off.
pub(super) fn read(bytes: impl Read, layout: &Layout) -> Result<Vec<Group>, String> {
    let mut bytes = BufReader::new(bytes.take(LARGEST));
    let mut header = [0; 128];
    whole(bytes.read_exact(&mut header))?;
    let is_big_endian = match &header[126..] {
        b"IM" => false,
        b"MI" => true,
        _ => return Err("is damaged: its header does not say the order of bytes".into()),
    };
    let mut group = Group::default();
    while let Some(tag) = Tag::next(&mut bytes, is_big_endian)? {
        let mut element = (&mut bytes).take(tag.length.into());
        match tag.kind {
            MATRIX => group.channels.extend(variable(&mut element, is_big_endian, layout)?),
            COMPRESSED => {
                let mut content = ZlibDecoder::new(&mut element).take(LARGEST);
                if let Some(Tag { kind: MATRIX, length, .. }) =
                    Tag::next(&mut content, is_big_endian)?
                {
                    let mut content = content.take(length.into());
                    group.channels.extend(variable(&mut content, is_big_endian, layout)?);
                }
            }
            _ => {}
        }
        // A compressed element has no padding.
        let rest = element.limit() + if tag.kind == COMPRESSED { 0 } else { tag.padding() };
        if whole(io::copy(&mut (&mut bytes).take(rest), &mut io::sink()))?
            < rest.min(tag.length.into())
        {
            return Err(CUT_OFF.into());
        }
    }
    Ok(vec![group])
}

const CUT_OFF: &str = "is cut off: save it again, or name another file";

fn whole<T>(read: io::Result<T>) -> Result<T, String> {
    read.map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => CUT_OFF.to_owned(),
        _ => format!("is damaged: {error}"),
    })
}

/// Kind and length of an element, bytes. A small one holds its data.
struct Tag {
    kind: u32,
    length: u32,
    small: Option<[u8; 4]>,
}

impl Tag {
    /// Reads the next tag. Returns `None` at the end.
    fn next(bytes: &mut impl Read, is_big_endian: bool) -> Result<Option<Self>, String> {
        let mut tag = Vec::new();
        whole(bytes.take(8).read_to_end(&mut tag))?;
        let (Some(first), Some(second)) = (tag.first_chunk::<4>(), tag.last_chunk::<4>()) else {
            return if tag.is_empty() { Ok(None) } else { Err(CUT_OFF.into()) };
        };
        if tag.len() < 8 {
            return Err(CUT_OFF.into());
        }
        let number = |own: &[u8; 4]| {
            if is_big_endian { u32::from_be_bytes(*own) } else { u32::from_le_bytes(*own) }
        };
        let (kind, length) = (number(first), number(second));
        Ok(Some(match kind >> 16 {
            0 => Self { kind, length, small: None },
            length => Self { kind: kind & 0xFFFF, length: length.min(4), small: Some(*second) },
        }))
    }

    /// Returns the number of bytes behind the element.
    fn padding(&self) -> u64 {
        if self.small.is_some() {
            0
        } else {
            u64::from(self.length).next_multiple_of(8) - u64::from(self.length)
        }
    }

    /// Reads the data of the element, at most so many bytes.
    fn data(&self, bytes: &mut impl Read, most: u32) -> Result<Vec<u8>, String> {
        let length = self.length.min(most);
        if let Some(small) = self.small {
            return Ok(small[..length as usize].to_vec());
        }
        let mut data = Vec::new();
        whole(bytes.take(length.into()).read_to_end(&mut data))?;
        let rest = u64::from(self.length - length) + self.padding();
        whole(io::copy(&mut bytes.take(rest), &mut io::sink()))?;
        if data.len() < length as usize { Err(CUT_OFF.into()) } else { Ok(data) }
    }
}

/// Reads the channels of a variable. None if it is not numeric.
fn variable(
    bytes: &mut impl Read,
    is_big_endian: bool,
    layout: &Layout,
) -> Result<Vec<Channel>, String> {
    let mut next = |most: u32| -> Result<(u32, Vec<u8>), String> {
        let tag = Tag::next(bytes, is_big_endian)?.ok_or(CUT_OFF)?;
        Ok((tag.kind, tag.data(bytes, most)?))
    };
    let flags = next(8)?.1;
    let class = flags.get(if is_big_endian { 3 } else { 0 }).copied().unwrap_or_default();
    let (kind, sizes) = next(256)?;
    let sizes: Vec<usize> =
        numbers(kind, &sizes, is_big_endian)?.into_iter().map(|own| own as usize).collect();
    let name = String::from_utf8_lossy(&next(256)?.1).into_owned();
    let [rows, columns] = sizes[..] else { return Ok(Vec::new()) };
    if !NUMERIC.contains(&class) || rows == 0 || columns == 0 || name.is_empty() {
        return Ok(Vec::new());
    }
    // The channels: their names, and the places of their values, which stand column by column.
    let (first, step) = if columns == 1 || rows == 1 {
        (Vec::new(), 1)
    } else if rows >= columns {
        (
            (1..=columns)
                .map(|column| (format!("{name}(:,{column})"), (column - 1) * rows))
                .collect(),
            1,
        )
    } else {
        ((1..=rows).map(|row| (format!("{name}({row},:)"), row - 1)).collect::<Vec<_>>(), rows)
    };
    let length = rows.max(columns);
    let mut names: Vec<(String, usize, usize)> = if first.is_empty() {
        let elements = (0..length).map(|own| (format!("{name}({})", own + 1), own, 1));
        let elements = elements.take(if (2..=MOST).contains(&length) { length } else { 0 });
        std::iter::once((name.clone(), 0, length)).chain(elements).collect()
    } else {
        first.into_iter().map(|(name, first)| (name, first, length)).collect()
    };
    names.truncate(MOST + 1);
    let is_wanted = |name: &str| layout.wants("", name);
    let values = if names.iter().any(|(name, ..)| is_wanted(name)) {
        let (kind, data) = next(u32::MAX)?;
        let values = numbers(kind, &data, is_big_endian)?;
        if rows.checked_mul(columns) != Some(values.len()) {
            return Err(format!(
                "is damaged: {} has {} values, and not {rows} times {columns}",
                names[0].0,
                values.len()
            ));
        }
        values
    } else {
        Vec::new()
    };
    Ok(names
        .into_iter()
        .map(|(name, first, count)| {
            let own = values.iter().skip(first).step_by(step).take(count).copied();
            let values = if is_wanted(&name) { own.collect() } else { Vec::new() };
            Channel { name, values, ..Channel::default() }
        })
        .collect())
}

/// Returns numbers that are stored as this kind.
fn numbers(kind: u32, data: &[u8], is_big_endian: bool) -> Result<Vec<f64>, String> {
    fn all<const N: usize>(
        data: &[u8],
        is_big_endian: bool,
        of: impl Fn([u8; N]) -> f64,
    ) -> Vec<f64> {
        let own = data.as_chunks::<N>().0.iter().map(|own| {
            let mut own = *own;
            if is_big_endian {
                own.reverse();
            }
            of(own)
        });
        own.collect()
    }
    Ok(match kind {
        1 => all(data, is_big_endian, |own| i8::from_le_bytes(own).into()),
        2 => all(data, is_big_endian, |own| u8::from_le_bytes(own).into()),
        3 => all(data, is_big_endian, |own| i16::from_le_bytes(own).into()),
        4 => all(data, is_big_endian, |own| u16::from_le_bytes(own).into()),
        5 => all(data, is_big_endian, |own| i32::from_le_bytes(own).into()),
        6 => all(data, is_big_endian, |own| u32::from_le_bytes(own).into()),
        7 => all(data, is_big_endian, |own| f32::from_le_bytes(own).into()),
        9 => all(data, is_big_endian, f64::from_le_bytes),
        12 => all(data, is_big_endian, |own| i64::from_le_bytes(own) as f64),
        13 => all(data, is_big_endian, |own| u64::from_le_bytes(own) as f64),
        _ => return Err(format!("is damaged: it has numbers of an unknown kind, {kind}")),
    })
}
