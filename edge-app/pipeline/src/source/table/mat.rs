//! MAT files of MATLAB up to version 7 ("MAT-File Format", MathWorks): the numeric variables at the top.
//!
//! A vector is a channel of its name; each of its elements is one too, `q(1)`, if they are few. Of a matrix each column is one, `F(:,1)`, or each
//! row, `F(1,:)`, along the longer side. The crate `matfile` is not used: MATLAB stores whole numbers of an array of doubles as small integers, at
//! which it gives up the whole file.

use std::io::{self, Read};

use flate2::read::ZlibDecoder;

use super::bytes::{CutOff, Form, Number, Order, Reader, field};
use super::channels::{Channel, Group, LARGEST, bounded};
use super::layout::Layout;

/// Kinds of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of numeric arrays: double, single, and integers of 8 to 64 bits.
const NUMERIC: std::ops::RangeInclusive<u8> = 6..=15;
/// Most elements of a vector that are channels of their own, and most columns of a matrix that an error lists.
const MOST: usize = 12;
/// Most bytes of the elements before the values: a name has 63 at most.
const HEAD: u32 = 256;

/// Reads the variables that the layout wants; of others the names.
///
/// # Errors
/// The file is damaged or cut off.
pub(super) fn read(bytes: impl Read, layout: &Layout) -> Result<Vec<Group>, String> {
    bounded(bytes, |bytes| variables(bytes, layout))
}

fn variables(mut bytes: &mut dyn Read, layout: &Layout) -> Result<Vec<Group>, String> {
    let mut header = [0; 128];
    whole(bytes.read_exact(&mut header))?;
    let order = match &header[126..] {
        b"IM" => Order::Little,
        b"MI" => Order::Big,
        _ => {
            return Err(
                "is damaged: its header does not say the order of bytes: save it again".into()
            );
        }
    };
    let mut group = Group::default();
    while let Some(tag) = Tag::next(&mut bytes, order)? {
        let mut element = (&mut bytes).take(tag.length.into());
        match tag.kind {
            MATRIX => group.channels.extend(variable(&mut element, order, layout)?),
            COMPRESSED => {
                let mut content = ZlibDecoder::new(&mut element).take(LARGEST);
                if let Some(Tag { kind: MATRIX, length, .. }) = Tag::next(&mut content, order)? {
                    let mut content = content.take(length.into());
                    group.channels.extend(variable(&mut content, order, layout)?);
                }
            }
            _ => {}
        }
        // A compressed element has no padding.
        let rest = element.limit() + if tag.kind == COMPRESSED { 0 } else { tag.padding() };
        if whole(io::copy(&mut (&mut bytes).take(rest), &mut io::sink()))?
            < rest.min(tag.length.into())
        {
            return Err(CutOff.into());
        }
    }
    Ok(vec![group])
}

fn whole<T>(read: io::Result<T>) -> Result<T, String> {
    read.map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => CutOff.into(),
        _ => format!("is damaged: {error}: save it again"),
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
    fn next(bytes: &mut impl Read, order: Order) -> Result<Option<Self>, String> {
        let mut tag = Vec::new();
        whole(bytes.take(8).read_to_end(&mut tag))?;
        if tag.is_empty() {
            return Ok(None);
        }
        let mut reader = Reader::new(&tag, order);
        let (kind, length) = (reader.u32()?, reader.u32()?);
        Ok(Some(match kind >> 16 {
            0 => Self { kind, length, small: None },
            length => {
                Self { kind: kind & 0xFFFF, length: length.min(4), small: Some(field(&tag, 4)?) }
            }
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
        if data.len() < length as usize { Err(CutOff.into()) } else { Ok(data) }
    }
}

/// Reads the channels of a variable. None if it is not numeric.
fn variable(bytes: &mut impl Read, order: Order, layout: &Layout) -> Result<Vec<Channel>, String> {
    let mut next = || -> Result<(u32, Vec<u8>), String> {
        let tag = Tag::next(bytes, order)?.ok_or(CutOff)?;
        Ok((tag.kind, tag.data(bytes, HEAD)?))
    };
    let flags = next()?.1;
    let class = flags.get(if order == Order::Big { 3 } else { 0 }).copied().unwrap_or_default();
    let (kind, sizes) = next()?;
    let sizes: Vec<usize> =
        numbers(kind, &sizes, order)?.into_iter().map(|own| own as usize).collect();
    let name = String::from_utf8_lossy(&next()?.1).into_owned();
    let [rows, columns] = sizes[..] else { return Ok(Vec::new()) };
    if !NUMERIC.contains(&class) || rows == 0 || columns == 0 || name.is_empty() {
        return Ok(Vec::new());
    }
    let tag = Tag::next(bytes, order)?.ok_or(CutOff)?;
    let (count, stored) = (rows.checked_mul(columns), tag.length as usize);
    let of_values = |count: usize| count.checked_mul(number(tag.kind)?.size());
    if count.and_then(of_values) != Some(stored) {
        return Err(format!(
            "is damaged: {name} has {stored} bytes, which are not {rows} times {columns} values: save it again"
        ));
    }
    let length = rows.max(columns);
    let is_wanted = |name: &str| layout.wants("", name);
    // The channels: their names, and the places of their values, which stand column by column.
    let (own, step): (Vec<(String, usize, usize)>, usize) = if columns == 1 || rows == 1 {
        let elements = if (2..=MOST).contains(&length) { length } else { 0 };
        let elements = (0..elements).map(|own| (format!("{name}({})", own + 1), own, 1));
        (std::iter::once((name.clone(), 0, length)).chain(elements).collect(), 1)
    } else {
        let is_tall = rows >= columns;
        let of = |own: usize| {
            let name = if is_tall {
                format!("{name}(:,{})", own + 1)
            } else {
                format!("{name}({},:)", own + 1)
            };
            (name, if is_tall { own * rows } else { own }, length)
        };
        // Of those that are not wanted an error lists some.
        let all = (0..rows.min(columns)).map(|own| (own, of(own)));
        let own = all.filter(|(own, (name, ..))| *own < MOST || is_wanted(name));
        (own.map(|(_, own)| own).collect(), if is_tall { 1 } else { rows })
    };
    let values = if own.iter().any(|(name, ..)| is_wanted(name)) {
        if count.is_none_or(|count| count as u64 > LARGEST / 8) {
            return Err(format!("has more than 4 GiB of values in {name}: cut it"));
        }
        numbers(tag.kind, &tag.data(bytes, u32::MAX)?, order)?
    } else {
        Vec::new()
    };
    Ok(own
        .into_iter()
        .map(|(name, first, count)| {
            let own = values.iter().skip(first).step_by(step).take(count).copied();
            let values = if is_wanted(&name) { own.collect() } else { Vec::new() };
            Channel { name, values, ..Channel::default() }
        })
        .collect())
}

/// Returns how numbers of this kind are stored. `None` if it is not known.
fn number(kind: u32) -> Option<Number> {
    let (form, bits) = match kind {
        1 => (Form::Signed, 8),
        2 => (Form::Unsigned, 8),
        3 => (Form::Signed, 16),
        4 => (Form::Unsigned, 16),
        5 => (Form::Signed, 32),
        6 => (Form::Unsigned, 32),
        7 => (Form::Float, 32),
        9 => (Form::Float, 64),
        12 => (Form::Signed, 64),
        13 => (Form::Unsigned, 64),
        _ => return None,
    };
    Some(Number { form, bits })
}

/// Returns numbers that are stored as this kind.
fn numbers(kind: u32, data: &[u8], order: Order) -> Result<Vec<f64>, String> {
    let number = number(kind).ok_or_else(|| {
        format!("is damaged: it has numbers of an unknown kind, {kind}: save it again")
    })?;
    Ok(data.chunks_exact(number.size()).map(|own| number.value(order.bits(own))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of the variable `F` of this size, with values that are stored as this kind.
    fn file_in(order: Order, sizes: [u32; 2], kind: u32, values: &[u8]) -> Vec<u8> {
        let whole = |own: u32| match order {
            Order::Little => own.to_le_bytes(),
            Order::Big => own.to_be_bytes(),
        };
        let element = |kind: u32, data: &[u8]| {
            let mut own = [&whole(kind)[..], &whole(data.len() as u32), data].concat();
            own.resize(own.len().next_multiple_of(8), 0);
            own
        };
        let (flags, sizes) = ([6, 0].map(whole).concat(), sizes.map(whole).concat());
        let parts = [(6, &flags[..]), (5, &sizes), (1, b"F"), (kind, values)];
        let matrix = element(MATRIX, &parts.map(|(kind, own)| element(kind, own)).concat());
        let mut header = [0; 128];
        header[126..].copy_from_slice(if order == Order::Big { b"MI" } else { b"IM" });
        [&header[..], &matrix].concat()
    }

    /// The same, with bytes as values.
    fn file(sizes: [u32; 2], values: &[u8]) -> Vec<u8> {
        file_in(Order::Little, sizes, 2, values)
    }

    fn layout(name: &str) -> Layout {
        let axes = ["", "", name, "", "", ""].map(str::to_owned);
        Layout { axes, joints: Vec::new(), rate_hz: None, base: None, topics: None }
    }

    #[test]
    fn each_column_that_is_named_is_there() {
        let values: Vec<u8> = (0..16 * 17).map(|own| (own / 17) as u8).collect();
        let groups = read(&*file([17, 16], &values), &layout("F(:,14)")).unwrap();
        let channels = &groups[0].channels;
        assert_eq!(channels.len(), MOST + 1);
        assert_eq!(channels[MOST].name, "F(:,14)");
        assert_eq!(channels[MOST].values, [13.0; 17]);
    }

    #[test]
    fn both_orders_of_bytes_are_read() {
        let (little, big) = ([1.5, -2.0].map(f64::to_le_bytes), [1.5, -2.0].map(f64::to_be_bytes));
        let (shorts, turned) = ([1, -2].map(i16::to_le_bytes), [1, -2].map(i16::to_be_bytes));
        for (order, kind, values, expected) in [
            (Order::Little, 9, little.concat(), [1.5, -2.0]),
            (Order::Big, 9, big.concat(), [1.5, -2.0]),
            (Order::Little, 3, shorts.concat(), [1.0, -2.0]),
            (Order::Big, 3, turned.concat(), [1.0, -2.0]),
        ] {
            let groups = read(&*file_in(order, [1, 2], kind, &values), &layout("F")).unwrap();
            assert_eq!(groups[0].channels[0].values, expected, "{order:?} {kind}");
        }
    }

    #[test]
    fn sizes_that_are_not_those_of_the_values_are_refused() {
        for sizes in [[i32::MAX as u32; 2], [i32::MAX as u32, 1], [3, 2], [1, i32::MAX as u32]] {
            let error = read(&*file(sizes, &[0; 8]), &layout("F")).unwrap_err();
            assert!(error.starts_with("is damaged: F has 8 bytes, which are not "), "{error}");
        }
    }
}
