//! `effects`, `robots`: what there is.

use calibench::effects::{CATALOGUE, Subject, build};
use calibench::report::plain_table;
use calibench::robot::{BUILT_IN, built_in};
use calibench::units::{DEG, MM};
use serde_json::json;

use super::{Failure, Outcome, print, print_json};

#[derive(clap::Args)]
pub struct Arguments {
    /// Print one JSON document instead of a table
    #[arg(long)]
    json: bool,
}

pub fn effects(arguments: &Arguments) -> Result<Outcome, Failure> {
    let robot = built_in("kr6_r700").ok_or("the KR6 is built in")?;
    let balls = ["1".to_owned()];
    let subject = Subject { robot: &robot, balls: &balls };
    // An example of each family: joint 2, order 17, ball 1 where arguments are needed.
    let example = |id: &str, arguments: &str| match arguments {
        ":J" => format!("{id}:2"),
        ":J:k" => format!("{id}:2:17"),
        ":B" => format!("{id}:1"),
        _ => id.to_owned(),
    };
    let mut rows = Vec::new();
    let mut documents = Vec::new();
    for family in CATALOGUE {
        let effect = build(&example(family.id, family.arguments), &subject)?;
        let needs: Vec<&str> = effect.needs().iter().map(|n| n.words()).collect();
        let units: Vec<&str> = effect.parameters().iter().map(|p| p.unit.symbol).collect();
        let mut distinct = units.clone();
        distinct.dedup();
        let parameters: Vec<_> = effect
            .parameters()
            .iter()
            .map(|p| json!({"name": p.name, "unit": p.unit.symbol, "plausible": p.unit.from_si(p.prior)}))
            .collect();
        rows.push([
            format!("{}{}", family.id, family.arguments),
            family.what.into(),
            family.equation.into(),
            distinct.join(", "),
            needs.join(", "),
        ]);
        documents
            .push(json!({"id": family.id, "arguments": family.arguments, "what": family.what, "equation": family.equation,
            "example": effect.id(), "parameters": parameters, "needs": needs}));
    }
    if arguments.json {
        print_json(&json!({"format": "calibench-effects/1", "effects": documents}))?;
    } else {
        print(&plain_table(&["effect", "what it is", "what it adds", "units", "needs"], &rows))?;
    }
    Ok(Outcome::Done)
}

pub fn robots(arguments: &Arguments) -> Result<Outcome, Failure> {
    let all: Vec<_> = BUILT_IN.iter().filter_map(|name| built_in(name)).collect();
    if arguments.json {
        let documents: Vec<_> = all
            .iter()
            .map(|r| {
                let links: Vec<_> = r
                    .links
                    .iter()
                    .map(|l| json!({"alpha_deg": l.mdh.alpha / DEG, "a_mm": l.mdh.a / MM, "beta_deg": l.mdh.beta / DEG,
                        "theta_deg": l.mdh.theta / DEG, "d_mm": l.mdh.d / MM, "min_deg": l.limits[0] / DEG, "max_deg": l.limits[1] / DEG,
                        "mass_kg": l.mass}))
                    .collect();
                json!({"name": r.name, "source": r.source, "joints": r.joints(), "links": links})
            })
            .collect();
        print_json(&json!({"format": "calibench-robots/1", "robots": documents}))?;
        return Ok(Outcome::Done);
    }
    for robot in &all {
        print(&format!("{} ({} joints): {}", robot.name, robot.joints(), robot.source))?;
        let rows: Vec<[String; 7]> = robot
            .links
            .iter()
            .enumerate()
            .map(|(i, l)| {
                let g = |v: f64| format!("{v:.3}");
                [
                    (i + 1).to_string(),
                    g(l.mdh.alpha / DEG),
                    g(l.mdh.a / MM),
                    g(l.mdh.theta / DEG),
                    g(l.mdh.d / MM),
                    format!("{:.0} .. {:.0}", l.limits[0] / DEG, l.limits[1] / DEG),
                    g(l.mass),
                ]
            })
            .collect();
        print(&plain_table(&["i", "alpha_{i-1} deg", "a_{i-1} mm", "theta_i deg", "d_i mm", "limits deg", "mass kg"], &rows))?;
    }
    Ok(Outcome::Done)
}
