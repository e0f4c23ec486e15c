use super::*;
use crate::refine::{Information, Local};

/// Where nothing is left to gain: so many residuals of this χ², of which static tests have a part.
fn fit(sum_of_squares: f64, degrees_of_freedom: f64, statics: [f64; 2]) -> Fit {
    let sought = Sought::new(1).unwrap();
    let mut information = Information::none(sought.unknowns());
    information.add_known(0, 0.01);
    Fit {
        sum_of_squares,
        objective: sum_of_squares,
        degrees_of_freedom,
        static_sum_of_squares: statics[0],
        static_residuals: statics[1] as usize,
        deviations: [f64::INFINITY; _],
        log_information: 0.0,
        covariance: information.covariance(),
        ssp: [0.1; 2],
        structure: Structure::NONE,
        contradiction: 0.0,
    }
}

/// Structure of this size that noise does not make, or none.
pub(in crate::identify) fn of_size(size: f64) -> Structure {
    let significance = if size == 0.0 { 0.0 } else { 8.0 };
    Structure { size, least: size, significance, local: None }
}

/// A minimum of two thousand residuals that noise explains, with `gain` left to it, along the first unknown, whose
/// standard deviation is 0.01.
pub(in crate::identify) fn minimum(sum_of_squares: f64, gain: f64) -> Minimum {
    let sought = Sought::new(1).unwrap();
    let mut step = [0.0; MAX_UNKNOWNS];
    step[0] = 0.01 * libm::sqrt(gain);
    let fit = fit(sum_of_squares, 2000.0, [0.0; 2]);
    Minimum::new([0.0; _], FoundBy::Descent, fit, &Remaining { step, gain }, &sought)
}

#[test]
fn residuals_far_below_the_noise_are_not_consistent() {
    for (sum_of_squares, freedom, statics, too_loud) in [
        (200.0, 10_000.0, [0.0; 2], true),
        (4_900.0, 10_000.0, [0.0; 2], true),
        (5_100.0, 10_000.0, [0.0; 2], false),
        // A few may be as small by chance.
        (0.1, 30.0, [0.0; 2], false),
        (55.0, 160.0, [0.0; 2], true),
        (75.0, 120.0, [0.0; 2], false),
        // Readings by hand may be better than their user says.
        (10_000.1, 10_100.0, [0.1, 100.0], false),
        (0.1, 100.0, [0.1, 100.0], false),
    ] {
        let fit = fit(sum_of_squares, freedom, statics);
        let minimum = Minimum { fit, ..minimum(2000.0, 0.0) };
        assert_eq!(minimum.noise_is_too_loud(), too_loud, "{sum_of_squares} of {freedom}");
        assert_eq!(minimum.is_consistent(), !too_loud, "{sum_of_squares} of {freedom}");
    }
}
#[test]
fn a_minimum_is_reached_twice_only_at_the_same_place() {
    let cases = [
        // Gains left, sums of squares, squared distance: times reached, rival.
        ([0.0, 0.0], [2000.0, 2000.5], 1e-3, (2, false)),
        ([0.9, 0.9], [2000.0, 2000.5], 3.9, (2, false)),
        ([0.0, 0.0], [2000.0, 2000.5], 1e4, (1, true)),
        // The likelihood of the worse is 0.22, 0.05 and 0.008 of the better's.
        ([0.0, 0.0], [2000.0, 2003.0], 1e4, (1, true)),
        ([0.0, 0.0], [2006.0, 2000.0], 1e4, (1, true)),
        ([0.0, 0.0], [2000.0, 2009.6], 1e4, (1, true)),
        ([0.0, 0.0], [2000.0, 2010.0], 1e4, (1, false)),
        // One basin, and one that was not reached.
        ([0.0, 0.0], [2000.0, 2003.0], 3.9, (1, false)),
        ([0.0, 2.0], [2000.0, 2003.0], 1e4, (1, false)),
        ([0.0, 2.0], [2000.0, 2000.5], 1e-3, (1, false)),
        ([0.0, 2.0], [2000.0, 2000.5], 1e4, (1, false)),
        // Residuals of a hundred times the noise: so is the distance.
        ([0.0, 0.0], [2e5, 2e5 + 1.0], 300.0, (2, false)),
    ];
    for (gains, sums, distance, expected) in cases {
        let mut best = minimum(sums[0], gains[0]);
        best.compete(minimum(sums[1], gains[1]), distance);
        assert_eq!((best.times, best.has_rival), expected, "{gains:?} {sums:?} {distance}");
    }
}

/// However often the better of two is reached, the worse one remains possible.
#[test]
fn a_rival_is_not_outvoted() {
    let mut best = minimum(2000.0, 0.0);
    best.compete(minimum(2004.0, 0.0), 1e4);
    best.compete(minimum(2000.0, 0.0), 1e-3);
    assert!(best.has_rival && best.times == 2);
}

/// Reached again and a little better, a minimum keeps what its branches have shown.
#[test]
fn what_is_reached_again_remembers_its_branches() {
    for distance in [1e-3, 1e4] {
        let same = distance < 1.0;
        let mut best = minimum(2000.5, 0.0);
        best.is_branched = true;
        best.remember_rival(&minimum(2000.5, 0.0), [0.3].into_iter());
        best.compete(minimum(2000.0, 0.0), distance);
        assert_eq!(best.fit.sum_of_squares, 2000.0);
        assert_eq!(best.is_branched, same);
        assert_eq!(best.apart.is_empty(), !same);
        assert_eq!(best.deviations_elsewhere.is_empty(), !same);
    }
}

/// Half each where they are equally good, e⁻² : 1 at a difference of 4, and no less than one in twenty; where the residuals are
/// four times the noise's power, differences count a quarter.
#[test]
fn a_worse_minimum_is_less_probable() {
    for (gap, inflation, expected) in [
        (0.0, 1.0, 0.5),
        (4.0, 1.0, 1.0 / (1.0 + 2.0_f64.exp())),
        (10.0, 1.0, 0.05),
        (16.0, 4.0, 1.0 / (1.0 + 2.0_f64.exp())),
        (f64::INFINITY, 1.0, 0.05),
    ] {
        let probability = probability(gap, inflation);
        assert!((probability - expected).abs() < 1e-12, "{gap} {inflation}: {probability}");
    }
}

/// Of two minima the one of the larger volume is better, though its sum of squares is larger. A point that is no minimum yet is
/// compared by the sum of squares.
#[test]
fn minima_are_compared_by_their_evidence() {
    let with = |sum_of_squares, gain, log_information| {
        let mut minimum = minimum(sum_of_squares, gain);
        minimum.fit.log_information = log_information;
        minimum
    };
    for (gain, expected) in [(0.0, 2005.0), (2.0, 2000.0)] {
        let mut best = with(2000.0, gain, 20.0);
        let broad = with(2005.0, 0.0, 0.0);
        assert_eq!(broad.is_clearly_better_than(&best), gain < 1.0);
        best.compete(broad, 1e4);
        assert_eq!(best.fit.sum_of_squares, expected, "{gain}");
    }
    let mut nothing = with(f64::NAN, 0.0, 0.0);
    nothing.compete(with(2000.0, 0.0, 0.0), 1e4);
    assert_eq!(nothing.fit.sum_of_squares, 2000.0);
}

/// Residuals of thirty times the noise's power.
#[test]
fn a_minimum_is_near_up_to_a_limit() {
    assert!(minimum(29.9 * 2000.0, 0.0).is_near());
    assert!(!minimum(30.1 * 2000.0, 0.0).is_near());
    assert!(!minimum(f64::NAN, 0.0).is_near());
}

/// A better minimum has no rival in a worse one's.
#[test]
fn a_better_minimum_has_no_rival_among_the_worse() {
    let mut best = minimum(2010.0, 0.0);
    best.compete(minimum(2010.0, 0.0), 1e4);
    assert!(best.has_rival);
    best.compete(minimum(2000.0, 0.0), 1e4);
    assert!(!best.has_rival && best.times == 1);
}

/// Of each unknown the farthest of several rivals counts, with the largest standard deviation at any of them; of a worse rival as
/// much as its probability allows.
#[test]
fn the_errors_hold_the_farthest_rivals() {
    let sought = Sought::new(1).unwrap();
    let mut own = minimum(2000.0, 0.0);
    let away = |first: f64, second: f64| {
        (0..sought.unknowns()).map(move |i| [first, second].get(i).copied().unwrap_or(0.0))
    };
    own.spread(&sought);
    assert!((own.fit.deviations[0] - 0.01).abs() < 1e-12);
    // Its standard deviation is 0.01 √2.
    let as_good = minimum(2000.0, 1.0);
    own.remember_rival(&as_good, away(0.3, -0.1));
    let worse = minimum(2004.0, 0.0);
    own.remember_rival(&worse, away(-1.0, 0.05));
    let [below, above] = own.apart[0];
    assert_eq!([below.away, below.gap, above.away, above.gap], [-1.0, 4.0, 0.3, 0.0]);
    own.spread(&sought);
    let probability = 1.0 / (1.0 + libm::exp(2.0));
    let expected = libm::sqrt(0.5 * (1e-4 + 2e-4) + probability);
    assert!((own.fit.deviations[0] - expected).abs() < 1e-12);
    assert_eq!(own.fit.deviations[1], f64::INFINITY);
}

/// Two springs that a rival exchanges have errors of opposite signs, on whichever side of the minimum the rival lies.
#[test]
fn a_rival_correlates_what_it_moves() {
    let sought = Sought::new(1).unwrap();
    for sign in [1.0, -1.0] {
        let mut own = minimum(2000.0, 0.0);
        let mut information = Information::none(sought.unknowns());
        information.add_known(0, 0.01);
        information.add_known(1, 0.01);
        own.fit.covariance = information.covariance();
        let away = |unknown| [0.3 * sign, -0.3 * sign].get(unknown).copied().unwrap_or(0.0);
        let rival = own.clone();
        own.remember_rival(&rival, (0..sought.unknowns()).map(away));
        own.spread(&sought);
        let correlation = own.fit.covariance.correlation(0, 1);
        assert!((-1.0..-0.99).contains(&correlation), "{correlation}");
    }
}

/// A better minimum 0.5 above the old one, by 3 in the deviance: the rivals of the old one are shifted and worse, and those that then
/// lie on one side compete.
#[test]
fn a_better_minimum_keeps_the_rivals_of_the_old_one() {
    let mut old = minimum(2003.0, 0.0);
    for away in [0.3, -0.2] {
        old.remember_rival(&minimum(2004.0, 0.0), [away].into_iter());
    }
    let mut new = minimum(2000.0, 0.0);
    new.remember_rivals_of(&old, [-0.5].into_iter());
    let [below, above] = new.apart[0];
    assert!((below.away + 0.7).abs() < 1e-12 && below.gap == 4.0, "{below:?}");
    assert_eq!(above, Rival::default());
    assert_eq!(new.deviations_elsewhere, old.deviations_elsewhere);
}

/// The mean of both variances where the two are equally good, `0.9 · own + 0.1 · other` where the other one is rare.
#[test]
fn the_variance_of_a_worse_rival_counts_less() {
    for (sum_of_squares, variance) in [(2000.0, 2e-4), (2009.9, 0.9 * 1e-4 + 0.1 * 2e-4)] {
        let mut own = minimum(2000.0, 0.0);
        own.remember_rival(&minimum(sum_of_squares, 1.0), [0.0].into_iter());
        assert!((own.deviations_elsewhere[0] / libm::sqrt(variance) - 1.0).abs() < 1e-9);
    }
}

/// The interval of the structure decides: in units of the noise, wherever it is, and whatever its significance.
#[test]
fn structure_objects_where_it_is_surely_too_much() {
    let local = |least| Some(Local { size: least, least });
    for (times, structure, objects) in [
        (1.0, of_size(0.09), false),
        (1.0, of_size(0.11), true),
        (1.0, Structure { significance: 400.0, ..of_size(0.09) }, false),
        (1.0, Structure { least: 0.09, ..of_size(0.3) }, false),
        (8.0, of_size(0.011), false),
        (8.0, of_size(0.014), true),
        (1.0, Structure { local: local(0.11), ..Structure::NONE }, true),
        (1.0, Structure { local: local(0.09), ..Structure::NONE }, false),
    ] {
        let fit = Fit { structure, ..fit(times * 2000.0, 2000.0, [0.0; 2]) };
        let minimum = Minimum { fit, ..minimum(2000.0, 0.0) };
        assert_eq!(minimum.structure_objects(), objects, "{times} {structure:?}");
        // One record or axis is no matter of the minimum.
        assert!(structure_is_allowed_for(&structure, false), "{structure:?}");
    }
}

#[test]
fn robust_deviations_allow_for_more_structure() {
    for (size, without, with) in
        [(0.20, true, true), (0.22, false, true), (0.26, false, false), (f64::NAN, false, false)]
    {
        let structure = of_size(size);
        let allowed =
            [false, true].map(|is_robust| structure_is_allowed_for(&structure, is_robust));
        assert_eq!(allowed, [without, with], "{size}");
    }
}

#[test]
fn size_and_structure_are_looked_at_together() {
    let freedom = 5000.0;
    let spread = libm::sqrt(2.0 / freedom + 0.04 * 0.04);
    for (size, significance, doubtful) in [
        (0.0, 3.9, false),
        (0.0, 4.1, true),
        (3.9, 0.0, false),
        (4.1, 0.0, true),
        (1.9, 2.0, false),
        (2.1, 2.0, true),
        (-1.0, 4.9, false),
        (4.9, -1.0, false),
    ] {
        let fit = fit(freedom * (1.0 + size * spread), freedom, [0.0; 2]);
        let structure = Structure { significance, ..Structure::NONE };
        let minimum = Minimum { fit: Fit { structure, ..fit }, ..minimum(2000.0, 0.0) };
        assert_eq!(minimum.is_doubtful(), doubtful, "{size} {significance}");
    }
}

#[test]
fn what_is_left_to_a_minimum_widens_its_deviations() {
    for (gain, reached, deviation) in [
        (0.0, true, 0.01),
        (0.25, true, 0.0125_f64.sqrt() * 0.1),
        (1.1, false, 0.021_f64.sqrt() * 0.1),
    ] {
        let minimum = minimum(2000.0, gain);
        assert_eq!(minimum.is_reached(), reached, "{gain}");
        let widened = minimum.fit.deviations[0];
        assert!((widened / deviation - 1.0).abs() < 1e-12, "{gain}: {widened}, not {deviation}");
        assert_eq!(minimum.fit.deviations[1], f64::INFINITY);
    }
    assert!(!minimum(2000.0, f64::NAN).is_reached());
}
