//! The plausible sizes of an effect's parameters, in words.

use std::borrow::Cow;
use std::fmt;

use calibench::effects::Effect;
use calibench::units::Unit;

/// The distinct plausible sizes of an effect's parameters, as text and unit, in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Plausible(Vec<(String, Cow<'static, str>)>);

impl Plausible {
    /// Those of an effect.
    pub fn of(effect: &dyn Effect) -> Self {
        let mut sizes: Vec<(String, Cow<'static, str>)> = Vec::new();
        for p in effect.parameters() {
            let size = p.unit.from_si(p.prior);
            // A plausible size has no more than two significant digits.
            let digits = (1 - size.abs().log10().floor() as i32).clamp(0, 9) as usize;
            let text = format!("{size:.digits$}");
            let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
            let symbol = if p.unit == Unit::RATIO { "".into() } else { p.unit.printed() };
            let size = (text, symbol);
            if !sizes.contains(&size) {
                sizes.push(size);
            }
        }
        Plausible(sizes)
    }
}

impl fmt::Display for Plausible {
    /// `0.05 deg, 0.3 mm`; if there are many, the first and the last only.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0[..] {
            [(first, unit), .., (last, same)] if self.0.len() > 2 && unit == same => write!(f, "{first} ... {last} {unit}"),
            sizes => {
                let all: Vec<String> =
                    sizes.iter().map(|(size, unit)| format!("{size} {unit}").trim_end().to_owned()).collect();
                f.write_str(&all.join(", "))
            }
        }
    }
}
