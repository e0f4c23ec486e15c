//! Raw values of DAQmx: parts of the rows that a device has written into its buffers.

use super::super::bytes::{CutOff, Reader};
use super::kind::Kind;

/// Type of values that says that they are raw ones of DAQmx.
const RAW: u32 = u32::MAX;

/// Where the raw values of a channel stand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Raw {
    /// Number of rows in a chunk.
    pub(super) rows: usize,
    /// Type of the values.
    pub(super) kind: Kind,
    /// Number of the buffer, and place in its rows, bytes.
    pub(super) buffer: usize,
    pub(super) place: usize,
    /// Number of the scale whose values they are.
    pub(super) scale: f64,
    /// Widths of the rows of all buffers, bytes.
    pub(super) widths: Vec<usize>,
}

impl Raw {
    /// Reads the description of a channel, or of one of digital lines, behind the code that tells both.
    ///
    /// # Errors
    /// It is cut off, or of a type that is not known.
    pub(super) fn read(reader: &mut Reader, is_of_lines: bool) -> Result<Self, String> {
        let (kind, _dimension, rows) = (reader.u32()?, reader.u32()?, reader.u64()?);
        let count = reader.u32()?;
        if kind != RAW || count == 0 {
            return Err(CutOff.into());
        }
        let mut first = None;
        for _ in 0..count {
            let (code, buffer, place) = (reader.u32()?, reader.u32()?, reader.u32()?);
            // A bitmap of the format: a byte for lines, whose place is given in bits.
            let (place, _format) =
                if is_of_lines { (place / 8, reader.take(1)?) } else { (place, reader.take(4)?) };
            let scale = reader.u32()?.into();
            // A channel of a sensor has one.
            first.get_or_insert((code, buffer as usize, place as usize, scale));
        }
        let (code, buffer, place, scale) = first.ok_or(CutOff)?;
        let kind = Kind::of_daqmx(code).ok_or_else(|| {
            format!("has values of DAQmx of type {code}, which is not known: save it scaled")
        })?;
        let widths = (0..reader.u32()?)
            .map(|_| reader.u32().map(|own| own as usize))
            .collect::<Result<_, _>>()?;
        let rows = usize::try_from(rows).unwrap_or(usize::MAX);
        Ok(Self { rows, kind, buffer, place, scale, widths })
    }
}
