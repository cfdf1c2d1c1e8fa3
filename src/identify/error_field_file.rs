//! `[error_field]` in model and calibration files: a field of joint errors.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effects::EffectId;
use crate::effects::error_field::{ErrorField, FieldTerm, JointFunctions, SizedEffect};

/// A field of joint errors: what no named effect explains, found by `calibench ladder`.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct ErrorFieldTable {
    /// SHA-256 of each dataset that it was found from.
    datasets: Vec<String>,
    /// Effective number of its parameters.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    numbers: f64,
    /// Root mean square load of each joint in those data, N·m.
    load_nm: Vec<f64>,
    /// Effects of the set-up that were fitted beside it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    beside: Vec<String>,
    /// One-sigma before the data of the parameters that are fitted beside it, in plausible sizes, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    width: BTreeMap<String, f64>,
    /// Effects of the catalogue within it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effect: Vec<SizedEffectTable>,
    /// Errors of the joints' angles.
    #[serde(default)]
    term: Vec<TermTable>,
}

/// An effect of known size.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct SizedEffectTable {
    /// Its id.
    id: String,
    /// Sizes of its parameters, in plausible sizes.
    sizes: Vec<f64>,
}

/// Functions of a joint's error, with a coefficient each: one of `orders`, `angles` and `load_and_angle` says of what.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct TermTable {
    /// The joint that errs, from 1.
    joint: usize,
    /// First and last order per turn: of the joint's own angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    orders: Option<[usize; 2]>,
    /// Two joints, from 1: of their angles.
    #[serde(skip_serializing_if = "Option::is_none")]
    angles: Option<[usize; 2]>,
    /// A joint, from 1: of the joint's own load and this one's angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    load_and_angle: Option<usize>,
    /// Coefficients, nrad: sine and cosine, order by order; of products the second angle runs faster.
    nrad: Vec<i32>,
}

/// A mistake in the table: key, problem and remedy.
pub(crate) type FieldMistake = (String, String, &'static str);

impl ErrorFieldTable {
    pub fn of(field: &ErrorField) -> Self {
        let effect = |e: &SizedEffect| SizedEffectTable { id: e.effect.to_string(), sizes: e.sizes.clone() };
        ErrorFieldTable {
            datasets: field.datasets.clone(),
            numbers: field.numbers,
            load_nm: field.load.clone(),
            beside: field.beside.iter().map(ToString::to_string).collect(),
            width: field.widths.clone(),
            effect: field.effects.iter().map(effect).collect(),
            term: field.terms.iter().map(TermTable::of).collect(),
        }
    }

    /// The field.
    ///
    /// # Errors
    /// The first value that is impossible; whether it fits the robot is found when the effect is built.
    pub fn field(self) -> Result<ErrorField, FieldMistake> {
        let wrong =
            |key: &str, problem: String| (format!("error_field.{key}"), problem, "let `calibench ladder` write it again");
        if !(self.numbers >= 0.0 && self.numbers.is_finite()) {
            return Err(wrong("numbers", format!("is {}", self.numbers)));
        }
        if let Some(load) = self.load_nm.iter().find(|load| !(**load >= 0.0 && load.is_finite())) {
            return Err(wrong("load_nm", format!("holds {load}")));
        }
        if let Some((name, width)) = self.width.iter().find(|(_, width)| !(**width > 0.0 && width.is_finite())) {
            return Err(wrong("width", format!("of '{name}' is {width}")));
        }
        let sized = |(k, e): (usize, SizedEffectTable)| match e.sizes.iter().find(|size| !size.is_finite()) {
            Some(size) => Err(wrong(&format!("effect[{k}].sizes"), format!("holds {size}"))),
            None => Ok(SizedEffect { effect: e.id.into(), sizes: e.sizes }),
        };
        let term = |(k, t): (usize, TermTable)| {
            t.term().ok_or_else(|| {
                wrong(
                    &format!("term[{k}].joint"),
                    "is not one of `orders`, `angles` and `load_and_angle`, with joints from 1".into(),
                )
            })
        };
        Ok(ErrorField {
            load: self.load_nm,
            terms: self.term.into_iter().enumerate().map(term).collect::<Result<_, _>>()?,
            effects: self.effect.into_iter().enumerate().map(sized).collect::<Result<_, _>>()?,
            widths: self.width,
            beside: self.beside.iter().map(EffectId::from).collect(),
            datasets: self.datasets,
            numbers: self.numbers,
        })
    }
}

impl TermTable {
    fn of(term: &FieldTerm) -> Self {
        let one = TermTable { joint: term.functions.joint() + 1, nrad: term.nrad.clone(), ..TermTable::default() };
        match term.functions {
            JointFunctions::Curve { orders, .. } => TermTable { orders: Some(orders), ..one },
            JointFunctions::Angles { of, .. } => TermTable { angles: Some(of.map(|j| j + 1)), ..one },
            JointFunctions::Load { angle, .. } => TermTable { load_and_angle: Some(angle + 1), ..one },
        }
    }

    fn term(self) -> Option<FieldTerm> {
        let joint = self.joint.checked_sub(1)?;
        let functions = match (self.orders, self.angles, self.load_and_angle) {
            (Some(orders @ [first, last]), None, None) if 1 <= first && first <= last => {
                JointFunctions::Curve { joint, orders }
            }
            (None, Some([a, b]), None) => JointFunctions::Angles { joint, of: [a.checked_sub(1)?, b.checked_sub(1)?] },
            (None, None, Some(angle)) => JointFunctions::Load { joint, angle: angle.checked_sub(1)? },
            _ => return None,
        };
        Some(FieldTerm { functions, nrad: self.nrad })
    }
}
