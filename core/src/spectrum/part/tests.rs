//! A divided record against records of the samples of its parts alone.

use crate::refine::tests::divided::{self, PARTS, alone, stage};
use crate::refine::tests::{BINS, SAMPLES, chain, measurement};
use crate::spectrum::{Experiment, Measurement, Spectrum, SpectrumError};
use crate::stream::{Record, Stage};

/// Moves of a part: no two are alike.
fn moves(part: usize) -> f64 {
    1e-3 * (1.0 + part as f64)
}

/// A record along a path of so many parts in which the robot moves.
fn along(parts: usize) -> Record<SAMPLES> {
    let mut record = divided::along(parts);
    for (part, stage) in record.path.iter_mut().enumerate() {
        stage.moves = moves(part);
    }
    record
}

/// A record that is twice as long, along a path of so many parts.
fn twice(parts: usize) -> Record<{ 2 * SAMPLES }> {
    let Record { force, acceleration, .. } = along(PARTS);
    let twice =
        |signal: &heapless::Vec<f32, SAMPLES>| signal.iter().chain(signal).copied().collect();
    let [force, acceleration] = [force, acceleration].map(|signals| signals.each_ref().map(twice));
    let path = (0..parts).map(|part| Stage { moves: moves(part), ..stage(part) }).collect();
    let own = along(PARTS);
    Record {
        force,
        acceleration,
        path,
        start_s: own.start_s,
        pose: own.pose,
        since_s: own.since_s,
        rate_hz: own.rate_hz,
        force_noise: own.force_noise,
        acceleration_noise: own.acceleration_noise,
        force_noise_shape: own.force_noise_shape,
        acceleration_noise_shape: own.acceleration_noise_shape,
        has_doubtful_rate: own.has_doubtful_rate,
        starts_at_rest: own.starts_at_rest,
        point: own.point,
    }
}

/// The measurement in a narrow band: the parts of a record that is twice as long have room.
fn narrow() -> Measurement {
    Measurement { band_hz: [5.0, 36.2], ..measurement() }
}

fn experiment<const N: usize>(
    record: &Record<N>,
    measurement: &Measurement,
) -> Result<Experiment<BINS>, SpectrumError> {
    Experiment::new(&chain(), measurement, record, &mut [0.0; N])
}

/// Values of all axes, real parts and then imaginary ones, in these bins.
fn values(spectrum: &Spectrum<BINS>, bins: core::ops::Range<usize>) -> std::vec::Vec<f32> {
    let parts = spectrum.re.iter().chain(&spectrum.im);
    parts.flat_map(|part| part[bins.clone()].iter().copied()).collect()
}

/// Asserts that a part of a divided experiment is what the experiment of its samples alone is.
fn assert_is(divided: &Experiment<BINS>, place: usize, alone: &Experiment<BINS>) {
    let part = divided.parts().nth(place).unwrap();
    let bins = || part.bins.clone();
    assert_eq!(part.site.pose, &alone.pose[..], "pose of part {place}");
    assert_eq!(bins().len(), alone.bins(), "bins of part {place}");
    for (own, other) in
        [(&divided.force, &alone.force), (&divided.acceleration, &alone.acceleration)]
    {
        assert!(values(own, bins()) == values(other, 0..alone.bins()), "spectra of part {place}");
    }
    let noises = |of: &Experiment<BINS>, bins: core::ops::Range<usize>| -> std::vec::Vec<f32> {
        let all = of.force_noise.iter().chain(&of.acceleration_noise).chain(&of.broad_noise);
        all.flat_map(|noise| noise[bins.clone()].iter().copied()).collect()
    };
    assert!(noises(divided, bins()) == noises(alone, 0..alone.bins()), "noise of part {place}");
    for bin in bins() {
        assert_eq!(divided.omega(bin), alone.omega(bin - bins().start), "bin {bin}");
    }
}

#[test]
fn a_part_is_what_a_record_of_its_samples_is() {
    let (record, measurement) = (along(PARTS), measurement());
    let divided = experiment(&record, &measurement).unwrap();
    assert_eq!((divided.path.len(), divided.divided), (PARTS, PARTS));
    for part in 0..PARTS {
        let own = experiment(&alone(&record, part), &measurement).unwrap();
        assert_is(&divided, part, &own);
    }
    // Noise along the frequency, so that it could differ.
    let noise = &divided.acceleration_noise[0];
    assert!(noise[0] > 2.0 * noise[divided.bins_of_part() - 1]);
}

/// The poses of neighbours are 0.01 and -0.02 rad apart, at the ends as in between; a record of a single part has no rates.
#[test]
fn the_rates_of_a_part_are_those_of_the_path() {
    let (record, measurement) = (along(PARTS), measurement());
    let divided = experiment(&record, &measurement).unwrap();
    for part in divided.parts() {
        let [one, other] = part.site.rates else { panic!("{:?}", part.site) };
        let length = divided.length();
        assert!((one * length - 0.01).abs() < 1e-12 && (other * length + 0.02).abs() < 1e-12);
    }
    assert!(divided.feeds());
    let standing = experiment(&alone(&record, 0), &measurement).unwrap();
    assert!(standing.site().rates.is_empty() && !standing.feeds());
    assert!(standing.parts().all(|part| part.site.rates.is_empty()));
}

/// In each part the delay has grown since the start of the record, and since the time before it. Single precision rounds the time of a
/// value to 1e-7 of the record, and the derivative of the highest bin is 200 times the value.
#[test]
fn the_delay_of_a_part_has_grown_since_the_start_of_the_record() {
    for before_s in [0.0, 3.7] {
        let (mut record, measurement) = (along(PARTS), measurement());
        record.since_s = before_s;
        let divided = experiment(&record, &measurement).unwrap();
        for part in 0..PARTS {
            let own = experiment(&alone(&record, part), &measurement).unwrap();
            let bins = divided.parts().nth(part).unwrap().bins;
            let (found, expected) =
                (values(&divided.drift, bins), values(&own.drift, 0..own.bins()));
            let size = expected.iter().copied().map(f32::abs).fold(0.0, f32::max);
            let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-4 * size, "{before_s} s, part {part}: {apart} of {size}");
        }
    }
}

#[test]
fn a_part_in_which_the_robot_does_not_move_evenly_is_left_out() {
    let mut record = twice(2 * PARTS);
    let all = experiment(&record, &narrow()).unwrap();
    record.path[1].is_even = false;
    let divided = experiment(&record, &narrow()).unwrap();
    assert_eq!((divided.path.len(), divided.divided), (2 * PARTS - 1, 2 * PARTS));
    let bins = |part: usize| part * all.bins_of_part()..(part + 1) * all.bins_of_part();
    for (place, part) in [0, 2, 3, 4, 5, 6, 7].into_iter().enumerate() {
        assert_eq!(divided.path[place], all.path[part]);
        let signals = [(&divided.force, &all.force), (&divided.acceleration, &all.acceleration)];
        let are_equal = |(own, all)| values(own, bins(place)) == values(all, bins(part));
        assert!(signals.into_iter().all(are_equal), "part {part}");
    }
    let whole_s = 2.0 * SAMPLES as f64 / record.rate_hz;
    assert!((divided.duration() - whole_s).abs() < 1e-12, "{} s", divided.duration());
}

/// 51 bins are 12 a part, fewer than the 16 that a part needs; two parts of 25 have enough. 30 are enough for one part, which tells no rate.
#[test]
fn parts_are_merged_where_the_band_is_narrow() {
    let up_to_20_hz = Measurement { band_hz: [5.0, 20.0], ..measurement() };
    let refused = experiment(&along(PARTS), &up_to_20_hz).err();
    assert!(matches!(refused, Some(SpectrumError::Bins(bins)) if bins < 32), "{refused:?}");
    for (most_hz, parts) in [(60.0, 4), (30.0, 2)] {
        let measurement = Measurement { band_hz: [5.0, most_hz], ..measurement() };
        let record = along(PARTS);
        let merged = experiment(&record, &measurement).unwrap();
        assert_eq!(merged.path.len(), parts, "up to {most_hz} Hz");
        let each = PARTS / parts;
        for (place, own) in merged.path.iter().enumerate() {
            let of = || place * each..(place + 1) * each;
            let mean = of().map(|part| stage(part).pose[1]).sum::<f64>() / each as f64;
            let moves = of().map(moves).sum::<f64>();
            assert!((own.pose[1] - mean).abs() < 1e-15 && (own.moves - moves).abs() < 1e-15);
        }
        // They are those of a path that has never had more.
        let mut longer = record;
        longer.path = merged.path.clone();
        let longer = experiment(&longer, &measurement).unwrap();
        assert!(longer.force == merged.force && longer.acceleration == merged.acceleration);
    }
}

#[test]
fn a_merged_part_is_even_if_all_of_it_is() {
    let mut record = twice(4 * PARTS);
    record.path[1].is_even = false;
    let merged = experiment(&record, &narrow()).unwrap();
    assert_eq!((merged.path.len(), merged.divided), (2 * PARTS - 1, 2 * PARTS));
    let mean = 0.5 * (stage(2).pose[0] + stage(3).pose[0]);
    assert!((merged.path[0].pose[0] - mean).abs() < 1e-15, "{:?}", merged.path[0].pose);
}

/// No transform is shorter than 256 samples. The band has 128 bins, enough for eight parts.
#[test]
fn parts_are_merged_where_they_are_too_short() {
    let measurement = Measurement { band_hz: [5.0, 67.4], ..measurement() };
    let divided = experiment(&along(2 * PARTS), &measurement).unwrap();
    assert_eq!((divided.path.len(), divided.bins_of_part()), (PARTS, 32));
}

#[test]
fn a_record_that_is_hardly_anywhere_even_is_refused() {
    let mut record = twice(2 * PARTS);
    for (uneven, expected) in [(4, None), (5, Some(SpectrumError::Uneven))] {
        record.path[..uneven].iter_mut().for_each(|stage| stage.is_even = false);
        assert_eq!(experiment(&record, &narrow()).err(), expected, "{uneven} parts");
    }
}

#[test]
fn a_path_whose_length_is_no_power_of_two_is_refused() {
    for parts in [3, 5, 6] {
        let found = experiment(&along(parts), &measurement()).err();
        assert_eq!(found, Some(SpectrumError::Length(SAMPLES / parts)), "{parts} parts");
    }
}

#[test]
fn a_stage_of_another_robot_is_refused() {
    let mut record = along(PARTS);
    record.path[2].pose.pop();
    assert_eq!(experiment(&record, &measurement()).err(), Some(SpectrumError::Pose(1)));
    record.path[2].pose.push(f64::NAN).unwrap();
    assert_eq!(experiment(&record, &measurement()).err(), Some(SpectrumError::NotFinite));
}
