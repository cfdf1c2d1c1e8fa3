//! `effects` and `effects list`: the built-in effects.

use calibench::effects::catalogue::CATALOGUE;
use calibench::effects::family::{Family, Origin, Scan};
use calibench::effects::registry::Registry;
use calibench::effects::{EffectId, Subject, build};
use calibench::robot::built_in;
use calibench_report::{Plausible, Printout, column, documents, gallery_page, intervention_words, optional, plain_table};
use serde_json::json;

use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print_answer, print_json};

#[derive(clap::Args)]
pub struct Arguments {
    /// Describe one family in full: what it looks like, what distinguishes it from others, and its page in the gallery
    #[arg(value_name = "NAME", conflicts_with = "json")]
    name: Option<String>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let robot = built_in("kr6_r700").ok_or("the KR6 is built in")?;
    let balls = ["1".to_owned()];
    let subject = Subject::new(&robot, &balls);
    if let Some(name) = &arguments.name {
        let family = Registry::catalogue()
            .family(name)
            .ok_or_else(|| format!("'{name}' is not an effect of the catalogue; `calibench effects` lists it"))?;
        print_answer(told(family, &subject)?)?;
        return Ok(Outcome::Done);
    }
    let mut documents = Vec::new();
    for origin in Origin::ALL {
        let mut rows = Vec::new();
        for family in CATALOGUE.iter().filter(|f| f.origin == origin) {
            let effect = build(&example(family, &subject), &subject)?;
            let needs: Vec<&str> = effect.needs().iter().map(|n| n.words()).collect();
            let parameters: Vec<_> = effect
                .parameters()
                .iter()
                .map(|p| json!({"name": p.name, "unit": p.unit.symbol, "plausible": p.unit.from_si(p.prior)}))
                .collect();
            rows.push([
                format!("{}{}", family.id, family.arguments),
                family.what.into(),
                family.equation.into(),
                Plausible::of(effect.as_ref()).to_string(),
                needs.join(", "),
            ]);
            documents.push(json!({"id": family.id, "arguments": family.arguments, "origin": origin.name(),
                "scan": scan(family.scan), "what": family.what, "equation": family.equation, "example": effect.id(),
                "members": family.ids(&subject), "parameters": parameters, "needs": needs,
                "intervention": documents::Intervention::from(family.meaning.intervention)}));
        }
        if !arguments.json {
            let [what, adds] = [column("what it is"), optional(2, "what it adds")];
            let header = [column("effect"), what, adds, column("plausible"), optional(1, "needs")];
            print_answer(Printout::from(format!("Of the {}:\n", origin.name())) + plain_table(header, rows))?;
        }
    }
    if arguments.json {
        print_json(&json!({"format": "calibench-effects/1", "effects": documents}))?;
    } else {
        print_answer(
            "J, K: a joint. B: a ball. R: a target. I: an indicator. k: a whole number. T: seconds since the session began. ID: a sample.",
        )?;
        print_answer(
            "t: time as a share of the session, 0 to 1. h: height over the lowest ball, 1 at the highest. e: an indicator's axis. r: its reading.",
        )?;
        print_answer("tau: the load's moment about a joint. c: its compliance in the model. The sizes are those of the KR6.")?;
    }
    Ok(Outcome::Done)
}

/// One family in full.
fn told(family: &Family, subject: &Subject<'_>) -> Result<String, Failure> {
    let effect = build(&example(family, subject), subject)?;
    let needs: Vec<&str> = effect.needs().iter().map(|n| n.words()).collect();
    let mut lines = vec![format!("{}{}: {} ({}).", family.id, family.arguments, family.what, family.meaning.physics)];
    lines.extend(family.signature.looks.iter().map(|&sentence| sentence.to_owned()));
    lines.push(format!("What distinguishes it from others: {}", family.signature.parted_by));
    lines.extend(intervention_words(&family.meaning.intervention));
    lines.push(format!("Equation: {}; plausible: {}.", family.equation, Plausible::of(effect.as_ref())));
    if !needs.is_empty() {
        lines.push(format!("Needs: {}.", needs.join(", ")));
    }
    lines.extend(gallery_page(family.id).map(|page| format!("Pictures: {page}")));
    Ok(lines.join("\n"))
}

/// An example of a family: the member for joint 2, ball 1 or indicator 1, with order 17 or time 600 if it needs such an
/// argument.
fn example(family: &Family, subject: &Subject<'_>) -> String {
    let of_second_joint = |ids: Vec<String>| {
        let second =
            ids.iter().find(|id| EffectId::new(id).argument(0) == Some("2")).filter(|_| family.arguments.starts_with(":J"));
        // Members that only data know have a name of their own.
        second.or(ids.first()).cloned().unwrap_or_else(|| format!("{}:b", family.id))
    };
    match family.scan {
        Scan::None => of_second_joint(family.ids(subject)),
        Scan::Order => of_second_joint(family.scanned(subject, "17")),
        Scan::Time => of_second_joint(family.scanned(subject, "600")),
        Scan::Sample => of_second_joint(family.scanned(subject, "p001")),
    }
}

fn scan(scan: Scan) -> Option<&'static str> {
    match scan {
        Scan::None => None,
        Scan::Order => Some("order"),
        Scan::Time => Some("time"),
        Scan::Sample => Some("sample"),
    }
}
