//! Reading of an indicator in a workshop, where one answer in a thousand is lost or garbled.

use crate::cell::{Indicator, IndicatorError};

/// Reads once; after a lost, garbled or faulty answer makes up to `retries` further queries and counts each in `spent`.
///
/// A plunger outside its range stays there however often it is read, so that is reported at once.
pub(crate) fn read_patiently<I: Indicator>(
    indicator: &mut I,
    retries: usize,
    spent: &mut usize,
) -> Result<f64, IndicatorError> {
    let mut left = retries;
    loop {
        let answer = match indicator.read() {
            Ok(value) if !value.is_finite() => Err(IndicatorError::Garbled { frame: value.to_string() }),
            answer => answer,
        };
        match answer {
            Err(error) if left > 0 && error != IndicatorError::OverRange => {
                left -= 1;
                *spent += 1;
            }
            answer => return answer,
        }
    }
}
