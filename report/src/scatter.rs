//! The scatter found in the data, in words.

use calibench::diagnosis::Scatter;
use calibench::residuals::noise::{RepeatScatter, Suspect};
use calibench::units::{DEG, MM, UM, URAD};

/// Number of suspects listed by name.
const MOST_NAMED: usize = 8;

/// Rounding of the joint angles above this share of the noise is reported.
const WORTH_A_WORD: f64 = 0.5;

/// The noteworthy findings, most important first.
pub(super) fn scatter_sentences(s: &Scatter) -> Vec<String> {
    let mut all = Vec::new();
    if let (Some(factor), Some(stated)) = (s.larger_than_stated, s.noise.stated_per_axis) {
        let by = if s.noise.source.noise_from() == "repeats" { "repeats" } else { "the residual with everything fitted" };
        all.push(format!(
            "Noise: {:.1} µm per axis by {by}, {factor:.2} times the {:.1} µm that the data state; everything here is computed with the larger.",
            factor * stated / UM,
            stated / UM
        ));
    }
    if !s.seatings.is_empty() {
        let pairs: Vec<String> = s.seatings.iter().take(MOST_NAMED).map(|[a, b]| format!("{a} and {b}")).collect();
        all.push(format!(
            "Repeats: {} have one posture and one target and follow each other: one seating recorded twice, which says nothing of the noise.",
            pairs.join("; ")
        ));
    }
    all.extend(joint_steps(s));
    if let Some(lag) = s.serial.largest().filter(|_| s.serial.is_significant()) {
        all.push(format!(
            "Order: samples measured {} err alike (correlation {:.2}, chance {}): something drifts, or the poses were measured in a row and the model errs where they lie.",
            if lag.lag == 1 { "one after the other".into() } else { format!("{} apart", lag.lag) },
            lag.correlation,
            chance(s.serial.p)
        ));
    }
    all.extend(s.repeats.as_ref().and_then(repeats));
    all
}

fn joint_steps(s: &Scatter) -> Option<String> {
    let steps = s.joint_steps?;
    let noise = s.noise.level.map_or(0.0, |l| l.per_axis);
    (steps.per_axis > WORTH_A_WORD * noise && (noise > 0.0 || s.larger_than_stated.is_some())).then(|| {
        format!(
            "Joints: all angles are multiples of {} deg; if they were read out so, rounding alone makes {:.1} µm per axis.",
            (steps.step / DEG * 1e6).round() / 1e6,
            steps.per_axis / UM
        )
    })
}

fn repeats(r: &RepeatScatter) -> Option<String> {
    let alarms = r.alarms();
    if alarms.is_empty() {
        return None;
    }
    let joints: Vec<String> =
        alarms.iter().map(|j| format!("joint {} by {:.0} µrad (2 dlogL {:.0})", j.joint + 1, j.sigma / URAD, j.lost)).collect();
    Some(format!(
        "Repeats: they scatter by {:.4} mm (3-D rms) about the means of {} postures, and not as noise does: {} from one repeat to the next; white noise is {:.1} µm per axis. A joint that does not come back has lost motion or friction.",
        r.rms / MM,
        r.postures,
        joints.join(", "),
        r.white / UM
    ))
}

/// Suspects as a clause: `24 (9.1 sigma, chance 1e-12), 57 (...)`.
pub(super) fn suspects_named(suspects: &[Suspect]) -> String {
    let mut named: Vec<String> = suspects
        .iter()
        .take(MOST_NAMED)
        .map(|x| format!("{} ({:.1} sigma, chance {})", x.sample, x.deviation, chance(x.chance)))
        .collect();
    if suspects.len() > MOST_NAMED {
        named.push(format!("and {} more", suspects.len() - MOST_NAMED));
    }
    named.join(", ")
}

/// Formats a small probability.
fn chance(p: f64) -> String {
    if p < 1e-12 {
        "below 1e-12".into()
    } else if p < 1e-3 {
        format!("{p:.0e}")
    } else {
        format!("{p:.3}")
    }
}
