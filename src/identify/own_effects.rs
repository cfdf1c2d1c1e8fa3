//! `[[effect]]` tables: user-defined effects, in model, scenario and calibration files.

use serde::{Deserialize, Serialize};

use crate::effects::EffectId;
use crate::effects::own::{OwnEffect, OwnTerm};
use crate::files::name_remedy;
use crate::units::{Unit, readable};

/// A user-defined effect as written in a file; linear in its coefficients.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "a table [[effect]] with name, unit and terms; effects of the catalogue are listed in `effects`"
)]
pub struct OwnEffectTable {
    /// Its id: letters, digits, `_`, `-`.
    name: String,
    /// Unit of the coefficients: `mm`, `um`, `deg`, `mrad`, `urad`, `mdeg/(N*m)`, `urad/(N*m)`, `um/m`, `um/(m*K)`,
    /// `urad/rad`, `kg`, `kg*m`, `1/(MN*m²)`, `1`.
    unit: String,
    /// A size (1 sigma) of the coefficients that would not be surprising, in that unit; 0.005 deg or 0.03 mm if not given (in
    /// any unit of angle or length), else 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    plausible: Option<f64>,
    /// Defined, but not fitted: offered to the diagnosis.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    candidate: bool,
    /// Terms of the equation: coefficient times basis, at each site.
    terms: Vec<OwnTermTable>,
}

/// A term of a user-defined effect: coefficient times basis, at a site.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct OwnTermTable {
    /// The site that moves: `kind:index` or `kind:index:axis`.
    site: String,
    /// Expression in `q1` ..., `tau1` ..., `approach1` ..., `hose1` ..., `q1_before` ..., `q1_commanded` ..., `down_x` ..., `tcp_x_m` ...,
    /// `payload_kg`, `time_s`, `temp_c`; its value times the coefficient
    /// is in m or rad, depending on the site.
    basis: String,
    /// Terms of one group share one coefficient, `NAME.GROUP`.
    #[serde(skip_serializing_if = "Option::is_none")]
    group: Option<String>,
}

impl OwnEffectTable {
    /// Its id.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// True if it is defined, but not fitted.
    pub(super) fn is_candidate(&self) -> bool {
        self.candidate
    }

    /// Balls named individually by its sites.
    pub(super) fn balls(&self) -> impl Iterator<Item = String> {
        self.terms.iter().filter_map(|t| Some(t.site.strip_prefix("ball:")?.rsplit_once(':')?.0.to_owned()))
    }
}

/// A mistake in such a table: the key with the table's index, the problem and the remedy.
pub struct OwnMistake {
    /// `effect[1].unit`.
    pub key: String,
    /// The problem.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
}

/// The effects of `[[effect]]` tables, and the list of effects to fit: `fitted` as written, followed by those that are not
/// candidates.
///
/// Expressions and sites are checked when the effects are built, for a robot.
///
/// # Errors
/// An unknown unit or a duplicate name.
pub(crate) fn own_effects(tables: &[OwnEffectTable], fitted: &[String]) -> Result<(Vec<OwnEffect>, Vec<String>), OwnMistake> {
    let mut own: Vec<OwnEffect> = Vec::new();
    let mut fitted = fitted.to_vec();
    for (k, table) in tables.iter().enumerate() {
        let wrong =
            |key: &str, problem: String, remedy: String| OwnMistake { key: format!("effect[{k}].{key}"), problem, remedy };
        // Keyboards have no raised dot, so `*` is accepted.
        let unit = Unit::from_symbol(&table.unit.replace('*', "·")).ok_or_else(|| {
            let known = Unit::ALL.map(|u| u.symbol);
            wrong("unit", format!("'{}' is not a known unit", table.unit), name_remedy(&table.unit, &known))
        })?;
        if own.iter().any(|e| e.name == table.name) {
            return Err(wrong("name", format!("'{}' appears twice", table.name), "name each effect differently".into()));
        }
        if !table.candidate && !fitted.contains(&table.name) {
            fitted.push(table.name.clone());
        }
        let effect = OwnEffect {
            name: table.name.clone(),
            unit,
            plausible: table.plausible.map_or(OwnEffect::usual_size(unit), |p| unit.to_si(p)),
            terms: table
                .terms
                .iter()
                .map(|t| OwnTerm { site: t.site.clone(), basis: t.basis.clone(), group: t.group.clone() })
                .collect(),
        };
        effect.unit_fits().map_err(|e| wrong("unit", e.problem, e.remedy))?;
        own.push(effect);
    }
    Ok((own, fitted))
}

/// The tables of these effects; those named in `fitted` are fitted.
pub(super) fn tables(own: &[OwnEffect], fitted: &[EffectId]) -> Vec<OwnEffectTable> {
    let table = |e: &OwnEffect| OwnEffectTable {
        name: e.name.clone(),
        unit: e.unit.symbol.into(),
        plausible: (e.plausible != OwnEffect::usual_size(e.unit)).then(|| readable(e.plausible, e.unit.si)),
        candidate: !fitted.iter().any(|id| *id == e.name),
        terms: e
            .terms
            .iter()
            .map(|t| OwnTermTable { site: t.site.clone(), basis: t.basis.clone(), group: t.group.clone() })
            .collect(),
    };
    own.iter().map(table).collect()
}
