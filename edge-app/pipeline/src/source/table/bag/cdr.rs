//! Messages of ROS 2 in CDR, as middleware puts them on the wire (OMG DDSI-RTPS 2.5, section 10): only what a recording needs.
//!
//! Four bytes say the order of bytes. Behind them each number begins at a multiple of its size, at most 8 in CDR and 4 in XCDR2.

use super::super::bytes::{Order, Reader};

/// Most joints of a message, far more than a robot has.
const MOST_JOINTS: u32 = 1024;

/// Layout of a message that holds one vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Vector {
    /// True if a header with a stamp comes first.
    has_header: bool,
    /// Number of doubles before x, y, z.
    before: usize,
}

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stamped<T> {
    /// Stamp, ns since the Unix epoch. `None` where the message has none, or zero.
    pub(super) stamp_ns: Option<u64>,
    pub(super) value: T,
}

impl Vector {
    /// Returns the layout of the messages from which a force is taken, N. `None` for other messages.
    pub(super) fn of_force(name: &str) -> Option<Self> {
        Some(match bare(name)? {
            ("geometry_msgs", "WrenchStamped" | "Vector3Stamped") => {
                Self { has_header: true, before: 0 }
            }
            ("geometry_msgs", "Wrench" | "Vector3") => Self { has_header: false, before: 0 },
            _ => return None,
        })
    }

    /// Returns the layout of the messages from which an acceleration is taken, m/s². `None` for other messages.
    pub(super) fn of_acceleration(name: &str) -> Option<Self> {
        Some(match bare(name)? {
            // Orientation (4), its covariance (9), rate (3) and its covariance (9) come before.
            ("sensor_msgs", "Imu") => Self { has_header: true, before: 25 },
            ("geometry_msgs", "AccelStamped" | "AccelWithCovarianceStamped" | "Vector3Stamped") => {
                Self { has_header: true, before: 0 }
            }
            ("geometry_msgs", "Accel" | "AccelWithCovariance" | "Vector3") => {
                Self { has_header: false, before: 0 }
            }
            _ => return None,
        })
    }

    /// Reads a message. Returns `None` if it is shorter, or no CDR.
    pub(super) fn read(self, message: &[u8]) -> Option<Stamped<[f64; 3]>> {
        let mut reader = Message::new(message)?;
        let stamp_ns = if self.has_header { reader.header()? } else { None };
        for _ in 0..self.before {
            reader.double()?;
        }
        Some(Stamped { stamp_ns, value: [reader.double()?, reader.double()?, reader.double()?] })
    }
}

/// Returns whether messages of this name hold the positions of joints.
pub(super) fn is_of_joints(name: &str) -> bool {
    bare(name) == Some(("sensor_msgs", "JointState"))
}

/// Reads the positions of the joints of these names from a `sensor_msgs/JointState`, rad or m. Those that it does not have are NaN: a robot and
/// its gripper may write in turn. Returns `None` if the message is shorter, or no CDR.
pub(super) fn joints(message: &[u8], names: &[String]) -> Option<Stamped<Vec<f64>>> {
    let mut reader = Message::new(message)?;
    let stamp_ns = reader.header()?;
    let count = reader.count()?;
    let places: Vec<Option<usize>> = (0..count)
        .map(|_| reader.text().map(|own| names.iter().position(|name| name.as_bytes() == own)))
        .collect::<Option<_>>()?;
    let mut value = vec![f64::NAN; names.len()];
    for place in 0..reader.count()? {
        let position = reader.double()?;
        if let Some(Some(own)) = places.get(place as usize) {
            value[*own] = position;
        }
    }
    Some(Stamped { stamp_ns, value })
}

/// Returns the names of the joints of a `sensor_msgs/JointState`. Returns `None` if the message is shorter, or no CDR.
pub(super) fn joint_names(message: &[u8]) -> Option<Vec<String>> {
    let mut reader = Message::new(message)?;
    reader.header()?;
    let count = reader.count()?;
    (0..count).map(|_| Some(String::from_utf8_lossy(reader.text()?).into_owned())).collect()
}

/// Returns package and name of a message: `geometry_msgs/msg/Wrench` or `geometry_msgs/Wrench`.
fn bare(name: &str) -> Option<(&str, &str)> {
    let (package, rest) = name.split_once('/')?;
    Some((package, rest.strip_prefix("msg/").unwrap_or(rest)))
}

/// Reads a message from its beginning.
struct Message<'a>(Reader<'a>);

impl<'a> Message<'a> {
    fn new(message: &'a [u8]) -> Option<Self> {
        let (head, bytes) = message.split_first_chunk::<4>()?;
        let (order, alignment) = match head[..2] {
            [0, 0] => (Order::Big, 8),
            [0, 1] => (Order::Little, 8),
            [0, 6] => (Order::Big, 4),
            [0, 7] => (Order::Little, 4),
            _ => return None,
        };
        Some(Self(Reader::aligned(bytes, order, alignment)))
    }

    fn double(&mut self) -> Option<f64> {
        self.0.f64().ok()
    }

    /// Returns the length of a sequence.
    fn count(&mut self) -> Option<u32> {
        self.0.u32().ok().filter(|count| *count <= MOST_JOINTS)
    }

    /// Returns a text without its closing zero.
    fn text(&mut self) -> Option<&'a [u8]> {
        let text = self.0.text().ok()?;
        Some(text.strip_suffix(&[0]).unwrap_or(text))
    }

    /// Reads a header: the stamp, ns, and the name of a frame.
    fn header(&mut self) -> Option<Option<u64>> {
        let (seconds, nanoseconds) = (self.0.u32().ok()? as i32, self.0.u32().ok()?);
        self.text()?;
        let stamp_ns =
            u64::try_from(seconds).ok().map(|own| own * 1_000_000_000 + u64::from(nanoseconds));
        Some(stamp_ns.filter(|stamp_ns| *stamp_ns > 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes the parts of a message in an order of bytes.
    struct Writer(Vec<u8>, bool, usize);

    impl Writer {
        fn new(is_big_endian: bool, is_second: bool) -> Self {
            let form = match (is_big_endian, is_second) {
                (true, false) => 0,
                (false, false) => 1,
                (true, true) => 6,
                (false, true) => 7,
            };
            Self(vec![0, form, 0, 0], is_big_endian, if is_second { 4 } else { 8 })
        }

        fn put(&mut self, bytes: &[u8]) {
            let size = bytes.len().min(self.2);
            while !(self.0.len() - 4).is_multiple_of(size) {
                self.0.push(0xAA);
            }
            let own: Vec<u8> =
                if self.1 { bytes.iter().rev().copied().collect() } else { bytes.to_vec() };
            self.0.extend(own);
        }

        fn text(&mut self, text: &str) {
            self.put(&(text.len() as u32 + 1).to_le_bytes());
            self.0.extend(text.as_bytes());
            self.0.push(0);
        }

        fn header(&mut self) {
            self.put(&1767000000_u32.to_le_bytes());
            self.put(&500_u32.to_le_bytes());
            self.text("tool0");
        }
    }

    #[test]
    fn both_orders_of_bytes_are_read() {
        for (is_big_endian, is_second) in
            [(false, false), (true, false), (false, true), (true, true)]
        {
            let mut imu = Writer::new(is_big_endian, is_second);
            imu.header();
            for value in 0..37 {
                imu.put(&f64::from(value).to_le_bytes());
            }
            let layout = Vector::of_acceleration("sensor_msgs/msg/Imu").unwrap();
            let stamped = layout.read(&imu.0).unwrap();
            assert_eq!(stamped.value, [25.0, 26.0, 27.0]);
            assert_eq!(stamped.stamp_ns, Some(1_767_000_000_000_000_500));

            let mut state = Writer::new(is_big_endian, is_second);
            state.header();
            state.put(&3_u32.to_le_bytes());
            ["b", "gripper", "a"].into_iter().for_each(|name| state.text(name));
            state.put(&3_u32.to_le_bytes());
            [1.0_f64, 2.0, 3.0].into_iter().for_each(|own| state.put(&own.to_le_bytes()));
            let names = ["a", "b", "c"].map(str::to_owned);
            let read = joints(&state.0, &names).unwrap().value;
            assert_eq!(read[..2], [3.0, 1.0]);
            assert!(read[2].is_nan());
            for length in 0..state.0.len() {
                assert_eq!(joints(&state.0[..length], &names), None, "{length}");
            }
        }
    }

    #[test]
    fn a_message_may_have_no_stamp() {
        let mut force = Writer::new(false, false);
        [1.0_f64, 2.0, 3.0].into_iter().for_each(|own| force.put(&own.to_le_bytes()));
        let read = Vector::of_force("geometry_msgs/Wrench").unwrap().read(&force.0);
        assert_eq!(read, Some(Stamped { stamp_ns: None, value: [1.0, 2.0, 3.0] }));
        assert_eq!(Vector::of_force("sensor_msgs/msg/Imu"), None);
        force.0[1] = 3;
        assert_eq!(Vector::of_force("geometry_msgs/Wrench").unwrap().read(&force.0), None);
    }
}
