//! Numbers and points of a curve.

/// Most points of a curve. Chosen: more than a panel of a page has pixels to tell them apart.
pub const POINTS: usize = 240;

/// A number to five digits.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Indices of at most [`POINTS`] of these ascending frequencies: all, or those next to a grid of equal ratios.
pub(super) fn thinned(frequencies: &[f64]) -> Vec<usize> {
    let (Some(first), Some(last)) = (frequencies.first(), frequencies.last()) else {
        return Vec::new();
    };
    if frequencies.len() <= POINTS {
        return (0..frequencies.len()).collect();
    }
    let ratio = last / first;
    let mut kept: Vec<usize> = (0..POINTS)
        .map(|index| {
            let wanted = first * ratio.powf(index as f64 / (POINTS - 1) as f64);
            let above = frequencies.partition_point(|own| *own < wanted).min(frequencies.len() - 1);
            let below = above.saturating_sub(1);
            if wanted - frequencies[below] < frequencies[above] - wanted { below } else { above }
        })
        .collect();
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_is_thinned_by_equal_ratios() {
        let few: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(thinned(&few), (0..100).collect::<Vec<_>>());
        let many: Vec<f64> = (8..=4000).map(f64::from).collect();
        let kept = thinned(&many);
        assert!(kept.len() <= POINTS && kept.len() > POINTS / 2, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, many.len() - 1));
        assert!(kept.windows(2).all(|pair| pair[0] < pair[1]));
        let step = many[kept[kept.len() - 1]] / many[kept[kept.len() - 2]];
        assert!((1.01..1.04).contains(&step), "{step}");
        assert!(thinned(&[]).is_empty());
    }

    #[test]
    fn numbers_keep_five_digits() {
        assert_eq!(rounded(1.234_567_8e-9), 1.2346e-9);
        assert_eq!(rounded(0.0), 0.0);
    }
}
