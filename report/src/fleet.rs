//! Words and tables of a fleet: mean and spread of the parameters of one robot type.

use calibench::identify::fleet::{CONFLICT, Fleet, FleetJudged, FleetParameter, PriorUsed};

use super::printout::Printout;
use super::tables::plain_rows;

/// Agreement of a robot with its fleet, in a sentence.
#[must_use]
pub fn fleet_sentence(judged: &FleetJudged) -> String {
    let chance = if judged.chance < 1e-4 { "under 1e-4".to_owned() } else { format!("{:.2}", judged.chance) };
    let taken = format!("chance {chance}, and {CONFLICT} is required");
    match judged.used {
        PriorUsed::Fleet => format!("The robot is like its fleet ({taken}): the fleet is taken into account."),
        PriorUsed::None => {
            format!("The robot is not like its fleet ({taken}): the fleet is not used, and the data speak alone.")
        }
        PriorUsed::Catalogue => format!(
            "The robot is not like its fleet ({taken}), and these data do not determine it alone: three times the plausible sizes of the catalogue are used. Measure more poses."
        ),
    }
}

/// A fleet as a table.
#[must_use]
pub fn fleet_text(fleet: &Fleet) -> Printout {
    let row = |p: &FleetParameter| {
        let of = |number: f64| format!("{:.4}", number / p.unit.si);
        vec![
            p.name.clone(),
            of(p.mean),
            of(p.sigma),
            of(p.between),
            of(p.plausible),
            p.robots.to_string(),
            p.unit.symbol.into(),
        ]
    };
    let header = ["parameter", "mean deviation", "1 sigma of the next", "robot to robot", "catalogue", "robots", "unit"];
    let rows: Vec<Vec<String>> = fleet.parameters.iter().map(row).collect();
    let said = format!(
        "{} robots of the type {}. The next one is expected to deviate from nominal by the mean, give or take one sigma:\n",
        fleet.robots, fleet.robot
    );
    Printout::from(said) + plain_rows(header, rows) + "\n"
}
