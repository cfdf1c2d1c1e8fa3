//! `model.toml`: the effects that the identifier may use.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::Model;
use crate::effects::{self, EffectError, Subject};
use crate::files::{FileError, field_error, parse_toml, read_text, write_whole};

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct ModelToml {
    effects: Vec<String>,
    /// Take joint torques from the dataset's `tau1_nm` ... columns, not from link masses.
    #[serde(default)]
    measured_torques: bool,
    /// How large an effect may be, one-sigma in plausible sizes.
    #[serde(default)]
    width: BTreeMap<String, f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effect: Vec<UserEffectToml>,
}

/// An effect written by the user. Its structure is checked; its expressions are not evaluated by this version.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct UserEffectToml {
    name: String,
    unit: String,
    terms: Vec<TermToml>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct TermToml {
    site: String,
    basis: String,
    group: Option<String>,
}

/// Reads `model.toml`, and checks that every effect can be built for that robot and artifact.
///
/// # Errors
/// The first mistake, with line, key and remedy: an unknown or a missing key, an effect that does not exist, does not fit the
/// robot or the artifact, or is named twice; user-written effects, which this version does not evaluate.
pub fn read_model(path: &Path, subject: &Subject<'_>) -> Result<Model, FileError> {
    let text = read_text(path)?;
    let file: ModelToml = parse_toml(path, &text)?;
    if !file.effect.is_empty() {
        let remedy = "remove the [[effect]] tables and choose from `calibench effects`";
        return Err(field_error(path, &text, "effect[0]", "user-written effects are not supported yet", remedy));
    }
    check_effects(path, &text, "effects", &file.effects, subject)?;
    for (id, width) in &file.width {
        let key = format!("width.{id:?}");
        if !file.effects.contains(id) {
            let remedy = "name an effect of the list `effects`";
            return Err(field_error(path, &text, &key, format!("'{id}' is no effect of this model"), remedy));
        }
        if !(*width > 0.0) {
            return Err(field_error(
                path,
                &text,
                &key,
                format!("is {width}"),
                "give a positive number of plausible sizes, or inf",
            ));
        }
    }
    Ok(Model { effects: file.effects, measured_torques: file.measured_torques, width: file.width, ..Model::default() })
}

/// Checks a list of effects that stands under `key` of the TOML document `text`, such as `model.effects` of a scenario.
///
/// # Errors
/// The first effect that does not exist, does not fit the robot or the artifact, or is named twice; an empty list.
pub fn check_effects(path: &Path, text: &str, key: &str, ids: &[String], subject: &Subject<'_>) -> Result<(), FileError> {
    if ids.is_empty() {
        return Err(field_error(path, text, key, "names no effect", "name at least one, such as `base_frame`"));
    }
    for (k, id) in ids.iter().enumerate() {
        let at = format!("{key}[{k}]");
        if ids[..k].contains(id) {
            return Err(field_error(path, text, &at, format!("effect '{id}' is named twice"), "keep one of them"));
        }
        effects::build(id, subject).map_err(|e| {
            let family = id.split(':').next().unwrap_or_default();
            let remedy = match &e {
                EffectError::Unknown { .. } => {
                    let known = effects::CATALOGUE.iter().map(|f| f.id);
                    crate::files::nearest_name(family, known).map(|near| format!("did you mean `{near}`?"))
                }
                EffectError::Argument { .. } => {
                    effects::CATALOGUE.iter().find(|f| f.id == family).map(|f| format!("write `{}{}`", f.id, f.arguments))
                }
            };
            field_error(path, text, &at, e.to_string(), remedy.unwrap_or_else(|| "choose one of the catalogue".into()))
        })?;
    }
    Ok(())
}

/// Writes `model.toml`.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_model(model: &Model, path: &Path) -> Result<(), FileError> {
    let quoted: Vec<String> = model.effects.iter().map(|id| toml::Value::from(id.as_str()).to_string()).collect();
    let torques = if model.measured_torques { "measured_torques = true\n" } else { "" };
    let mut width = String::new();
    for (k, (id, size)) in model.width.iter().enumerate() {
        let heading = if k == 0 {
            "\n# How large an effect may be: one-sigma, in plausible sizes of the catalogue.\n[width]\n"
        } else {
            ""
        };
        width.push_str(&format!("{heading}{} = {size:?}\n", toml::Value::from(id.as_str())));
    }
    write_whole(path, format!("effects = [{}]\n{torques}{width}", quoted.join(", ")).as_bytes())
}
