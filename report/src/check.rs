//! A check of a calibrated robot in words and tables.

use calibench::monitoring::check::conditions::Condition;
use calibench::monitoring::check::power::{ChangeSize, Power, Quantity, SHOWN, SmallestDetectable};
use calibench::monitoring::check::{FALSE_ALARM, NOISE_ALIKE, NoiseOf, RobotCheck};
use calibench::units::{DEG, MM, UM};

use super::figures::COVERS_95;
use super::meaning::intervention_words;
use super::printout::Printout;
use super::tables::plain_rows;

/// Probabilities below this are not printed.
const LEAST: f64 = 0.01;

/// A condition in words, as they follow "that".
#[must_use]
pub fn condition_words(condition: &Condition) -> String {
    match condition {
        Condition::Valid => "nothing has changed".into(),
        Condition::ToolMoved => "the tool has moved on the flange".into(),
        Condition::BaseMoved => "the base or the artifact has moved".into(),
        Condition::BallMoved(ball) => format!("ball {ball} has moved"),
        Condition::TargetMoved(Some(target)) => format!("target {target} has moved on the tool"),
        Condition::TargetMoved(None) => "the target at the TCP has moved on the tool".into(),
        Condition::JointSlipped(joint) => format!("joint {joint} has lost its zero"),
        Condition::GearGivesWay(joint) => format!("the gear of joint {joint} gives way to its load by another amount"),
        Condition::LostMotion(joint) => {
            format!("joint {joint} stops short by another amount on the side from which it comes")
        }
        Condition::Warm => "the arm is warmer or colder than it was".into(),
        Condition::OtherPayload => "the flange carries another mass than entered".into(),
        Condition::SingleSample(id) => format!("sample {id} alone disagrees"),
        _ => "something else has changed, or several things".into(),
    }
}

/// The remedy for a condition.
#[must_use]
pub fn what_to_do(condition: &Condition) -> &'static str {
    match (condition, condition.intervention()) {
        (_, Some(intervention)) => intervention.act,
        (Condition::Valid, None) => "go on using the calibration",
        (_, None) => "after a collision, find what moved (`keep recover`); otherwise calibrate again",
    }
}

/// The unit in which changes are printed, with its name in files and on screens.
pub(crate) fn quantity_unit(quantity: Quantity) -> (f64, &'static str, &'static str) {
    match quantity {
        Quantity::Length => (UM, "um", "\u{b5}m"),
        Quantity::Angle => (DEG, "deg", "deg"),
        Quantity::Compliance => (1e-3 * DEG, "mdeg/N.m", "mdeg/N\u{b7}m"),
        Quantity::Mass => (1.0, "kg", "kg"),
        Quantity::Share => (1e-6, "ppm", "ppm"),
    }
}

/// A remark on a noise that is stated as another one than that of the campaign.
pub(crate) fn noise_remark(check: &RobotCheck) -> Option<String> {
    let ratio = check.noise_ratio;
    let stated = if ratio >= NOISE_ALIKE {
        format!("{ratio:.0} times that of the campaign, and the check is blind below the smallest changes that it shows")
    } else if ratio <= 1.0 / NOISE_ALIKE {
        format!("1/{:.0} of that of the campaign", 1.0 / ratio)
    } else {
        return None;
    };
    Some(format!(
        "The noise of these samples is stated as {stated}; if the instrument is the same, correct [noise] in dataset.toml, or sigma_um of the rows."
    ))
}

/// A remark on changes that are smaller than noise leaves them.
pub(crate) fn too_alike_remark(check: &RobotCheck) -> Option<String> {
    check.too_alike.map(|rms| {
        format!(
            "These samples repeat those of the campaign {:.0} times better than their noise allows (chance under 1e-9): they are rows of the campaign written with fewer digits, or the noise is stated too large. Until that is cleared up, nothing is shown to hold.",
            1.0 / rms.max(1e-6)
        )
    })
}

/// Conditions of one kind, of which the least clear one is named.
fn shown_kind(shown: &SmallestDetectable) -> Option<&'static str> {
    Some(match (&shown.condition, shown.quantity) {
        (Condition::JointSlipped(_), Quantity::Angle) => "a joint off by",
        (Condition::JointSlipped(_), _) => "a sliding joint off by",
        (Condition::ToolMoved, _) => "a tool off by",
        (Condition::BaseMoved, _) => "a base or artifact off by",
        (Condition::BallMoved(_), _) => "a ball off by",
        (Condition::TargetMoved(_), _) => "a target off by",
        (Condition::GearGivesWay(_), _) => "a gear softer by",
        (Condition::LostMotion(_), Quantity::Angle) => "lost motion of",
        (Condition::LostMotion(_), _) => "lost motion of a sliding joint of",
        (Condition::Warm, _) => "an arm longer by",
        (Condition::OtherPayload, _) => "a payload off by",
        _ => return None,
    })
}

/// The smallest changes that the samples of a check show, as sentences.
fn shown_words(shown: &[SmallestDetectable]) -> String {
    let mut kinds: Vec<&'static str> = Vec::new();
    for kind in shown.iter().filter_map(shown_kind) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let of_kind = |kind: &&'static str| {
        let own = shown.iter().filter(|s| shown_kind(s) == Some(*kind));
        let sized = own.filter_map(|s| Some((s, s.smallest.as_ref()?.change)));
        let (least, change) = sized.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let (unit, _, printed) = quantity_unit(least.quantity);
        let which = match &least.condition {
            Condition::JointSlipped(joint) | Condition::GearGivesWay(joint) | Condition::LostMotion(joint) => {
                format!(" (joint {joint}, the least clear)")
            }
            Condition::BallMoved(ball) => format!(" ({ball}, the least clear)"),
            Condition::TargetMoved(target) => format!(" ({}, the least clear)", target.as_deref().unwrap_or("the TCP")),
            _ => String::new(),
        };
        let change = change / unit;
        let figure = match least.quantity {
            Quantity::Angle => format!("{change:.4}"),
            Quantity::Compliance => format!("{change:.2}"),
            Quantity::Mass => format!("{change:.1}"),
            _ => format!("{change:.0}"),
        };
        Some(format!("{kind} {figure} {printed}{which}"))
    };
    let sizes: Vec<String> = kinds.iter().filter_map(of_kind).collect();
    let unseen = shown.iter().filter(|s| s.smallest.is_none());
    let not_at_all: Vec<String> = unseen.map(|s| condition_words(&s.condition)).collect();
    let mut out = String::new();
    if !sizes.is_empty() {
        out.push_str(&format!(
            "These samples would have shown, with {:.0} % probability: {}, each in the direction in which it shows least.\n",
            100.0 * SHOWN,
            sizes.join(", ")
        ));
    }
    if !not_at_all.is_empty() {
        out.push_str(&format!("They would not have shown, in every direction, that {}.\n", not_at_all.join("; that ")));
    }
    out
}

/// Residual of the differences after the named change, or the closest single one, as a sentence.
fn closest_words(check: &RobotCheck, named: &Condition) -> String {
    let Some(closest) = &check.closest else { return String::new() };
    let left = format!("{:.1} \u{b5}m rms per axis, where the noise is {:.1} \u{b5}m", closest.left / UM, closest.noise / UM);
    if closest.condition == *named {
        return format!("It leaves {left}.\n");
    }
    let words = condition_words(&closest.condition);
    if closest.explains {
        format!("Of single changes the closest is that {words}: it leaves {left}.\n")
    } else {
        format!("Of single changes the closest is that {words}, and that is not all: it leaves {left}.\n")
    }
}

/// The numbers of a change and halves of their 95 % intervals, in the unit in which it is printed.
pub(crate) fn sizes(size: &ChangeSize) -> Vec<[f64; 2]> {
    let (unit, ..) = quantity_unit(size.quantity);
    size.components.iter().map(|c| [c.value / unit, COVERS_95 * c.sigma / unit]).collect()
}

/// The size of the named change, as a line; empty if it has none.
fn size_words(condition: &Condition, size: Option<&ChangeSize>) -> String {
    let Some(size) = size else { return String::new() };
    let (_, _, unit) = quantity_unit(size.quantity);
    let digits = match size.quantity {
        Quantity::Angle => 4,
        Quantity::Mass | Quantity::Compliance => 2,
        Quantity::Length | Quantity::Share => 0,
    };
    let number = |[change, within]: &[f64; 2]| format!("{change:+.digits$} \u{b1} {within:.digits$}");
    let said: Vec<String> = match &sizes(size)[..] {
        [one] => vec![number(one)],
        several => ["x", "y", "z"].iter().zip(several).map(|(axis, one)| format!("{axis} {}", number(one))).collect(),
    };
    let of = match condition {
        Condition::JointSlipped(_) => "It stands further than it shows by",
        Condition::GearGivesWay(_) => "Its compliance has changed by",
        Condition::LostMotion(_) => "Half the play has changed by",
        Condition::Warm => "The links have grown by",
        Condition::OtherPayload => "There is more on it by",
        Condition::ToolMoved | Condition::TargetMoved(_) => "In the axes of the flange, by",
        _ => "In the axes of the world, by",
    };
    format!("{of} {} {unit} (95 %).\n", said.join(", "))
}

/// The check as text: the verdict, what to do, and the samples; `shown` are the smallest changes that they show.
#[must_use]
pub fn check_text(check: &RobotCheck, shown: &[SmallestDetectable]) -> Printout {
    let used = check.looks.len();
    let mut out = Printout::default();
    let percent = |p: f64| format!("{:.0} %", 100.0 * p);
    if let Some(remark) = too_alike_remark(check) {
        out.push(format!("{remark}\n"));
    }
    match check.named() {
        None => {
            let ratio = check.looks.last().map_or(0.0, |l| l.ratio);
            out.push(format!(
                "The calibration holds: {} with those of the calibration (evidence of a change {ratio:.2}, reported from {:.0}).\n",
                if used == 1 { "1 sample agrees".into() } else { format!("{used} samples agree") },
                1.0 / FALSE_ALARM
            ));
            if let Some(first) = check.conditions.first().filter(|j| j.condition != Condition::Valid) {
                out.push(format!(
                    "But a change is the more probable ({} {}): measure more poses before you rely on it.\n",
                    percent(first.probability),
                    condition_words(&first.condition)
                ));
            }
            out.push(shown_words(shown));
        }
        Some(first) => {
            let words = condition_words(&first.condition);
            let seen = if used < check.given {
                format!("after {used} of {} samples", check.given)
            } else {
                format!("samples: {used}")
            };
            out.push(format!("Changed: {words} ({}; {seen}).\n", percent(first.probability)));
            out.push(size_words(&first.condition, check.size.as_ref()));
            match first.condition.intervention() {
                Some(intervention) => out.push(intervention_words(&intervention).join("\n") + "\n"),
                None => out.push(format!("Do: {}.\n", what_to_do(&first.condition))),
            }
            out.push(closest_words(check, &first.condition));
            if !check.aliased.is_empty() {
                let others: Vec<String> = check.aliased.iter().map(condition_words).collect();
                out.push(format!("These poses cannot distinguish it from: {}.\n", others.join("; ")));
            }
            let rest: Vec<String> = check
                .conditions
                .iter()
                .filter(|j| j.condition != first.condition && j.probability >= LEAST)
                .map(|j| format!("{} {}", percent(j.probability), condition_words(&j.condition)))
                .collect();
            if !rest.is_empty() {
                out.push(format!("Otherwise: {}.\n", rest.join("; ")));
            }
        }
    }
    if let Some(remark) = noise_remark(check) {
        out.push(format!("{remark}\n"));
    }
    out.push(noise_words(&check.noise));
    let header = ["sample", "then", "change mm", "noise \u{b5}m", "evidence"];
    let rows: Vec<Vec<String>> = check
        .looks
        .iter()
        .map(|l| {
            let change = format!("{:.4}", l.change / MM);
            vec![l.sample.clone(), l.counterpart.clone(), change, format!("{:.1}", l.noise / UM), format!("{:.3e}", l.ratio)]
        })
        .collect();
    out + "\n" + plain_rows(header, rows)
}

/// Source of the noise of the comparison, as a line of its own.
fn noise_words(noise: &NoiseOf) -> String {
    match noise {
        NoiseOf::Repeats(scatter) => {
            let joints: Vec<String> =
                scatter.alarms().iter().map(|j| format!("joint {} by {:.0} \u{b5}rad", j.joint + 1, 1e6 * j.sigma)).collect();
            let misses = if joints.is_empty() {
                String::new()
            } else {
                format!("; from visit to visit {} (1 sigma)", joints.join(", "))
            };
            let rare = if scatter.tails > 1.05 {
                format!("; enlarged {:.1} times for the rare ones among them", scatter.tails)
            } else {
                String::new()
            };
            format!(
                "Noise from {} visits to {} poses of the campaign: {:.1} \u{b5}m white per axis{misses}{rare}.\n",
                scatter.events,
                scatter.postures,
                scatter.white / UM
            )
        }
        _ => "Noise as stated; the campaign came back to too few of its poses to estimate the robot's repeatability.\n".into(),
    }
}

/// The plan of a check as text: the samples to measure again, and what that would show.
#[must_use]
pub fn check_plan_text(sentinels: &[String], power: &[Power]) -> Printout {
    let sizes: Vec<f64> = power
        .iter()
        .find(|p| p.condition != Condition::Valid)
        .map(|p| p.at.iter().map(|a| a.size).collect())
        .unwrap_or_default();
    let mut out = Printout::from(format!("To measure again, in this order: {}.\n", sentinels.join(", ")));
    let false_alarms =
        power.iter().find(|p| p.condition == Condition::Valid).and_then(|p| p.at.first()).map_or(0.0, |a| a.found);
    out.push(format!(
        "False alarms in simulated checks: {:.1} % (at most {:.0} %).\nFound, and named, in per cent, by the displacement of the samples in units of the noise:\n\n",
        100.0 * false_alarms,
        100.0 * FALSE_ALARM
    ));
    let mut header = vec!["condition".to_owned()];
    header.extend(sizes.iter().map(|s| format!("{s} x noise")));
    header.push("samples".into());
    // Of single samples one line stands for all: the worst.
    let mut single: Option<&Power> = None;
    let mut rows = Vec::new();
    let row = |name: String, p: &Power| {
        let mut row = vec![name];
        row.extend(p.at.iter().map(|a| format!("{:.0}, {:.0}", 100.0 * a.found, 100.0 * a.named)));
        row.push(p.at.last().map_or_else(String::new, |a| format!("{:.1}", a.samples)));
        row
    };
    for p in power.iter().filter(|p| p.condition != Condition::Valid) {
        if let Condition::SingleSample(_) = p.condition {
            let named = |p: &Power| p.at.last().map_or(0.0, |a| a.named);
            single = Some(single.filter(|s| named(s) <= named(p)).unwrap_or(p));
            continue;
        }
        rows.push(row(condition_words(&p.condition), p));
    }
    if let Some(p) = single {
        rows.push(row("a single sample disagrees (the least clear)".into(), p));
    }
    out.push(plain_rows(header, rows));
    out.push(format!(
        "\n\nNamed: the condition itself, or one that these poses cannot distinguish from it. Samples: until it is named, at {} x the noise.\n",
        sizes.last().copied().unwrap_or_default()
    ));
    out
}
