//! Unknown names and suggestions for them.

/// Returns the known name most likely meant by `given`: one that differs only in its unit, or by a typing error.
pub fn nearest_name<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = given.to_lowercase();
    let distance = |name: &str| match unit_slip(&lower, name) {
        Some(_) => 0,
        None => strsim::damerau_levenshtein(&lower, name),
    };
    let nearest = known.into_iter().map(|name| (distance(name), name)).min_by_key(|(distance, _)| *distance);
    // A name with a third of its letters wrong is a different word.
    nearest.filter(|(distance, name)| 3 * distance <= name.len().max(3)).map(|(_, name)| name)
}

/// Remedy for an unknown name: the missing unit, the nearest name, or the list of all names.
///
/// ```
/// use calibench::files::name_remedy;
///
/// let known = ["x_mm", "y_mm", "payload"];
/// assert_eq!(name_remedy("x", &known), "write `x_mm`: the unit is part of the name");
/// assert_eq!(name_remedy("x_m", &known), "give it as `x_mm`, in that unit");
/// assert_eq!(name_remedy("paylaod", &known), "did you mean `payload`?");
/// ```
pub fn name_remedy(given: &str, known: &[&str]) -> String {
    match nearest_name(given, known.iter().copied()) {
        Some(name) => match unit_slip(&given.to_lowercase(), name) {
            Some(UnitSlip::Missing) => format!("write `{name}`: the unit is part of the name"),
            Some(UnitSlip::Another) => format!("give it as `{name}`, in that unit"),
            None => format!("did you mean `{name}`?"),
        },
        None if known.is_empty() => "remove it".into(),
        None => format!("known here: {}", known.join(", ")),
    }
}

/// Difference between a name and a known one that differs only in its unit.
enum UnitSlip {
    Missing,
    Another,
}

fn unit_slip(given: &str, known: &str) -> Option<UnitSlip> {
    let (stem, _) = known.rsplit_once('_')?;
    if given == stem {
        Some(UnitSlip::Missing)
    } else {
        (given.rsplit_once('_')?.0 == stem && given != known).then_some(UnitSlip::Another)
    }
}
