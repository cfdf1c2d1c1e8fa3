//! One page of the gallery: an effect, what it looks like, what imitates it, and what parts them.

use std::fmt::Write;

use calibench::effects::Needs;
use calibench::effects::facts::{Follows, Intervention};
use calibench::effects::registry::Registry;
use calibench::residuals::Look;

use super::see::Seen;
use crate::effect_names::capital;
use crate::plausible::Plausible;

/// Share of an effect that another must explain to be named as its imitator.
const WORTH_A_NAME: f64 = 0.1;

/// Share from which no fit of these data can distinguish the two.
const THE_SAME: f64 = 0.99;

/// An effect that could pass for another.
#[derive(Debug, Clone, PartialEq)]
pub struct Imitator {
    /// Its id.
    pub effect: String,
    /// Share of what the fitted model does not absorb of the other that it takes, at best.
    pub share: f64,
}

/// An effect as the gallery shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Its family.
    pub family: &'static str,
    /// Its id.
    pub effect: String,
    /// The campaign into which it was injected, in a clause.
    pub campaign: String,
    /// Its parameters as injected: name, deviation from nominal and unit.
    pub sizes: Vec<(String, f64, String)>,
    /// Its size in plausible sizes.
    pub times: f64,
    /// Rms of what the fitted model does not absorb of it at one plausible size, in units of the noise.
    pub visible: f64,
    /// The best imitator of every other family, best first.
    pub imitators: Vec<Imitator>,
    /// The picture.
    pub seen: Seen,
    /// The same effect once the best imitator is in the model.
    pub beside: Option<Seen>,
    /// The plausible sizes of its parameters.
    pub plausible: Plausible,
    /// The data that it needs.
    pub needs: Vec<Needs>,
    /// True if the model of the picture lacks a part of every model.
    pub baseline: bool,
}

impl Entry {
    /// The page.
    pub(super) fn page(&self) -> String {
        let Some(f) = Registry::catalogue().family(&self.effect) else { return String::new() };
        let look = Look::of(f);
        let mut out = String::new();
        let mut say = |text: &str| _ = writeln!(out, "{text}");
        say(&format!("# {}\n", capital(f.what)));
        say(&format!("`{}{}`, of the {}: {}.\n", f.id, f.arguments, f.origin.name(), f.meaning.physics));
        say(&format!("![{}]({}.svg)\n", self.seen.plot.title, f.id));
        say("## What it looks like\n");
        f.signature.looks.iter().for_each(|sentence| say(sentence));
        say(&format!("\n{}\n", self.picture()));
        say("## What imitates it\n");
        say(&self.imitated());
        say("## Which measurement distinguishes them\n");
        say(&format!("{}\n", f.signature.parted_by));
        say("## What to do at the machine\n");
        say(&match f.meaning.intervention {
            Intervention { act: "", .. } => "There is nothing to repair: add it to the model.\n".to_owned(),
            Intervention { work, act, verify } => {
                format!("{}. Verified by: {verify}. If nothing is done, {}.\n", capital(act), work.if_nothing_is_done())
            }
        });
        say("## In figures\n");
        say("| | |");
        say("|---|---|");
        say(&format!("| equation | `{}` |", f.equation.replace('|', "\\|")));
        say(&format!("| plausible size | {} |", self.plausible));
        say(&format!("| depends on | {} |", follows(f.follows)));
        say(&format!("| columns and data needed | {} |", needs(&self.needs)));
        say(&format!("| met at | [step {}](first-look.md): {} |", look as usize + 1, lower(look.picture())));
        say(&format!("| add it | `calibench add {} DATASET` |", self.effect));
        out
    }

    /// Caption of the picture.
    fn picture(&self) -> String {
        let sizes: Vec<String> = self
            .sizes
            .iter()
            .take(6)
            .map(|(name, value, unit)| format!("{name} {} {unit}", signed(*value)).trim_end().to_owned())
            .collect();
        let more = if self.sizes.len() > 6 { format!(" and {} more", self.sizes.len() - 6) } else { String::new() };
        let times = if (self.times - 1.0).abs() < 0.05 {
            "one plausible size".to_owned()
        } else {
            format!("{} times its plausible size", two(self.times))
        };
        let faint = if self.visible < 1.0 {
            format!("\nAt one plausible size it would be {} of the noise: these data do not show it.", two(self.visible))
        } else {
            String::new()
        };
        let lacks = if self.baseline { "A model without it" } else { "The model without it" };
        format!(
            "The picture is of {}: {}, with {}{more}, {times}.\n{lacks} leaves {} rms; with it, {} remains.\nThe {} {:.0} % of the plotted squares.{faint}",
            self.campaign,
            Registry::catalogue().in_words(&self.effect),
            sizes.join(", "),
            self.seen.rms[0],
            self.seen.rms[1],
            match (self.seen.plot.marked.is_empty(), self.seen.plot.taken.is_empty()) {
                (true, true) => "curve explains",
                (true, false) => "diamonds explain",
                (false, _) => "marked sample contains",
            },
            100.0 * self.seen.plot.explained,
        )
    }

    fn imitated(&self) -> String {
        let worth: Vec<&Imitator> = self.imitators.iter().filter(|i| i.share >= WORTH_A_NAME).take(4).collect();
        let [first, ..] = worth[..] else {
            return match self.imitators.first() {
                Some(i) => format!(
                    "Nothing in this campaign: no other effect absorbs more than {:.0} % of it.\n",
                    (100.0 * i.share).ceil()
                ),
                None => "Nothing in this campaign.\n".to_owned(),
            };
        };
        let mut out = String::from(
            "Fitted in its place, another effect absorbs at best this share of what the model leaves of it in this campaign:\n\n| effect | absorbs |\n|---|---|\n",
        );
        for i in &worth {
            let page = Registry::catalogue()
                .family(&i.effect)
                .map_or(String::new(), |f| format!("[{}]({}.md)", Registry::catalogue().in_words(&i.effect), f.id));
            _ = writeln!(out, "| {page} | {:.0} % |", 100.0 * i.share);
        }
        if first.share >= THE_SAME {
            _ = writeln!(out, "\nThese data cannot distinguish it from the {}.", Registry::catalogue().in_words(&first.effect));
        }
        if let Some(beside) = &self.beside {
            _ = writeln!(
                out,
                "\nWith the {} fitted in its place {} remains, and this is where it shows:\n\n![{}]({}-beside.svg)",
                Registry::catalogue().in_words(&first.effect),
                beside.rms[0],
                beside.plot.title,
                self.family
            );
        }
        out.push('\n');
        out
    }
}

/// The quantities on which the error depends, in words.
fn follows(all: &[Follows]) -> String {
    let word = |f: &Follows| match f {
        Follows::JointAngle => "the joint's own angle",
        Follows::JointAngleInProportion => "the joint's own angle, in proportion",
        Follows::OtherAngles => "the angles of other joints",
        Follows::JointTorque => "the joint's own torque",
        Follows::OtherTorque => "the torque of another joint",
        Follows::Load => "moments and forces of gravity",
        Follows::Payload => "the payload",
        Follows::Approach => "the side of approach",
        Follows::Commanded => "commanded minus reported angle",
        Follows::LastMove => "the last move",
        Follows::Time => "time",
        Follows::Temperature => "temperature",
        Follows::World => "nothing: the same in the room at every sample",
        Follows::Tool => "nothing: the same in the tool at every sample",
        Follows::Reading => "the readings of the indicators",
        Follows::Plunger => "the side from which a plunger came",
        Follows::Ball => "the ball",
        Follows::PlaceInArtifact => "the place of the ball in the artifact",
        Follows::Point => "the place of the measured point",
        Follows::Sample => "the sample",
    };
    // Beside another dependence, "the same everywhere" says where it acts.
    let acts = |f: &Follows| match f {
        Follows::World if all.len() > 1 => "acts in the room",
        Follows::Tool if all.len() > 1 => "acts in the tool",
        f => word(f),
    };
    if all.is_empty() { "posture".to_owned() } else { all.iter().map(acts).collect::<Vec<_>>().join("; ") }
}

fn needs(all: &[Needs]) -> String {
    if all.is_empty() {
        "joint angles and positions".to_owned()
    } else {
        all.iter().map(|n| n.words()).collect::<Vec<_>>().join(", ")
    }
}

/// Two significant digits.
fn two(x: f64) -> String {
    let digits = (1 - x.abs().max(1e-9).log10().floor() as i32).clamp(0, 9) as usize;
    format!("{x:.digits$}")
}

fn signed(x: f64) -> String {
    let text = two(x.abs());
    format!("{}{text}", if x < 0.0 { "−" } else { "+" })
}

pub(super) fn lower(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().to_string() + letters.as_str())
}
