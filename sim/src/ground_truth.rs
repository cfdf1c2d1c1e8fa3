//! Comparison with the ground truth: after a run whose truth is known, one entry for each effect hidden in it.

use calibench::diagnosis::{Diagnosis, Examination, Finding, Verdict, diagnose_examined};
use calibench::effects::EffectId;
use calibench::identify::Model;
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::{Use, missing};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::units::Unit;

use crate::effect_names::{belongs, family_of, holds, same};
use crate::flaw::TrueEffect;
use crate::random::Streams;
use crate::scenario::{MujocoToml, Scenario, TruthToml};

/// A parameter of a hidden effect: true and estimated value, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenNumber {
    /// Name of the parameter.
    pub name: String,
    /// Its true deviation from nominal.
    pub truth: f64,
    /// The estimated deviation, and its one-sigma; `None` if it was not estimated.
    pub found: Option<[f64; 2]>,
    /// Unit for display and files.
    pub unit: Unit,
}

/// The way a hidden effect appears in the results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Met {
    /// The fitted model contains it.
    InModel,
    /// The diagnosis names it first.
    First,
    /// It is in the credible set, or another name of the first finding.
    InSet,
    /// It is among the findings, but not in the set.
    Among,
    /// No effect of the catalogue resembles it, and the diagnosis says that such a thing is present.
    SaidSo,
    /// These data cannot test it.
    Untestable,
    /// The diagnosis does not name it.
    NotNamed,
}

impl Met {
    /// Name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Met::InModel => "in_model",
            Met::First => "named_first",
            Met::InSet => "in_set",
            Met::Among => "among_findings",
            Met::SaidSo => "said_to_be_unknown",
            Met::Untestable => "not_testable",
            Met::NotNamed => "not_named",
        }
    }
}

/// One effect or flaw hidden in the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// Id of the effect, or the key below `[truth]` for a truth that is not an effect of the catalogue or of the user.
    pub effect: String,
    /// Its size in words, if it has no numbers.
    pub size: String,
    /// Its non-zero numbers.
    pub numbers: Vec<HiddenNumber>,
    /// Root mean square of these in units of their plausible size.
    pub plausible_sizes: Option<f64>,
    /// Way in which it appears.
    pub met: Met,
    /// Detectability: rms of the part not absorbed by the fitted model, in units of the stated noise.
    pub visible: Option<f64>,
}

/// Comparison of the ground truth with the results.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundTruth {
    /// Most detectable first, those in the model last.
    pub hidden: Vec<Hidden>,
    /// Verdict of the diagnosis.
    pub verdict: Verdict,
    /// The effect it names first, and true if that is a false alarm: nothing of the kind is hidden.
    pub named: Option<(EffectId, bool)>,
}

/// Compares the truth of a scenario, sampled from `streams`, with a calibration of `dataset` and its diagnosis.
///
/// # Errors
/// When data and model do not match.
pub fn ground_truth(
    scenario: &Scenario,
    streams: &Streams,
    dataset: &Dataset,
    calibration: &Calibration,
) -> Result<GroundTruth, IdentifyError> {
    let data = [NamedDataset::new("fit", dataset)];
    let model = &calibration.model;
    let examination = Examination::new(&data, model)?;
    let diagnosis = diagnose_examined(&data, &examination)?;
    let effects = scenario.truth().drawn(streams);
    let there = |e: &&TrueEffect| e.sizes.iter().any(|&size| size != 0.0);
    let effects: Vec<&TrueEffect> = effects.iter().filter(there).collect();
    let visible = visible(&examination, &data, model, &effects)?;
    let mut hidden: Vec<Hidden> = effects
        .iter()
        .zip(visible)
        .map(|(effect, visible)| of_effect(effect, visible, calibration, &diagnosis))
        .chain(of_keys(scenario.truth().keys()).into_iter().map(|other| other.met_by(&diagnosis)))
        .collect();
    hidden.sort_by(|a, b| {
        let first = |h: &Hidden| (h.met == Met::InModel, h.visible.is_none());
        first(a).cmp(&first(b)).then(b.visible.unwrap_or(0.0).total_cmp(&a.visible.unwrap_or(0.0)))
    });
    let claims = diagnosis.verdict != Verdict::NothingLeft;
    let top = diagnosis.findings.first().filter(|_| claims).map(|f| f.hypothesis.in_model.clone());
    let named = top.map(|top| {
        let wrongly = !hidden.iter().any(|h| h.met == Met::First);
        (top, wrongly)
    });
    Ok(GroundTruth { hidden, verdict: diagnosis.verdict, named })
}

/// Rms of each effect not absorbed by the fitted model, in units of noise; `None` for effects in the model, and for those
/// that these data cannot show.
fn visible(
    examination: &Examination,
    data: &[NamedDataset<'_>],
    model: &Model,
    effects: &[&TrueEffect],
) -> Result<Vec<Option<f64>>, IdentifyError> {
    let shown = |e: &TrueEffect| {
        let id = e.effect.id();
        !holds(&model.effects, id) && data.iter().all(|d| missing(e.effect.as_ref(), d.dataset, model, Use::Fit).is_none())
    };
    let sought: Vec<(String, Vec<f64>)> =
        effects.iter().filter(|e| shown(e)).map(|e| (e.effect.id().to_owned(), e.sizes.clone())).collect();
    let mut found = examination.visible_rms(data, &sought)?.into_iter();
    Ok(effects.iter().map(|e| if shown(e) { found.next() } else { None }).collect())
}

/// Entry for an effect of the catalogue or the user.
fn of_effect(truth: &TrueEffect, visible: Option<f64>, calibration: &Calibration, diagnosis: &Diagnosis) -> Hidden {
    let id = truth.effect.id();
    let finding = diagnosis.findings.iter().find(|f| same(id, &f.hypothesis.in_model) || f.hypothesis.effect == id);
    let of_member = |name: &str| {
        let members = diagnosis.findings.iter().filter(|f| belongs(&f.hypothesis.in_model, id));
        let mut found =
            members.flat_map(|f| f.parameters.iter().map(move |p| (format!("{}.{}", f.hypothesis.in_model, p.name), p)));
        found.find(|(found, _)| found == name).map(|(_, p)| [p.value, p.sigma])
    };
    let parameters = || truth.effect.parameters().iter().zip(&truth.sizes).enumerate();
    let numbers = parameters().filter(|(_, (_, size))| **size != 0.0).map(|(k, (spec, &size))| HiddenNumber {
        name: spec.name.clone(),
        truth: size,
        found: calibration
            .estimate(&spec.name)
            .map(|e| [e.value - e.nominal, e.sigma])
            .or_else(|| finding.and_then(|f| f.parameters.get(k)).map(|p| [p.value, p.sigma]))
            .or_else(|| of_member(&spec.name)),
        unit: spec.unit,
    });
    let squares: Vec<f64> =
        parameters().filter(|(_, (_, size))| **size != 0.0).map(|(_, (spec, size))| (size / spec.prior).powi(2)).collect();
    let met = match () {
        () if holds(&calibration.model.effects, id) => Met::InModel,
        () if visible.is_none() => Met::Untestable,
        () => met(diagnosis, |name| same(id, name) || belongs(name, id)),
    };
    Hidden {
        effect: id.to_owned(),
        size: String::new(),
        numbers: numbers.collect(),
        plausible_sizes: Some((squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()),
        met,
        visible,
    }
}

/// Finds the place in a diagnosis of an effect whose id satisfies `is_it`.
fn met(diagnosis: &Diagnosis, is_it: impl Fn(&str) -> bool) -> Met {
    if diagnosis.verdict == Verdict::NothingLeft {
        return Met::NotNamed;
    }
    let by_name = |f: &Finding| is_it(&f.hypothesis.in_model) || is_it(&f.hypothesis.effect);
    let first = diagnosis.findings.first();
    if first.is_some_and(by_name) {
        Met::First
    } else if diagnosis.set95.iter().any(|e| is_it(e)) || first.is_some_and(|f| f.rivals.iter().any(|r| is_it(r))) {
        Met::InSet
    } else if diagnosis.findings.iter().any(by_name) {
        Met::Among
    } else {
        Met::NotNamed
    }
}

/// A truth besides the effects: its key, its size in words, and the effects that are the same under another name.
struct Other {
    key: String,
    size: String,
    twins: Vec<String>,
    /// True if no catalogue contains it.
    unknown: bool,
}

impl Other {
    fn met_by(self, diagnosis: &Diagnosis) -> Hidden {
        let is_twin = |name: &str| self.twins.iter().any(|t| same(t, name) || t == family_of(name));
        let said_so = self.unknown && says_unknown(diagnosis.verdict);
        let by_name = met(diagnosis, is_twin);
        let met = if by_name == Met::NotNamed && said_so { Met::SaidSo } else { by_name };
        Hidden { effect: self.key, size: self.size, numbers: Vec::new(), plausible_sizes: None, met, visible: None }
    }
}

/// True if a verdict says that something is present that the catalogue does not explain.
pub fn says_unknown(verdict: Verdict) -> bool {
    matches!(verdict, Verdict::Unexplained | Verdict::Partly)
}

/// Truths given by keys besides the effects.
fn of_keys(keys: &TruthToml) -> Vec<Other> {
    let mut all = Vec::new();
    let mut add = |key: String, size: String, twins: Vec<String>, unknown: bool| all.push(Other { key, size, twins, unknown });
    let twins = keys.hidden.twins();
    for flaw in keys.hidden.listed() {
        let at: Vec<String> = flaw.joints.iter().map(ToString::to_string).collect();
        let size = if at.is_empty() { flaw.size } else { format!("{} at joint {}", flaw.size, at.join(", ")) };
        add(format!("hidden.{}", flaw.name), size, twins.clone(), true);
    }
    for (name, error) in &keys.payload {
        if error.mass_error_kg != 0.0 {
            let size = format!("{:+} kg", error.mass_error_kg);
            add(format!("payload.{name}.mass_error_kg"), size, vec![EffectId::PAYLOAD_MASS.into()], false);
        }
        if error.com_error_mm.iter().any(|&v| v != 0.0) {
            let size = format!("{:?} mm", error.com_error_mm);
            add(format!("payload.{name}.com_error_mm"), size, vec![EffectId::PAYLOAD_COM.into()], false);
        }
    }
    if keys.link_mass_error.iter().any(|&e| e != 0.0) {
        add("link_mass_error".into(), format!("{:?}", keys.link_mass_error), vec![EffectId::LINK_MASS.into()], false);
    }
    of_mechanism(&keys.mujoco, &mut add);
    all
}

/// Flaws of the mechanism.
fn of_mechanism(keys: &MujocoToml, add: &mut dyn FnMut(String, String, Vec<String>, bool)) {
    if let Some(p) = &keys.pedestal {
        let size = format!("{}, {} µrad/(N·m)", p.x_urad_per_nm, p.y_urad_per_nm);
        add("mujoco.pedestal".into(), size, vec![EffectId::PEDESTAL.into()], false);
    }
    let mut of_joint = |what: &str, joint: usize, size: String, twin: &str| {
        add(format!("mujoco.{what}:{joint}"), size, vec![format!("{twin}:{joint}")], false);
    };
    keys.bearing
        .iter()
        .for_each(|b| of_joint("bearing", b.joint, format!("{} µrad/(N·m)", b.urad_per_nm), EffectId::BEARING_TILT));
    keys.friction.iter().for_each(|f| of_joint("friction", f.joint, format!("{} N·m", f.torque_nm), EffectId::HYSTERESIS));
    keys.stiffening.iter().for_each(|s| {
        of_joint("stiffening", s.joint, format!("{} of the twist at {} N·m", s.share, s.at_nm), EffectId::STIFFENING);
    });
    keys.backlash
        .iter()
        .for_each(|b| of_joint("backlash", b.joint, format!("{} µrad wide", b.width_urad), EffectId::GRAVITY_BACKLASH));
}
