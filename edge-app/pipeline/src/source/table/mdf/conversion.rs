//! Conversions of numbers into the values of a sensor.

use super::blocks::Block;

/// Conversion of numbers into values.
pub(super) enum Law {
    Same,
    Linear([f64; 2]),
    Rational([f64; 6]),
    /// Pairs, between which lines run.
    Table(Vec<[f64; 2]>),
}

impl Law {
    pub(super) fn new(block: Option<&Block>, name: &str) -> Result<Self, String> {
        let Some(block) = block else { return Ok(Self::Same) };
        let [kind] = block.data::<1>(0)?;
        let count = usize::from(u16::from_le_bytes(block.data(6)?));
        let numbers: Vec<f64> = (0..count)
            .map(|own| block.data(24 + 8 * own).map(f64::from_le_bytes))
            .collect::<Result<_, _>>()?;
        let damaged = || {
            format!(
                "channel {name:?} has a conversion of kind {kind} with {count} numbers, which cannot be (those of a table must rise): record it again"
            )
        };
        Ok(match kind {
            0 => Self::Same,
            1 => Self::Linear(*numbers.first_chunk().ok_or_else(damaged)?),
            2 => Self::Rational(*numbers.first_chunk().ok_or_else(damaged)?),
            4 if count >= 4 && count % 2 == 0 => {
                let pairs: Vec<[f64; 2]> = numbers.as_chunks().0.to_vec();
                let rises = pairs.is_sorted_by(|[one, _], [next, _]| one < next);
                let is_finite = pairs.iter().all(|[own, _]| own.is_finite());
                if !is_finite || !rises {
                    return Err(damaged());
                }
                Self::Table(pairs)
            }
            4 => return Err(damaged()),
            _ => {
                return Err(format!(
                    "channel {name:?} has a conversion of kind {kind}, which is no scale of a sensor: save it with asammdf (`MDF('IN.mf4').export('csv', 'OUT.csv', single_time_base=True, add_units=True)`)"
                ));
            }
        })
    }

    pub(super) fn value(&self, raw: f64) -> f64 {
        match self {
            Self::Same => raw,
            Self::Linear([offset, slope]) => offset + slope * raw,
            Self::Rational([a, b, c, d, e, f]) => {
                (a * raw * raw + b * raw + c) / (d * raw * raw + e * raw + f)
            }
            Self::Table(pairs) => {
                let above = pairs.partition_point(|[own, _]| *own < raw).clamp(1, pairs.len() - 1);
                let [[x, y], [next, next_y]] = [pairs[above - 1], pairs[above]];
                y + (raw.clamp(pairs[0][0], pairs[pairs.len() - 1][0]) - x) * (next_y - y)
                    / (next - x)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(kind: u8, numbers: &[f64]) -> Result<Law, String> {
        let bytes: Vec<u8> = numbers.iter().flat_map(|own| own.to_le_bytes()).collect();
        let data = [&[kind, 0, 0, 0, 0, 0, numbers.len() as u8, 0][..], &[0; 16], &bytes].concat();
        Law::new(Some(&Block { id: *b"##CC", links: &[], data: &data }), "Fx")
    }

    #[test]
    fn conversions_are_those_of_the_standard() {
        for (kind, numbers, expected) in [
            (0, &[][..], 1.5),
            (1, &[10.0, 2.0], 13.0),
            (2, &[1.0, 2.0, 3.0, 0.0, 2.0, 1.0], (2.25 + 3.0 + 3.0) / 4.0),
            (4, &[0.0, 0.0, 1.0, 2.0, 2.0, 10.0], 6.0),
            (4, &[2.0, 7.0, 3.0, 9.0], 7.0),
            (4, &[0.0, 7.0, 1.0, 9.0], 9.0),
        ] {
            assert_eq!(law(kind, numbers).unwrap().value(1.5), expected, "{kind}");
        }
    }

    #[test]
    fn conversions_that_cannot_be_are_refused() {
        for keys in [[2.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, f64::NAN]] {
            let pairs = keys.map(|key| [key, 2.0 * key]).concat();
            assert!(law(4, &pairs).err().unwrap().contains("those of a table must rise"));
        }
        assert!(
            law(1, &[1.0]).err().unwrap().contains("of kind 1 with 1 numbers, which cannot be")
        );
        assert!(law(3, &[]).err().unwrap().contains("of kind 3, which is no scale of a sensor"));
    }
}
