//! `model.toml`: the effects that the identifier may use.

pub(crate) use super::own_effects::own_effects;
pub use super::own_effects::{OwnEffectTable, OwnMistake};

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use toml_edit::{DocumentMut, Item};

use super::Model;
use super::error_field_file::ErrorFieldTable;
use super::own_effects::tables;
use crate::effects;
use crate::effects::error_field::ErrorField;
use crate::effects::own::OwnEffect;
use crate::effects::{EffectError, EffectId, Subject};
use crate::files::disk::write_whole;
use crate::files::{FileError, field_error, parse_toml, read_text};

/// The effects that an identification may use.
#[derive(Deserialize, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct ModelToml {
    /// Ids of effects, in any order.
    #[cfg_attr(feature = "schema", schemars(length(min = 1)))]
    effects: Vec<String>,
    /// True if joint torques are taken from the columns `tau1_nm` ..., not computed from the masses of the links.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    measured_torques: bool,
    /// One-sigma of an effect before the data, in plausible sizes, by its id; `inf` leaves it free.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    width: BTreeMap<String, f64>,
    /// User-defined effects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effect: Vec<OwnEffectTable>,
    /// The field of joint errors that the effect `error_field` adds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    error_field: Option<ErrorFieldTable>,
}

/// The schema of this file.
#[cfg(feature = "schema")]
pub(crate) fn model_schema() -> schemars::Schema {
    crate::schema::of_file::<ModelToml>("Model", &[])
}

/// Reads `model.toml`, and checks that every effect can be built for the given robot and artifact.
///
/// # Errors
/// The first mistake, with line, key and remedy: an unknown or missing key; an effect that does not exist, does not fit the
/// robot or the artifact, or is named twice; a user-defined effect that is not well formed.
pub fn read_model(path: &Path, subject: &Subject<'_>) -> Result<Model, FileError> {
    let text = read_text(path)?;
    let file: ModelToml = parse_toml(path, &text)?;
    let field = field_of(file.error_field, path, &text)?;
    let subject = &Subject { field: field.as_ref(), ..*subject };
    let (own, effects) =
        check_effects(&EffectList { path, text: &text, key: "effects", ids: &file.effects, tables: &file.effect }, subject)?;
    for (id, width) in &file.width {
        let key = format!("width.{id:?}");
        if !effects.contains(id) {
            let remedy = "name an effect of the list `effects`";
            return Err(field_error(path, &text, &key, format!("'{id}' is not an effect of this model"), remedy));
        }
        if width.is_nan() || *width <= 0.0 {
            let remedy = "give a positive number of plausible sizes, or inf";
            return Err(field_error(path, &text, &key, format!("is {width}"), remedy));
        }
    }
    Ok(Model {
        effects: effects.into_iter().map(EffectId::from).collect(),
        own,
        measured_torques: file.measured_torques,
        width: file.width,
        registry: subject.registry.clone(),
        field,
        ..Model::default()
    })
}

/// The field of joint errors of a table `[error_field]`.
pub(super) fn field_of(table: Option<ErrorFieldTable>, path: &Path, text: &str) -> Result<Option<Arc<ErrorField>>, FileError> {
    let Some(table) = table else { return Ok(None) };
    let field = table.field().map_err(|(key, problem, remedy)| field_error(path, text, &key, problem, remedy))?;
    Ok(Some(Arc::new(field)))
}

/// A list of effects in a TOML document, and the tables `[[effect]]` beside it.
pub struct EffectList<'a> {
    /// Path of the document; empty if it comes from no file.
    pub path: &'a Path,
    /// Its text, to locate errors.
    pub text: &'a str,
    /// Key of the list, such as `model.effects` of a scenario.
    pub key: &'a str,
    /// The list.
    pub ids: &'a [String],
    /// The tables.
    pub tables: &'a [OwnEffectTable],
}

/// Checks a list of effects; returns the effects of its tables, and the list of effects to be fitted.
///
/// # Errors
/// The first effect that does not exist, does not fit the robot or the artifact, or is named twice; an empty list; an
/// invalid table.
pub fn check_effects(list: &EffectList<'_>, subject: &Subject<'_>) -> Result<(Vec<OwnEffect>, Vec<String>), FileError> {
    let &EffectList { path, text, key, ids, tables } = list;
    if ids.is_empty() {
        return Err(field_error(path, text, key, "names no effect", "name at least one, such as `base_frame`"));
    }
    // `model.` of `model.effects`.
    let around = key.rsplit_once('.').map(|(table, _)| format!("{table}.")).unwrap_or_default();
    let (own, fitted) =
        own_effects(tables, ids).map_err(|e| field_error(path, text, &format!("{around}{}", e.key), e.problem, e.remedy))?;
    for (k, effect) in own.iter().enumerate() {
        effect
            .build(subject)
            .map_err(|e| field_error(path, text, &format!("{around}effect[{k}].{}", e.key()), e.problem, e.remedy))?;
    }
    let subject = Subject { own: &own, ..*subject };
    for (k, id) in ids.iter().enumerate() {
        let at = format!("{key}[{k}]");
        if id.chars().any(char::is_control) {
            return Err(field_error(path, text, &at, format!("{id:?} holds a control character"), "use printable characters"));
        }
        if ids[..k].contains(id) {
            return Err(field_error(path, text, &at, format!("effect '{id}' is named twice"), "keep one of them"));
        }
        effects::build(id, &subject).map_err(|e| {
            let remedy = match (&e, subject.registry.family(id)) {
                (EffectError::Unknown { .. }, _) => {
                    let known = subject.registry.families().map(|f| f.id).chain(own.iter().map(|e| e.name.as_str()));
                    crate::files::nearest_name(EffectId::new(id).family(), known).map(|near| format!("did you mean `{near}`?"))
                }
                (_, family) => family.map(|f| format!("write `{}{}`", f.id, f.arguments)),
            };
            field_error(path, text, &at, e.to_string(), remedy.unwrap_or_else(|| "choose one of the catalogue".into()))
        })?;
    }
    Ok((own, fitted))
}

/// Writes `model.toml` as a copy of another model file with the additions in `model`: comments, order and layout of that
/// file are kept.
///
/// # Errors
/// When the other file cannot be read, or the folder cannot be written.
pub fn write_model_like(model: &Model, like: &Path, path: &Path) -> Result<(), FileError> {
    let text = amended(model, like, &read_text(like)?)?;
    write_whole(path, text.as_bytes())
}

/// The text of a model file, extended by the effects, widths and tables of `model` that it lacks.
fn amended(model: &Model, path: &Path, text: &str) -> Result<String, FileError> {
    let old: ModelToml = parse_toml(path, text)?;
    let broken = |problem: String| FileError::whole(path, problem, "write it as docs/models.md shows");
    let mut document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| broken(e.to_string()))?;
    let new_tables =
        tables(&model.own, &model.effects).into_iter().filter(|t| !old.effect.iter().any(|o| o.name() == t.name()));
    let new_tables: Vec<OwnEffectTable> = new_tables.collect();
    // A table that is not a candidate is fitted without being listed.
    let by_table =
        |id: &str| old.effect.iter().any(|t| t.name() == id && !t.is_candidate()) || new_tables.iter().any(|t| t.name() == id);
    let listed =
        document.get_mut("effects").and_then(Item::as_array_mut).ok_or_else(|| broken("has no list `effects`".into()))?;
    for id in model.effects.iter().filter(|id| !old.effects.iter().any(|e| *id == e) && !by_table(id)) {
        // Laid out like the last entry: on a line of its own, or not. A comment before that entry does not apply to this
        // one.
        let before_last = listed.iter().last().and_then(|last| last.decor().prefix()?.as_str());
        match before_last.and_then(|prefix| prefix.rsplit_once('\n')).map(|(_, indent)| format!("\n{indent}")) {
            Some(prefix) => {
                let mut value = toml_edit::Value::from(id.whole());
                value.decor_mut().set_prefix(prefix);
                listed.push_formatted(value);
            }
            None => listed.push(id.whole()),
        }
    }
    let field = model.field.as_ref().filter(|_| old.error_field.is_none()).map(|field| ErrorFieldTable::of(field));
    let mut appended = NewTables { width: BTreeMap::new(), effect: &new_tables, error_field: field };
    for (id, width) in model.width.iter().filter(|(id, width)| old.width.get(*id) != Some(*width)) {
        match document.get_mut("width").and_then(Item::as_table_like_mut) {
            Some(all) => drop(all.insert(id, toml_edit::value(*width))),
            None => drop(appended.width.insert(id, *width)),
        }
    }
    let inline = document.get_mut("effect").and_then(Item::as_array_mut);
    if let Some(inline) = inline.filter(|_| !new_tables.is_empty()) {
        let text = toml::to_string(&appended).map_err(|e| broken(e.to_string()))?;
        let tables: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| broken(e.to_string()))?;
        for table in tables.get("effect").and_then(Item::as_array_of_tables).into_iter().flatten() {
            inline.push(table.clone().into_inline_table());
        }
        appended.effect = &[];
    }
    let appended = toml::to_string(&appended).map_err(|e| broken(e.to_string()))?;
    let text = document.to_string();
    Ok(if appended.is_empty() { text } else { format!("{}\n\n{appended}", text.trim_end_matches('\n')) })
}

#[derive(Serialize)]
struct NewTables<'t> {
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    width: BTreeMap<&'t str, f64>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    effect: &'t [OwnEffectTable],
    #[serde(skip_serializing_if = "Option::is_none")]
    error_field: Option<ErrorFieldTable>,
}

/// Writes `model.toml`.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_model(model: &Model, path: &Path) -> Result<(), FileError> {
    let file = ModelToml {
        effects: model.ids(),
        measured_torques: model.measured_torques,
        width: model.width.clone(),
        effect: tables(&model.own, &model.effects),
        error_field: model.field.as_ref().map(|field| ErrorFieldTable::of(field)),
    };
    let text = toml::to_string(&file).map_err(|e| FileError::whole(path, e.to_string(), "report this as a defect"))?;
    write_whole(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    const WRITTEN: &str = "# my robot
effects = [
    \"base_frame\", # it was moved
    \"mdh\",
]
# torques come from the masses

[width]
mdh = 2.0 # the drawing is good
";

    #[test]
    fn comments_and_layout_are_kept() {
        let mut model = Model::of(&["base_frame", "mdh"]);
        model.width.insert("mdh".into(), 2.0);
        assert_eq!(amended(&model, Path::new("m.toml"), WRITTEN).expect("it is a model"), WRITTEN);
        let mut more = model.with("harmonic1:2");
        more.width.insert("harmonic1:2".into(), 1.5);
        let expected = WRITTEN.replace("    \"mdh\",\n", "    \"mdh\",\n    \"harmonic1:2\",\n") + "\"harmonic1:2\" = 1.5\n";
        assert_eq!(amended(&more, Path::new("m.toml"), WRITTEN).expect("it is a model"), expected);
    }
}
