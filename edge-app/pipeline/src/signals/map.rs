//! From the channels of a sensor to its axes.

use nalgebra::{Matrix3, Vector3};

/// Most channels of a sensor: those of a platform of four piezoelectric sensors of three axes.
pub(super) const MOST_CHANNELS: usize = 12;
/// Largest error of a force (or an acceleration) that is mapped to channels and back, relative. Beyond, the matrix does not tell all three
/// axes.
const INVERTS: f64 = 1e-6;

/// Values of the channels of a sensor.
pub(super) type Channels = [f64; MOST_CHANNELS];

/// Affine map from the channels of a sensor to its axes: `axes = offset + Σ column · channel`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    columns: Vec<[f64; 3]>,
    offset: [f64; 3],
    /// What each channel has of `axes - offset`, of all that give it the least.
    back: Vec<[f64; 3]>,
}

impl Map {
    /// Makes the map of these columns, one a channel. `None` if they do not tell all three axes.
    pub(super) fn new(columns: Vec<[f64; 3]>, offset: [f64; 3]) -> Option<Self> {
        let vectors = || columns.iter().map(|column| Vector3::from(*column));
        let gram: Matrix3<f64> = vectors().map(|column| column * column.transpose()).sum();
        let inverse = gram.try_inverse()?;
        let back: Vec<Vector3<f64>> = vectors().map(|column| inverse * column).collect();
        let there: Matrix3<f64> =
            vectors().zip(&back).map(|(column, back)| column * back.transpose()).sum();
        let inverts = (there - Matrix3::identity()).norm() < INVERTS;
        let back = back.into_iter().map(Into::into).collect();
        inverts.then_some(Self { columns, offset, back })
    }

    /// Returns the axes that these channels give.
    pub(super) fn axes(&self, channels: &Channels) -> [f64; 3] {
        let mut axes = self.offset;
        for (column, channel) in self.columns.iter().zip(channels) {
            for (axis, own) in axes.iter_mut().zip(column) {
                *axis += own * channel;
            }
        }
        axes
    }

    /// Returns the least channels that give these axes.
    pub(super) fn channels(&self, axes: [f64; 3]) -> Channels {
        let mut channels = [0.0; MOST_CHANNELS];
        for (channel, back) in channels.iter_mut().zip(&self.back) {
            *channel = (0..3).map(|axis| back[axis] * (axes[axis] - self.offset[axis])).sum();
        }
        channels
    }

    /// Returns whether a channel goes into each axis.
    pub(super) fn takes(&self, channel: usize) -> [bool; 3] {
        self.columns.get(channel).map_or([false; 3], |column| column.map(|own| own != 0.0))
    }

    /// Returns the steps of the axes, given those of the channels: their errors of rounding add up as noise does.
    pub(super) fn steps(&self, channels: &[f64]) -> [f64; 3] {
        let square = |axis: usize| {
            let all = self.columns.iter().zip(channels);
            all.map(|(column, step)| (column[axis] * step).powi(2)).sum::<f64>()
        };
        [0, 1, 2].map(|axis| square(axis).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_mapped_to_channels_and_back() {
        let columns = vec![[1.0, 0.1, 0.0], [-0.9, 0.2, 0.3], [0.0, 1.1, -0.2], [0.1, 0.0, 2.0]];
        let map = Map::new(columns.clone(), [10.0, -20.0, 30.0]).unwrap();
        let axes = [123.0, -45.0, 6.0];
        let error = map.axes(&map.channels(axes)).into_iter().zip(axes).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0, f64::max) < 1e-9);
        let one = |channel| std::array::from_fn(|own| f64::from(u8::from(own == channel)));
        assert_eq!(map.axes(&one(3)), [10.1, -20.0, 32.0]);
        assert_eq!(map.takes(3), [true, false, true]);
        let [x, _, _] = map.steps(&[1.0, 2.0, 4.0, 10.0]);
        assert!((x - (1.0_f64 + 1.8 * 1.8 + 1.0).sqrt()).abs() < 1e-12);
        assert_eq!(
            Map::new(vec![[1.0, 2.0, 0.0], [0.0, 0.0, 1.0], [2.0, 4.0, 0.0]], [0.0; 3]),
            None
        );
    }
}
