//! TDMS files of LabVIEW and of NI's drivers (NI, "TDMS File Format Internal Structure"; DAQmx data as npTDMS documents them).
//!
//! A file is a row of segments, each with the objects that changed and the values that came. The values of a channel stand in one piece, one after
//! the other with those of other channels, or, as DAQmx writes them, raw in the buffers of devices. The crate `tdms` is not used: of DAQmx data it
//! returns nothing, without an error.
//!
//! | module       | holds                                      |
//! | ------------ | ------------------------------------------ |
//! | `kind`       | types of values                            |
//! | `properties` | properties of objects                      |
//! | `daqmx`      | raw values of devices                      |
//! | `chunk`      | places of values in a segment              |
//! | `scales`     | raw values into those of the sensor        |
//! | `objects`    | channels, as the segments describe them    |

mod chunk;
mod daqmx;
mod kind;
mod objects;
mod properties;
mod scales;

use std::io::Read;

use super::bytes::{CutOff, Order, Reader};
use super::channels::{Group, LARGEST, bounded};
use super::layout::Layout;
use objects::{Arrangement, Objects};

/// Contents of a segment.
const DESCRIPTION: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const DAQMX: u32 = 1 << 7;

/// Head of a segment.
#[derive(Clone, Copy, Debug)]
struct Lead {
    contents: u32,
    order: Order,
    /// Bytes of the description.
    described: u64,
    /// Bytes of the values. `None` of a segment that its writer did not finish.
    values: Option<u64>,
}

/// Reads the channels that the layout wants; of others the names. Of a last segment that its writer did not finish, what is there is read.
///
/// # Errors
/// The file is damaged or cut off, or has values of a kind that is not known.
pub(super) fn read(bytes: impl Read, layout: &Layout) -> Result<Vec<Group>, String> {
    bounded(bytes, |bytes| segments(bytes, layout))
}

fn segments(bytes: &mut dyn Read, layout: &Layout) -> Result<Vec<Group>, String> {
    let mut objects = Objects::default();
    loop {
        let lead = upto(bytes, Lead::LENGTH)?;
        if lead.is_empty() {
            return objects.groups();
        }
        let Lead { contents, order, described, values } = Lead::read(&lead)?;
        let has = |content: u32| contents & content != 0;
        let description = upto(bytes, described)?;
        if (description.len() as u64) < described {
            return Err(CutOff.into());
        }
        if has(DESCRIPTION) {
            let mut reader = Reader::new(&description, order);
            objects.describe(&mut reader, has(NEW_LIST), layout)?;
        }
        let data = upto(bytes, values.unwrap_or(LARGEST))?;
        if !has(RAW_DATA) {
            continue;
        }
        let arrangement = match () {
            () if has(DAQMX) => Arrangement::Buffers,
            () if has(INTERLEAVED) => Arrangement::Together,
            () => Arrangement::Pieces,
        };
        let is_whole = objects.take(&data, arrangement, order)?;
        if values.is_some_and(|values| (data.len() as u64) < values || !is_whole) {
            return Err(CutOff.into());
        }
    }
}

impl Lead {
    const LENGTH: u64 = 28;

    fn read(bytes: &[u8]) -> Result<Self, CutOff> {
        let mut reader = Reader::new(bytes, Order::Little);
        if reader.take(4)? != b"TDSm" {
            return Err(CutOff);
        }
        let contents = reader.u32()?;
        // All that follows, the description and the values too, has one order.
        let order = if contents & BIG_ENDIAN != 0 { Order::Big } else { Order::Little };
        let mut reader = Reader::new(reader.rest(), order);
        let (_version, length, described) = (reader.u32()?, reader.u64()?, reader.u64()?);
        let values = match length {
            u64::MAX => None,
            _ => Some(length.checked_sub(described).ok_or(CutOff)?),
        };
        Ok(Self { contents, order, described, values })
    }
}

/// Reads so many bytes, or those that are left.
fn upto(bytes: &mut dyn Read, length: u64) -> Result<Vec<u8>, String> {
    let mut own = Vec::new();
    let read = bytes.take(length).read_to_end(&mut own);
    read.map_err(|error| format!("cannot be read: {error}")).map(|_| own)
}

#[cfg(test)]
mod tests {
    use super::super::channels::Channel;
    use super::*;

    type Properties<'a> = &'a [(&'a str, Result<f64, &'a str>)];

    /// Numbers and texts in an order of bytes.
    struct Writer(Order, Vec<u8>);

    impl Writer {
        fn put<const N: usize>(&mut self, mut little: [u8; N]) {
            if self.0 == Order::Big {
                little.reverse();
            }
            self.1.extend(little);
        }

        fn whole(&mut self, own: u32) {
            self.put(own.to_le_bytes());
        }

        fn text(&mut self, own: &str) {
            self.whole(own.len() as u32);
            self.1.extend(own.as_bytes());
        }
    }

    /// A segment of these channels of the group `cut`, each with `count` doubles a chunk and with these properties.
    fn segment(
        order: Order,
        contents: u32,
        channels: &[&str],
        properties: Properties,
        count: u64,
        values: &[f64],
    ) -> Vec<u8> {
        let mut own = Writer(order, Vec::new());
        own.whole(channels.len() as u32);
        for channel in channels {
            own.text(&format!("/'cut'/'{channel}'"));
            [20, 10, 1].into_iter().for_each(|number| own.whole(number));
            own.put(count.to_le_bytes());
            own.whole(properties.len() as u32);
            for (name, value) in properties {
                own.text(name);
                match value {
                    Ok(value) => {
                        own.whole(10);
                        own.put(value.to_le_bytes());
                    }
                    Err(text) => {
                        own.whole(0x20);
                        own.text(text);
                    }
                }
            }
        }
        let described = own.1.len() as u64;
        values.iter().for_each(|value| own.put(value.to_le_bytes()));
        let mut lead = Writer(order, b"TDSm".to_vec());
        let flag = if order == Order::Big { BIG_ENDIAN } else { 0 };
        lead.1.extend((contents | flag | DESCRIPTION | NEW_LIST | RAW_DATA).to_le_bytes());
        lead.whole(4713);
        lead.put((own.1.len() as u64).to_le_bytes());
        lead.put(described.to_le_bytes());
        [lead.1, own.1].concat()
    }

    /// A segment with three values of the channel `Fz`.
    fn of_one(properties: Properties) -> Vec<u8> {
        segment(Order::Little, 0, &["Fz"], properties, 3, &[1.0, 2.0, 3.0])
    }

    /// The segment as its writer leaves it until it is finished.
    fn unfinished(mut segment: Vec<u8>) -> Vec<u8> {
        segment[12..20].fill(0xFF);
        segment
    }

    fn channels(file: &[u8], names: [&str; 2]) -> Result<Vec<Channel>, String> {
        let axes = [names[0], "", names[1], "", "", ""].map(str::to_owned);
        let layout = Layout { axes, joints: Vec::new(), rate_hz: None, base: None, topics: None };
        read(file, &layout).map(|mut own| own.remove(0).channels)
    }

    fn channel(segments: &[Vec<u8>]) -> Result<Channel, String> {
        channels(&segments.concat(), ["", "Fz"]).map(|mut own| own.remove(0))
    }

    fn values(file: &[u8]) -> Result<[Vec<f64>; 2], String> {
        let own = channels(file, ["Fx", "Fz"])?;
        Ok(["Fx", "Fz"].map(|name| own.iter().find(|own| own.name == name).unwrap().values.clone()))
    }

    #[test]
    fn recordings_are_not_joined() {
        let of = |start_s: f64, period_s: f64| {
            of_one(&[("wf_start_time", Ok(start_s)), ("wf_increment", Ok(period_s))])
        };
        let own = channel(&[of(10.0, 1e-3), of(10.0, 1e-3), of_one(&[])]).unwrap();
        assert_eq!((own.values.len(), own.begins_s, own.period_s), (9, Some(10.0), Some(1e-3)));
        for (other, key) in [(of(60.0, 1e-3), "wf_start_time"), (of(10.0, 2e-3), "wf_increment")] {
            let error = channel(&[of(10.0, 1e-3), other]).unwrap_err();
            let expected = format!(
                "channel \"Fz\" of the group \"cut\" has another {key} after its first values: write each recording into a group of its own"
            );
            assert_eq!(error, expected);
        }
    }

    #[test]
    fn values_are_scaled_and_have_a_unit() {
        let own = channel(&[of_one(&[
            ("unit_string", Err("")),
            ("NI_UnitDescription", Err("kN")),
            ("NI_Number_Of_Scales", Ok(1.0)),
            ("NI_Scale[0]_Scale_Type", Err("Linear")),
            ("NI_Scale[0]_Linear_Slope", Ok(2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", Ok(1.0)),
            ("NI_Scale[0]_Linear_Input_Source", Ok(u32::MAX.into())),
        ])]);
        let own = own.unwrap();
        assert_eq!((&*own.unit, own.values), ("kN", vec![3.0, 5.0, 7.0]));
        let error = channel(&[of_one(&[("NI_Number_Of_Scales", Ok(1.0))])]).unwrap_err();
        assert_eq!(error, "channel \"Fz\" has a scale 0 without Scale_Type: save it scaled");
    }

    /// Two chunks of two instants: in pieces `x x z z`, together `x z x z`.
    #[test]
    fn values_stand_in_pieces_or_together_in_both_orders() {
        let whole = [vec![1.0, 2.0, 3.0, 4.0], vec![-1.0, -2.0, -3.0, -4.0]];
        for order in [Order::Little, Order::Big] {
            let of = |contents, own: &[f64]| segment(order, contents, &["Fx", "Fz"], &[], 2, own);
            let pieces = of(0, &[1.0, 2.0, -1.0, -2.0, 3.0, 4.0, -3.0, -4.0]);
            assert_eq!(values(&pieces).unwrap(), whole);
            let together = of(INTERLEAVED, &[1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0]);
            assert_eq!(values(&together).unwrap(), whole);
        }
    }

    /// The writer of the last segment stopped: of pieces, `Fz` lacks the instants that `Fx` has in the last chunk.
    #[test]
    fn all_channels_of_an_unfinished_segment_have_the_same_instants() {
        let of =
            |contents, own: &[f64]| segment(Order::Little, contents, &["Fx", "Fz"], &[], 2, own);
        let pieces = of(0, &[1.0, 2.0, -1.0, -2.0, 3.0, 4.0, -3.0]);
        let (one, two) =
            ([vec![1.0, 2.0], vec![-1.0, -2.0]], [vec![1.0, 2.0, 3.0], vec![-1.0, -2.0, -3.0]]);
        assert_eq!(values(&unfinished(pieces.clone())).unwrap(), one);
        let together = of(INTERLEAVED, &[1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0]);
        assert_eq!(values(&unfinished(together.clone())).unwrap(), two);
        // A segment that was finished has nothing left over, and all that it states.
        for segment in [&pieces[..], &together, &pieces[..pieces.len() - 8]] {
            assert_eq!(values(segment), Err(CutOff.into()));
        }
    }
}
