//! Where the robot goes in a record along a path.

use flexid_core::chain::Chain;
use flexid_core::stream::Stage;
use nalgebra::Vector3;

use crate::record::{Record, goes_on};

/// Motion of the robot in a record along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Travel {
    /// Number of the path, from 1. A record that begins where the one along a path before it ended is on the same path.
    pub path: u64,
    /// Equal parts of the record, in their order.
    pub parts: Vec<Station>,
    /// Length of a part, s.
    pub part_s: f64,
}

/// Where the robot is in a part.
#[derive(Clone, Debug, PartialEq)]
pub struct Station {
    /// Mean joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Place of the TCP at that pose, along the axes of the base, m.
    pub tool_m: Vector3<f64>,
    /// Largest movement of a joint, rad (m).
    pub moves: f64,
    /// True if the robot moves evenly: a fit takes the part.
    pub is_even: bool,
}

impl Travel {
    /// Motion in a record; `None` where the robot stands. `before` is that of the record along a path before it, if there is one.
    pub(super) fn of(record: &Record, chain: &Chain, before: Option<&Self>) -> Option<Self> {
        let station = |Stage { pose, moves, is_even }: &Stage| Station {
            pose: pose.to_vec(),
            tool_m: chain.tool(pose).translation.vector,
            moves: *moves,
            is_even: *is_even,
        };
        let parts: Vec<Station> = record.path.iter().map(station).collect();
        let first = parts.first()?;
        let part_s = record.force[0].len() as f64 / record.rate_hz / parts.len() as f64;
        let is_same = |before: &Self| {
            before.parts.last().is_some_and(|last| goes_on(&last.pose, &first.pose))
        };
        let goes_on = before.is_some_and(is_same);
        let path = before.map_or(0, |before| before.path) + u64::from(!goes_on);
        Some(Self { path, parts, part_s })
    }

    /// Length of the way of the TCP in the record, m: between the middles of the parts, and half a part before and behind.
    pub fn length_m(&self) -> f64 {
        let parts = self.parts.len() as f64;
        self.steps().map(|(_, length)| length).sum::<f64>() * parts / (parts - 1.0).max(1.0)
    }

    /// Lengths of the even feed of the TCP between neighbouring parts, over their time, m/s.
    pub fn feeds_m_per_s(&self) -> impl Iterator<Item = f64> {
        self.steps().filter(|(is_even, _)| *is_even).map(|(_, length)| length / self.part_s)
    }

    /// Largest rate of a joint in an even part, rad/s (m/s). Zero without any.
    pub fn rate(&self) -> f64 {
        self.even().map(|part| part.moves / self.part_s).fold(0.0, f64::max)
    }

    /// Time in which the robot moves evenly, s.
    pub fn even_s(&self) -> f64 {
        self.even().count() as f64 * self.part_s
    }

    /// The parts that a fit takes.
    pub fn even(&self) -> impl Iterator<Item = &Station> {
        self.parts.iter().filter(|part| part.is_even)
    }

    /// Ways between the middles of neighbouring parts, m, and whether both are even.
    fn steps(&self) -> impl Iterator<Item = (bool, f64)> {
        self.parts.windows(2).map(|pair| {
            let [from, to] = pair else { return (false, 0.0) };
            (from.is_even && to.is_even, (to.tool_m - from.tool_m).norm())
        })
    }
}
