//! From the raw values of a channel to those of its sensor, as the channel's properties say.
//!
//! Each scale takes what another one gives, or the raw values. The last one gives the values of the channel. Raw values of DAQmx have the number of
//! a scale too, which has no law.

use super::properties::Properties;

/// Number in place of that of another scale: the raw values.
const RAW: f64 = u32::MAX as f64;

/// Scales the values of a channel. `raw` is the scale whose values the raw ones of DAQmx are.
///
/// # Errors
/// A scale is not whole, of a type that is not read, or takes its own values.
pub(super) fn scale(
    values: &mut [f64],
    properties: &Properties,
    raw: Option<f64>,
) -> Result<(), String> {
    let count = properties.number("NI_Number_Of_Scales").unwrap_or_default();
    // Those that stand scaled in the file need nothing.
    let is_scaled = properties.text("NI_Scaling_Status") == Some("scaled");
    if values.is_empty() || is_scaled || count < 1.0 {
        return Ok(());
    }
    for law in laws(properties, count - 1.0, raw)?.iter().rev() {
        for value in &mut *values {
            *value = law.iter().rev().fold(0.0, |sum, own| sum * *value + own);
        }
    }
    Ok(())
}

/// Returns the coefficients of the polynomials from the last scale back to the raw values, the constant first.
fn laws(properties: &Properties, last: f64, raw: Option<f64>) -> Result<Vec<Vec<f64>>, String> {
    let (mut scale, mut laws) = (last, Vec::new());
    while scale != RAW && Some(scale) != raw {
        // Each scale has a property.
        if laws.len() > properties.len() {
            return Err(
                "has scales that take each other's values in a circle: save it scaled".into()
            );
        }
        let key = |own: &str| format!("NI_Scale[{scale}]_{own}");
        let lacks = |own: &str| format!("has a scale {scale} without {own}: save it scaled");
        let number = |own: &str| properties.number(&key(own)).ok_or_else(|| lacks(own));
        let kind = properties.text(&key("Scale_Type")).ok_or_else(|| lacks("Scale_Type"))?;
        laws.push(match kind {
            "Linear" => vec![number("Linear_Y_Intercept")?, number("Linear_Slope")?],
            "Polynomial" => {
                // NI: four, where the number is not stated.
                let size = properties.number(&key("Polynomial_Coefficients_Size")).unwrap_or(4.0);
                let own = |place| number(&format!("Polynomial_Coefficients[{place}]"));
                (0..size as usize).map(own).collect::<Result<_, _>>()?
            }
            other => {
                return Err(format!(
                    "has a scale of type {other:?}, and linear ones and polynomials are read: save it scaled"
                ));
            }
        });
        scale = properties.number(&key(&format!("{kind}_Input_Source"))).unwrap_or(RAW);
    }
    Ok(laws)
}

#[cfg(test)]
mod tests {
    use super::super::properties::Property;
    use super::*;

    /// Scales of these properties, behind `NI_Scale`.
    fn properties(count: f64, own: &[(&str, Result<f64, &str>)]) -> Properties {
        let mut all = Properties::default();
        all.insert("NI_Number_Of_Scales".into(), Property::Number(count));
        for (name, value) in own {
            let value = match value {
                Ok(own) => Property::Number(*own),
                Err(own) => Property::Text((*own).to_owned()),
            };
            all.insert(format!("NI_Scale{name}"), value);
        }
        all
    }

    fn scaled(properties: &Properties, raw: Option<f64>) -> Result<Vec<f64>, String> {
        let mut values = vec![1.0, 2.0];
        scale(&mut values, properties, raw).map(|()| values)
    }

    /// 1 + 2 (x² - 1)
    fn chain(source: f64) -> Properties {
        properties(
            3.0,
            &[
                ("[2]_Scale_Type", Err("Linear")),
                ("[2]_Linear_Slope", Ok(2.0)),
                ("[2]_Linear_Y_Intercept", Ok(1.0)),
                ("[2]_Linear_Input_Source", Ok(1.0)),
                ("[1]_Scale_Type", Err("Polynomial")),
                ("[1]_Polynomial_Coefficients_Size", Ok(3.0)),
                ("[1]_Polynomial_Coefficients[0]", Ok(-1.0)),
                ("[1]_Polynomial_Coefficients[1]", Ok(0.0)),
                ("[1]_Polynomial_Coefficients[2]", Ok(1.0)),
                ("[1]_Polynomial_Input_Source", Ok(source)),
            ],
        )
    }

    #[test]
    fn each_scale_takes_the_values_of_the_one_before() {
        assert_eq!(scaled(&chain(RAW), None), Ok(vec![1.0, 7.0]));
        assert_eq!(scaled(&chain(0.0), Some(0.0)), Ok(vec![1.0, 7.0]));
        assert_eq!(scaled(&properties(0.0, &[]), None), Ok(vec![1.0, 2.0]));
        let mut stands_scaled = chain(RAW);
        stands_scaled.insert("NI_Scaling_Status".into(), Property::Text("scaled".into()));
        assert_eq!(scaled(&stands_scaled, None), Ok(vec![1.0, 2.0]));
    }

    /// A chain that ended early would give values in another unit.
    #[test]
    fn a_chain_that_breaks_is_an_error() {
        let mend = ": save it scaled";
        let of = |own: &Properties| scaled(own, None).unwrap_err();
        assert_eq!(of(&chain(0.0)), format!("has a scale 0 without Scale_Type{mend}"));
        assert!(of(&chain(2.0)).contains("in a circle"));
        let lacks = properties(1.0, &[("[0]_Scale_Type", Err("Linear"))]);
        assert_eq!(of(&lacks), format!("has a scale 0 without Linear_Y_Intercept{mend}"));
        let mut large = chain(RAW);
        large.insert("NI_Scale[1]_Polynomial_Coefficients_Size".into(), Property::Number(1e300));
        assert_eq!(of(&large), format!("has a scale 1 without Polynomial_Coefficients[3]{mend}"));
        let table = properties(1.0, &[("[0]_Scale_Type", Err("Table"))]);
        assert!(of(&table).starts_with("has a scale of type \"Table\", and linear"));
    }
}
