//! Shifts of the parameters caused by each effect that the model lacks, in the document of `identify --shifts`.

use calibench::diagnosis;
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Untestable;

/// A parameter of the model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ShiftedParameter {
    /// Name.
    pub name: String,
    /// Symbol of its unit.
    pub unit: String,
}

/// The shifts caused by one number of an effect at its plausible size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShiftOfNumber {
    /// Id of the effect.
    pub effect: String,
    /// Name of the number.
    pub number: String,
    /// Plausible size, in `unit`.
    pub plausible: f64,
    /// Symbol of the unit.
    pub unit: String,
    /// Shift of every parameter by name, in the parameter's unit.
    pub shift: BTreeMap<String, f64>,
}

/// Shifts of the parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Shifts {
    /// The parameters.
    pub parameters: Vec<ShiftedParameter>,
    /// One entry per number of every effect.
    pub numbers: Vec<ShiftOfNumber>,
    /// Effects that these data cannot show.
    pub untestable: Vec<Untestable>,
}

impl Shifts {
    /// The document of the shifts.
    #[must_use]
    pub fn of(s: &diagnosis::shifts::Shifts) -> Self {
        let parameter = |p: &diagnosis::shifts::Shifted| ShiftedParameter { name: p.name.clone(), unit: p.unit.symbol.into() };
        let number = |shift: &diagnosis::shifts::Shift| ShiftOfNumber {
            effect: shift.effect.to_string(),
            number: shift.number.clone(),
            plausible: shift.unit.from_si(shift.size),
            unit: shift.unit.symbol.into(),
            shift: s.parameters.iter().zip(&shift.by).map(|(p, by)| (p.name.clone(), p.unit.from_si(*by))).collect(),
        };
        Shifts {
            parameters: s.parameters.iter().map(parameter).collect(),
            numbers: s.shifts.iter().map(number).collect(),
            untestable: Untestable::all(&s.untestable),
        }
    }
}
