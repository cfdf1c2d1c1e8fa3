//! Shifts of the parameters caused by each effect that the model lacks: tables by the unit of the parameters.

use super::effect_names::called;
use super::printout::Printout;
use super::tables::{Table, plain_rows};
use calibench::diagnosis::shifts::{Shift, Shifts, shift_of};
use calibench::units::Unit;

/// Decimal places of a printed shift, in the parameter's unit or the finer one of [`FINER`].
const PLACES: usize = 2;

/// Units whose shifts are printed in thousandths, with the symbol of the finer unit.
const FINER: [(Unit, &str); 2] = [(Unit::MM, "µm"), (Unit::DEG, "mdeg")];

/// The shifts as tables: one row per effect, one column per parameter, compliances first; the last row combines all effects.
pub fn shifts_text(s: &Shifts) -> Printout {
    let mut units: Vec<Unit> = Vec::new();
    for parameter in &s.parameters {
        if !units.contains(&parameter.unit) {
            units.push(parameter.unit);
        }
    }
    units.sort_by_key(|unit| *unit != Unit::MDEG_PER_NM);
    let mut out = Printout::default();
    for unit in units {
        out = out + table(s, unit) + "\n";
    }
    out.push(
        "Shift of each parameter, one sigma, when the truth holds an effect at its plausible size (each of its numbers, one sigma, \
         independently) and the model does not; without noise, to first order.",
    );
    let untestable: Vec<String> = s.untestable.iter().map(|u| called(&s.registry, &u.effect)).collect();
    if !untestable.is_empty() {
        out.push(format!("\nThese data cannot show: {}", untestable.join("; ")));
    }
    out
}

/// The table of the parameters of one unit.
fn table(s: &Shifts, unit: Unit) -> Table {
    let (scale, called) =
        FINER.iter().find(|(u, _)| *u == unit).map_or((1.0, unit.printed()), |(_, finer)| (1e3, (*finer).into()));
    let columns: Vec<usize> = (0..s.parameters.len()).filter(|&k| s.parameters[k].unit == unit).collect();
    let mut header = vec![format!("shift, {called}"), "plausible size".to_owned()];
    header.extend(columns.iter().map(|&k| s.parameters[k].name.clone()));
    let row = |name: String, size: String, numbers: &[Shift]| {
        let cell = |&k: &usize| format!("{:.PLACES$}", scale * unit.from_si(shift_of(numbers, k)));
        [name, size].into_iter().chain(columns.iter().map(cell)).collect::<Vec<String>>()
    };
    let mut rows: Vec<Vec<String>> =
        s.effects().map(|numbers| row(numbers[0].effect.to_string(), size(&numbers[0]), numbers)).collect();
    rows.push(row("all of them".into(), String::new(), &s.shifts));
    plain_rows(header, rows)
}

/// The plausible size of an effect's first parameter, to two significant digits.
fn size(shift: &Shift) -> String {
    let size = shift.unit.from_si(shift.size);
    let digits = if size > 0.0 { (1.0 - size.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{size:.digits$} {}", shift.unit.printed())
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::diagnosis::shifts::Shifted;
    use calibench::effects::registry::Registry;

    fn shifts() -> Shifts {
        let shift = |effect: &str, number: &str, by: [f64; 2]| Shift {
            effect: effect.into(),
            number: number.into(),
            size: Unit::URAD.to_si(70.0),
            unit: Unit::URAD,
            by: by.to_vec(),
        };
        let parameter = |name: &str, unit: Unit| Shifted { name: name.into(), unit };
        let c = Unit::MDEG_PER_NM;
        Shifts {
            parameters: vec![parameter("a1", Unit::MM), parameter("c2", c)],
            shifts: vec![
                shift("wave", "wave.sin", [3e-6, c.to_si(0.3)]),
                shift("wave", "wave.cos", [-4e-6, 0.0]),
                shift("lean", "lean.k", [12e-6, c.to_si(-0.4)]),
            ],
            untestable: Vec::new(),
            registry: Registry::default(),
        }
    }

    #[test]
    fn numbers_of_an_effect_add_up_in_squares_and_compliances_come_first() {
        let text = shifts_text(&shifts()).to_string();
        assert!(text.find("c2").unwrap() < text.find("a1").unwrap());
        // Triangle 3-4-5 for the wave; 5-12-13 for both effects together.
        for row in [["wave", "5.00"], ["lean", "12.00"], ["all of them", "13.00"]] {
            let last = text.lines().rfind(|l| l.contains(row[0])).unwrap();
            assert!(last.contains(row[1]), "{last}");
        }
        assert!(text.contains("0.50"), "{text}");
    }

    #[test]
    fn the_document_keeps_signs_and_units() {
        let document = crate::documents::Shifts::of(&shifts());
        let lean = &document.numbers[2];
        assert_eq!((lean.number.as_str(), lean.unit.as_str()), ("lean.k", "urad"));
        assert!((lean.shift["a1"] - 0.012).abs() < 1e-12);
        assert!((lean.shift["c2"] + 0.4).abs() < 1e-12);
    }
}
