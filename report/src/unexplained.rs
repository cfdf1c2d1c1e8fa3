//! A residual that no single effect of the catalogue explains, in words.

use super::effect_names::all_called;
use super::heat_map::curve_line;
use calibench::diagnosis::Diagnosis;
use calibench::diagnosis::heat_map::Variable;
use calibench::diagnosis::surfaces::Surface;
use calibench::effects::variable_in_words;
use calibench::residuals::noise_floor::NoiseSource;

/// The joint and the variables that its error follows: `the error of joint 3 follows the angle of joint 2`; `None` if no shape is
/// credible.
pub(super) fn shape_words(d: &Diagnosis) -> Option<String> {
    let shape = d.shape()?;
    let (joint, over) = shape.id.strip_prefix("curve:")?.split_once(':')?;
    let over: Vec<String> = over.split(':').map(|variable| format!("the {}", variable_in_words(variable))).collect();
    let together = if over.len() > 1 { " together" } else { "" };
    Some(format!("the error of joint {joint} follows {}{together}", over.join(" and ")))
}

/// What is seen of it, what that means, and what to do.
pub(super) fn unexplained(d: &Diagnosis) -> Vec<String> {
    let map = &d.heat_map;
    if let Some(surface) = d.surface.as_ref().filter(|_| d.surface_wins()) {
        return of_surface(d, surface);
    }
    match map.credible().first().copied() {
        Some(cell) => {
            let variable = cell.variable.name();
            let mut all = vec![format!(
                "Saw: the error of joint {} follows the {} ({variable}): a smooth curve explains {:.0} % of the residual (log evidence {:+.1} vs. the usual model discrepancy of a robot; its level and what else the fitted model absorbs of it are not seen).",
                cell.joint + 1,
                variable_in_words(&variable),
                100.0 * cell.explains,
                cell.ln_evidence_against_background
            )];
            if let Some(curve) = map.curve.as_ref().filter(|c| c.joint == cell.joint && c.variable == cell.variable) {
                all.push(format!("Saw: {}.", curve_line(curve)));
            }
            all.push(format!(
                "Means: something turns joint {} that the catalogue does not hold; its shape over {variable} is what is known of it.",
                cell.joint + 1
            ));
            all.push("Do: look at that shape for the cause.".into());
            all
        }
        None => {
            let largest = all_called(&d.registry, d.contributions.iter().take(3).map(|c| &c.effect));
            let most = if largest.is_empty() { String::new() } else { format!("; most of it goes to {largest}") };
            let mut all = vec![
                format!("Saw: many small effects at about {} plausible sizes each, none of them unusual{most}.", d.background),
                "Means: this is the usual model discrepancy of a robot beyond the fitted model.".into(),
            ];
            if d.whiteness_p.is_some() && d.scatter.noise.source != NoiseSource::Replicates {
                all.push("Do: measure five postures twice: only that tells whether this is noise.".into());
            }
            all
        }
    }
}

/// What is said of a joint whose error follows two variables at once.
fn of_surface(d: &Diagnosis, surface: &Surface) -> Vec<String> {
    let [one, other] = surface.variables.map(Variable::name);
    let joint = surface.joint + 1;
    let known = d.shape().is_some_and(|shape| shape.id == surface.id());
    let saw = format!(
        "Saw: the error of joint {joint} follows the {} ({one}) and the {} ({other}) together: a smooth surface explains {:.0} % of the residual (log evidence {:+.1} vs. the usual model discrepancy of a robot).",
        variable_in_words(&one),
        variable_in_words(&other),
        100.0 * surface.explains,
        surface.ln_evidence_against_background
    );
    let means = format!(
        "Means: something turns joint {joint} that the catalogue does not hold; its shape over {one} and {other} is what is known of it."
    );
    let look = known.then(|| "Do: look for what the two have in common: a load, a bearing, a cable.".to_owned());
    [saw, means].into_iter().chain(look).collect()
}
