//! MF4 files (ASAM MDF 4.0 to 4.2), as data acquisition units, CANape and asammdf write them, compressed or not.
//!
//! A file is a graph of blocks that point to each other: data groups, their channel groups, their channels, and their records. The crate `mf4-rs` is not
//! used: it reads no compressed blocks.
//!
//! | module       | holds                                       |
//! | ------------ | ------------------------------------------- |
//! | `blocks`     | blocks: links, texts, packed data           |
//! | `conversion` | numbers into the values of a sensor         |
//! | `decoder`    | numbers of channels in their records        |
//! | `records`    | channel groups, and their records           |

mod blocks;
mod conversion;
mod decoder;
mod records;

use std::io::Read;

use super::bytes::field;
use super::channels::{Channel, Group, LARGEST, bounded};
use super::layout::Layout;
use blocks::File;
use records::{Part, fill};

/// Place of the version's number in the identification of the file.
const VERSION: usize = 28;

/// Reads the channels that the layout wants; of others the names.
///
/// # Errors
/// The file is damaged, cut off, not finished, of an older version, or of a bus.
pub(super) fn read(bytes: impl Read, layout: &Layout) -> Result<Vec<Group>, String> {
    let file = bounded(bytes, |bytes| {
        let mut file = Vec::new();
        let read = bytes.read_to_end(&mut file);
        read.map_err(|error| format!("cannot be read: {error}")).map(|_| file)
    })?;
    if file.starts_with(b"UnFinMF") {
        let mend = "`pip install asammdf; python3 -c \"from asammdf import MDF; MDF('IN.mf4').save('OUT.mf4')\"`";
        return Err(format!("was not finished by its writer: finish it with {mend}"));
    }
    let version = u16::from_le_bytes(field(&file, VERSION)?);
    if !(400..500).contains(&version) {
        let mend = "`pip install asammdf; python3 -c \"from asammdf import MDF; MDF('IN.mdf').convert('4.10').save('OUT.mf4')\"`";
        return Err(format!(
            "is MDF of version {}.{:02}, and 4 is read: convert it with {mend}",
            version / 100,
            version % 100
        ));
    }
    let file = File::new(&file);
    let mut groups = Vec::new();
    for data_group in file.list(file.header()?.link(0), b"##DG")? {
        let channel_groups = file.list(data_group.link(1), b"##CG")?;
        let id_bytes = usize::from(data_group.data::<1>(0)?[0]);
        let mut parts = Vec::new();
        for group in &channel_groups {
            parts.push(Part::new(&file, group, groups.len() + parts.len(), layout)?);
        }
        if parts.iter().any(Part::is_wanted) {
            let bytes: Option<u64> = parts.iter().map(|own| own.bytes(id_bytes)).sum();
            let records = file.records(data_group.link(2), bytes.unwrap_or(LARGEST))?;
            fill(&mut parts, &records, id_bytes)?;
        }
        groups.extend(parts.into_iter().map(|part| part.group));
    }
    let of_bus = |own: &Channel| own.name.starts_with("CAN_DataFrame");
    if groups.iter().any(|own| own.channels.iter().any(of_bus)) {
        let mend = "`pip install 'python-can[mf4]'; can_logconvert IN.mf4 OUT.log`";
        return Err(format!("holds the frames of a CAN bus: convert it with {mend}"));
    }
    Ok(groups)
}
