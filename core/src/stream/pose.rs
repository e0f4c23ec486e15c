//! The joint angles of a stretch: for how long a reading holds, and what it is worth.
//!
//! A reading that leaves the pose is doubted until a reading that is at the pose again would have come. If one does, it was wrong: no
//! joint leaps away and back in that time. If none does, the joint has moved.
//!
//! A start or a stop shakes the robot by forces that no sensor measures. A joint that has moved therefore stood still only up to the first, and
//! again from the last, of the readings that lead one way.

use heapless::Vec;

use super::clock::SET_BACK_S;
use super::config::{AngleSignal, StreamConfig};
use super::record::{MAX_PARTS, Stage};
use super::sender::{CYCLE_S, Rest, Sender};
use super::track::Track;
use crate::MAX_JOINTS;

/// Largest movement of a joint within one pose, rad or m, where its signal has smaller steps. A pose wrong by 1e-3 rad biases
/// stiffnesses by 1 %.
pub const STATIC: f64 = 5e-4;

/// Largest movement of a joint one way that is none, rad or m. Chosen: a hundredth of [`STATIC`]; a feed of 1 mm/s at 1 m takes 5 ms for it.
const CREEP: f64 = 0.01 * STATIC;

/// Change of a rate within a part of a record, in the largest rate of a joint in the record, from which on the robot does not move evenly. Chosen: a
/// straight line changes rates within a part by half its movement, 0.005; a start, a stop and a corner by the rate itself.
const UNEVEN: f64 = 0.02;
/// Steps of the signal by which the rates of the halves of a part may differ, in its length. Each of three readings is off by half a step: `2 · 4 · ½`.
const STEPS: f64 = 4.0;

/// Readings of one place: each lies within [`STATIC`] of the first, or all lie within one step of the signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Place {
    /// The first of them, rad (m).
    pub(super) first: f64,
    /// Distance of the lowest and the highest from the first, rad (m).
    extent: [f64; 2],
}

impl Place {
    fn new(first: f64) -> Self {
        Self { first, extent: [0.0; 2] }
    }

    /// The place with another reading; `None` if it is elsewhere. `step` is that of the signal, rad (m).
    fn with(&self, angle: f64, step: f64, signal: &AngleSignal) -> Option<Self> {
        let (off, [low, high]) = (signal.difference(angle, self.first), self.extent);
        let extent = [low.min(off), high.max(off)];
        let is_near = extent.iter().all(|off| off.abs() <= STATIC);
        // Differences of floating point numbers are not exact.
        let is_within_a_step = extent[1] - extent[0] <= step * (1.0 + 1e-6);
        (is_near || is_within_a_step).then_some(Self { extent, ..*self })
    }
}

/// Readings away from the pose, the newest of which agree with each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Doubt {
    /// Place of those that agree.
    pub(super) place: Place,
    /// Samples of the stretch when the first of those came that agree and no longer lead one way.
    samples: usize,
    /// Samples of the stretch when the newest reading came.
    confirmed: usize,
    /// Number of all these readings.
    pub(super) readings: u32,
    /// Distance of the first of all from the pose, rad (m).
    pub(super) by: f64,
    /// Arrival of the first of all, s.
    since_s: f64,
    /// Samples of the stretch during which the joint is known to have stood still before.
    pub(super) since: usize,
    /// The first of all is farther from the reading before than a joint that moves on, and turns, would be.
    leaps: bool,
}

/// Readings in a row that lead one way: a joint that starts, or comes to rest.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    /// Distance over all of them, rad (m).
    by: f64,
    /// Samples of the stretch during which the joint is known to have stood still before.
    from: usize,
    /// True if the newest reading leads the same way as the one before.
    goes_on: bool,
    /// Distance of the newest reading from the one before, rad (m).
    step: f64,
}

impl Run {
    /// Takes a reading that differs by `change`, rad (m), from the one before, when the joint was known to have stood still for `standing` samples.
    fn note(&mut self, change: f64, standing: usize) {
        let goes_on = change * self.by > 0.0;
        *self = match goes_on {
            true => Self { by: self.by + change, step: change, ..*self },
            false => Self { by: change, from: standing, goes_on, step: change },
        };
        self.goes_on = goes_on && self.moves();
    }

    /// Returns whether a `change` from the newest reading is none of a joint that moves on as before, of whose readings one may have been lost.
    fn is_left_by(&self, change: f64) -> bool {
        change.abs() > STATIC + 2.0 * self.step.abs()
    }

    /// Returns whether the joint moves.
    fn moves(&self) -> bool {
        self.by.abs() > CREEP
    }
}

/// Joint angles over a stretch.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    angles: [Angle; MAX_JOINTS],
}

#[derive(Clone, Debug, Default)]
struct Angle {
    sender: Sender,
    track: Track,
    run: Run,
    place: Place,
    /// Samples of the stretch when the joint was first read at rest at the place.
    since: usize,
    /// True until the joint has come to rest at the place.
    arrives: bool,
    /// Sum of the readings' distances from the first.
    sum: f64,
    readings: u32,
    /// Samples of the stretch when the angle was last read; `None` if it has not come since the last gap.
    confirmed: Option<usize>,
    rest: Rest,
    doubt: Option<Doubt>,
}

impl Angle {
    /// Takes the first readings at a place, the first and the newest when the stretch had so many samples.
    fn begin(&mut self, place: Place, [since, confirmed]: [usize; 2]) {
        let (sender, run) = (self.sender, self.run);
        let track = core::mem::take(&mut self.track);
        let (readings, confirmed, arrives) = (1, Some(confirmed), run.goes_on);
        *self = Self {
            sender,
            track,
            run,
            place,
            since,
            arrives,
            readings,
            confirmed,
            ..Self::default()
        };
    }

    /// Samples, of so many, up to which the track is known; `notice` is [`NOTICE_S`](super::sender::NOTICE_S) in samples.
    fn known(&self, samples: usize, notice: usize) -> usize {
        let read = self.doubt.map(|doubt| doubt.confirmed).max(self.confirmed).unwrap_or(0);
        match self.sender.is_cyclic() || self.readings == 0 {
            true => read,
            false => read.max(samples.saturating_sub(notice)),
        }
    }

    /// Samples, of so many, during which the joint is known to have stood still; `notice` is [`NOTICE_S`](super::sender::NOTICE_S) in samples.
    fn standing(&self, samples: usize, notice: usize) -> usize {
        let samples = self.doubt.map_or(samples, |doubt| doubt.since.min(samples));
        let confirmed = self.confirmed.unwrap_or(0);
        let confirmed = if self.run.moves() { confirmed.min(self.run.from) } else { confirmed };
        match self.sender.is_cyclic() || self.readings == 0 {
            true => confirmed,
            false => confirmed.max(samples.saturating_sub(notice)),
        }
    }
}

impl Pose {
    /// Takes a joint's angle, read at `time_s` when the stretch has `samples`, or `arrived` of them with those that wait for their frames. Returns the doubt that it shows to be wrong.
    pub(super) fn read(
        &mut self,
        joint: usize,
        angle: f64,
        time_s: f64,
        [samples, arrived]: [usize; 2],
        signal: &AngleSignal,
        spacing: usize,
    ) -> Option<Doubt> {
        let known = &mut self.angles[joint];
        // Whole turns of a joint that turns are none.
        let before = known.track.newest().unwrap_or(angle);
        known.track.read(arrived, before + signal.difference(angle, before), spacing);
        // Equal readings differ by nothing, and sums of differences by their rounding.
        let change =
            known.sender.newest.map_or(0.0, |(newest, _)| signal.difference(angle, newest));
        let leaps = known.run.is_left_by(change);
        // A sender whose silence proves nothing may turn out to be one on change only now.
        known.run.note(change, known.standing(samples, 0));
        let before_s = known.sender.newest.map_or(time_s, |(_, before_s)| before_s);
        known.sender.note(angle, time_s, signal);
        if known.readings == 0 {
            known.begin(Place::new(angle), [samples; 2]);
            return None;
        }
        let step = signal.resolution.max(known.sender.step());
        if let Some(place) = known.place.with(angle, step, signal) {
            known.sum += signal.difference(angle, place.first);
            (known.place, known.readings) = (place, known.readings + 1);
            known.confirmed = Some(samples);
            known.arrives &= known.run.goes_on;
            if known.arrives {
                known.since = arrived;
            }
            known.rest.note(time_s - before_s);
            known.sender.note_rest(&known.rest);
            return known.doubt.take().filter(|doubt| doubt.leaps);
        }
        let new = Doubt {
            leaps,
            place: Place::new(angle),
            samples: arrived,
            confirmed: samples,
            readings: 1,
            by: signal.difference(angle, known.place.first).abs(),
            since_s: time_s,
            since: known.run.from,
        };
        known.doubt = Some(known.doubt.map_or(new, |doubt| {
            let readings = doubt.readings.saturating_add(1);
            let (place, samples) = match doubt.place.with(angle, step, signal) {
                Some(place) if known.run.goes_on => (place, new.samples),
                Some(place) => (place, doubt.samples),
                None => (new.place, new.samples),
            };
            Doubt { place, samples, confirmed: new.samples, readings, ..doubt }
        }));
        None
    }

    /// The first joint that has been away from the pose for so long at `now_s` that it has moved.
    pub(super) fn moved(&self, now_s: f64) -> Option<(usize, Doubt)> {
        let has_moved = |(joint, angle): (usize, &Angle)| {
            let doubt = angle.doubt?;
            let recent = -SET_BACK_S..=angle.sender.notice_s();
            (!recent.contains(&(now_s - doubt.since_s))).then_some((joint, doubt))
        };
        self.angles.iter().enumerate().find_map(has_moved)
    }

    /// True if a reading of any joint is away from the pose.
    pub(super) fn is_in_doubt(&self) -> bool {
        self.angles.iter().any(|angle| angle.doubt.is_some())
    }

    /// Samples of the stretch when the last of the joints that are away from the pose was first read where it is.
    pub(super) fn arrived(&self) -> usize {
        let doubts = self.angles.iter().filter_map(|angle| angle.doubt);
        doubts.map(|doubt| doubt.samples).max().unwrap_or(0)
    }

    /// Takes the place where a joint has gone for its pose.
    pub(super) fn settle(&mut self, joint: usize) {
        let angle = &mut self.angles[joint];
        if let Some(doubt) = angle.doubt {
            angle.begin(doubt.place, [doubt.samples, doubt.confirmed]);
        }
    }

    /// The step of a joint's signal, as its readings show it, rad; 0 if they do not.
    pub(super) fn step(&self, joint: usize) -> f64 {
        self.angles[joint].sender.step()
    }

    /// The first of `joints` whose angle is not known.
    pub(super) fn unknown(&self, joints: usize) -> Option<usize> {
        self.angles[..joints].iter().position(|angle| angle.readings == 0)
    }

    /// Those of `joints` whose angle has never come or is forgotten, or used to come in a cycle and no longer does at `now_s`.
    pub(super) fn awaited(&self, joints: usize, now_s: f64) -> impl Iterator<Item = usize> {
        let is_awaited = move |angle: &Angle| match angle.sender.newest {
            None => true,
            Some((_, newest_s)) => angle.sender.is_cyclic() && now_s - newest_s > CYCLE_S,
        };
        let all = self.angles[..joints].iter().enumerate();
        all.filter(move |(_, angle)| is_awaited(angle)).map(|(joint, _)| joint)
    }

    /// Number of the oldest `samples` during which every joint is known to have stood still; `notice` is [`NOTICE_S`](super::sender::NOTICE_S) in samples.
    pub(super) fn standing(&self, joints: usize, samples: usize, notice: usize) -> usize {
        let standing = |angle: &Angle| angle.standing(samples, notice);
        self.angles[..joints].iter().map(standing).min().unwrap_or(0)
    }

    /// Number of samples of [`standing`](Self::standing) where the stretch ends: the next angle of a cyclic sender was not due yet, or one was lost.
    pub(super) fn standing_at_end(
        &self,
        joints: usize,
        samples: usize,
        notice: usize,
        rate_hz: f64,
    ) -> usize {
        let standing = |angle: &Angle| {
            let cycles = (2.0 * angle.sender.cycle_s * rate_hz) as usize;
            match (angle.doubt, angle.sender.is_cyclic()) {
                (Some(_), _) => angle.standing(samples, notice),
                (None, true) => angle
                    .confirmed
                    .map_or(0, |confirmed| samples.min(confirmed + cycles.max(notice))),
                (None, false) => samples,
            }
        };
        self.angles[..joints].iter().map(standing).min().unwrap_or(0)
    }

    /// Number of the oldest `samples` over which every joint's [`Track`] is known; `notice` is [`NOTICE_S`](super::sender::NOTICE_S) in samples.
    pub(super) fn known(&self, joints: usize, samples: usize, notice: usize) -> usize {
        let known = |angle: &Angle| angle.known(samples, notice);
        self.angles[..joints].iter().map(known).min().unwrap_or(0)
    }

    /// Samples of the stretch when the last joint came to rest where it is. `None` while a reading is away from the pose.
    pub(super) fn rests_since(&self, joints: usize) -> Option<usize> {
        let since = self.angles[..joints].iter().map(|angle| angle.since).max();
        since.filter(|_| !self.is_in_doubt())
    }

    /// Largest movement of a joint in any of so many equal parts of the oldest `samples`, rad (m).
    pub(super) fn moves(&self, joints: usize, samples: usize, parts: usize) -> f64 {
        let length = samples as f64 / parts as f64;
        let of_part = |angle: &Angle, part: usize| {
            angle.track.extent([part as f64 * length, (part + 1) as f64 * length])
        };
        let all = self.angles[..joints].iter();
        all.flat_map(|angle| (0..parts).map(move |part| of_part(angle, part))).fold(0.0, f64::max)
    }

    /// Returns whether a joint has moved farther than `most` between two readings after sample `from` of the stretch, or within `samples` from then
    /// to the newest, rad (m).
    pub(super) fn leaps(
        &self,
        joint: usize,
        [from, to]: [usize; 2],
        samples: usize,
        most: f64,
    ) -> bool {
        let Angle { track, .. } = &self.angles[joint];
        let mut starts = (from..to).step_by(samples);
        let is_fast = |start: usize| track.extent([start as f64, (start + samples) as f64]) > most;
        track.step_after(from) > most || starts.any(is_fast)
    }

    /// Stages in so many equal parts of the oldest `samples`, where the track is known over the oldest `known`.
    pub(super) fn path(
        &self,
        config: &StreamConfig,
        [samples, known]: [usize; 2],
        parts: usize,
    ) -> Vec<Stage, MAX_PARTS> {
        let length = samples as f64 / parts as f64;
        let ends = |part: f64| [part * length, (part + 1.0) * length];
        let angles = &self.angles[..config.joints];
        let rates = |part| angles.iter().map(move |angle| angle.track.rates(ends(part)));
        let each = || (0..parts).map(|part| part as f64);
        let fastest = each().flat_map(rates).flatten().fold(0.0, |most, own| own.abs().max(most));
        let is_even = |part| {
            let [from, to] = ends(part);
            let is_known =
                to <= known as f64 && angles.iter().all(|angle| angle.track.reaches(from));
            let signals = angles.iter().zip(&config.angles);
            is_known
                && rates(part).zip(signals).all(|([before, after], (angle, signal))| {
                    let step = signal.resolution.max(angle.sender.step());
                    (after - before).abs() <= UNEVEN * fastest + STEPS * step / length
                })
        };
        let stage = |part| Stage {
            pose: angles.iter().map(|angle| angle.track.mean(ends(part))).collect(),
            moves: angles.iter().map(|angle| angle.track.extent(ends(part))).fold(0.0, f64::max),
            // A ramp of the feed ends in the part beside it.
            is_even: [part - 1.0, part, part + 1.0].into_iter().all(is_even),
        };
        each().map(stage).collect()
    }

    /// Mean angles.
    pub(super) fn mean(&self, joints: usize) -> Vec<f64, MAX_JOINTS> {
        let mean = |angle: &Angle| angle.place.first + angle.sum / f64::from(angle.readings.max(1));
        self.angles[..joints].iter().map(mean).collect()
    }

    /// Takes note that the oldest `samples` of the stretch are gone.
    pub(super) fn discard(&mut self, samples: usize) {
        for angle in &mut self.angles {
            angle.confirmed = angle.confirmed.map(|confirmed| confirmed.saturating_sub(samples));
            angle.since = angle.since.saturating_sub(samples);
            angle.run.from = angle.run.from.saturating_sub(samples);
            angle.track.discard(samples);
            if let Some(doubt) = &mut angle.doubt {
                doubt.samples = doubt.samples.saturating_sub(samples);
                doubt.confirmed = doubt.confirmed.saturating_sub(samples);
                doubt.since = doubt.since.saturating_sub(samples);
            }
        }
    }

    /// Takes note of a gap in the stretch: all its samples are gone, and the angle of a cyclic sender must come again.
    pub(super) fn interrupt(&mut self) {
        self.discard(usize::MAX);
        for angle in &mut self.angles {
            angle.confirmed = None;
            angle.track.restart();
        }
    }

    /// Begins another stretch. The angle of a cyclic sender must come again, that of any other sender holds. A forgotten angle
    /// stays forgotten.
    pub(super) fn renew(&mut self) {
        for angle in &mut self.angles {
            let sender = angle.sender;
            *angle = Angle { sender, ..Angle::default() };
            if let Some((newest, _)) = sender.newest.filter(|_| !sender.is_cyclic()) {
                angle.track.read(0, newest, 1);
                angle.begin(Place::new(newest), [0; 2]);
            }
        }
    }

    /// Forgets all angles, after a silence in which every joint may have moved.
    pub(super) fn forget_all(&mut self) {
        for angle in &mut self.angles {
            let mut sender = angle.sender;
            sender.forget();
            *angle = Angle { sender, ..Angle::default() };
        }
    }
}
