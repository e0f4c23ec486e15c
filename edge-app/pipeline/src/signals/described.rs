//! The table as text, by which a kept state knows its signals.

use flexid_wire::bits::{Number, Signal};

use super::message::Content;
use super::{Clocks, SignalTable};

impl SignalTable {
    /// Returns all messages as text. Equal tables give equal texts.
    pub(crate) fn described(&self) -> String {
        if self.is_of_columns() {
            return format!("{:?} {:?}", self.axes, self.joints);
        }
        let mut plain: Vec<String> = Vec::new();
        for (id, message) in &self.messages {
            let contents: Option<Vec<String>> =
                message.contents.iter().map(|content| self.plain(content)).collect();
            let Some(contents) = contents else {
                return format!("{:?} {:?} {:?}", self.clocks, self.messages, self.sensors);
            };
            let (length, contents) = (message.length, contents.join(", "));
            plain.push(format!("{id:?} Message {{ length: {length}, contents: [{contents}] }}"));
        }
        plain.sort();
        plain.concat()
    }

    /// Returns a content as kept states describe it: integers, in one frame a sample with the common counter. `None` of any other.
    fn plain(&self, content: &Content) -> Option<String> {
        let signal = |own: &Signal| {
            let signed = match own.number {
                Number::Signed => true,
                Number::Unsigned => false,
                _ => return None,
            };
            let Signal { start_bit, length, byte_order, scale, offset, .. } = own;
            Some(format!(
                "Signal {{ start_bit: {start_bit}, length: {length}, byte_order: {byte_order:?}, signed: {signed}, scale: {scale:?}, offset: {offset:?} }}"
            ))
        };
        match content {
            Content::Joint { index, value } => {
                Some(format!("Joint {{ index: {index}, value: {} }}", signal(value)?))
            }
            Content::Part(part) => {
                let sensor = &self.sensors[part.sensor];
                if self.clocks != Clocks::Common || sensor.parts != 1 || sensor.map.is_some() {
                    return None;
                }
                let name = ["Force", "Acceleration"][part.sensor];
                let axes: Option<Vec<String>> =
                    part.channels.iter().map(|(_, own)| signal(own)).collect();
                let (counter, axes) = (signal(&part.counter?)?, axes?.join(", "));
                Some(format!("{name} {{ counter: {counter}, axes: [{axes}] }}"))
            }
        }
    }
}
