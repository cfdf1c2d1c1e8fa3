//! What happened between two rows, if the rows stand in the order in which they were measured, in words.

use super::finding_notes::{moment_words, sizes};
use calibench::diagnosis::{Diagnosis, Finding};

/// Beginning of what families of joints are called.
const A_JOINT: &str = "a joint";

/// What happened if the rows stand in the order in which they were measured.
pub(super) fn by_row_order(d: &Diagnosis) -> Option<String> {
    let found = d.by_row_order.as_ref()?;
    Some(format!(
        "Supposing that the rows stand in the order in which they were measured: {}: {}; explains {:.0} % of the residual.",
        event_words(d, found)?,
        sizes(found),
        100.0 * found.hypothesis.explains
    ))
}

/// The same in one clause.
pub(super) fn supposed_words(d: &Diagnosis) -> Option<String> {
    let event = event_words(d, d.by_row_order.as_ref()?)?;
    Some(format!("if the rows are in the order of measurement, {event}"))
}

/// What happened, and when, if it was once.
fn event_words(d: &Diagnosis, event: &Finding) -> Option<String> {
    let family = d.registry.family(&event.hypothesis.in_model)?;
    let when = event.hypothesis.moment.as_ref().map(|moment| format!(", {}", moment_words(moment)));
    let joint = event.hypothesis.in_model.number(0).filter(|_| family.what.starts_with(A_JOINT));
    let what = joint.map_or_else(|| family.what.to_owned(), |j| family.what.replacen(A_JOINT, &format!("joint {j}"), 1));
    Some(format!("{what}{}", when.unwrap_or_default()))
}
