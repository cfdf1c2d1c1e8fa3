//! Whether a field is to be used at given postures: conditions, each with its numbers.

use super::divisions::{Measured, Parting};
use super::expected::Expected;
use crate::diagnosis::folds::Division;

/// Largest ratio of the error that the field expects of itself to that of the model alone.
const MOST_RATIO: f64 = 0.9;

/// Least gain, in its standard errors, at left-out random postures and parts in time.
const LEAST_SIGMAS: f64 = 1.0;

/// Number of the divisions nearest in leverage that must gain.
const NEAREST: usize = 2;

/// Largest leverage: farther away nothing speaks for a field.
const MOST_LEVERAGE: f64 = 3.0;

/// Largest probability that the error is larger after the correction than before.
const MOST_CHANCE: f64 = 0.05;

/// What a condition is about.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Matter {
    /// The error by the field's own covariance over that by the model's.
    OwnRatio,
    /// Gain over its standard error, in a division.
    Sigmas(Parting),
    /// Gain in one of the divisions that are as far as the postures.
    Gain(Parting),
    /// Leverage of the postures.
    Leverage,
    /// Probability, by draws, that the mean error is larger after the correction.
    ChanceOfHarm,
    /// Expected error after the correction over that before, by draws.
    DrawnRatio,
}

/// A condition of the gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// What it is about.
    pub matter: Matter,
    /// The value found.
    pub found: f64,
    /// The limit.
    pub limit: f64,
    /// True if the value has to exceed it, false if it must not.
    pub is_least: bool,
}

impl Condition {
    fn least(matter: Matter, found: f64, limit: f64) -> Self {
        Condition { matter, found, limit, is_least: true }
    }

    fn most(matter: Matter, found: f64, limit: f64) -> Self {
        Condition { matter, found, limit, is_least: false }
    }

    /// True if it holds; what is not a number holds nothing.
    pub fn holds(&self) -> bool {
        if self.is_least { self.found > self.limit } else { self.found <= self.limit }
    }
}

/// The conditions under which a field is used.
#[derive(Debug, Clone, PartialEq)]
pub struct Gate {
    /// All of them.
    pub conditions: Vec<Condition>,
}

impl Gate {
    /// True if all hold.
    pub fn is_open(&self) -> bool {
        self.conditions.iter().all(Condition::holds)
    }

    /// The gate of a field, with the errors to expect without it and with it, what the divisions measured, and the mean lengths
    /// of the error, without the correction and with it, one pair a draw.
    pub(super) fn of([before, after]: [&Expected; 2], divisions: &[Measured], drawn: &[[f64; 2]]) -> Self {
        let mut conditions = vec![Condition::most(Matter::OwnRatio, after.own / before.own, MOST_RATIO)];
        let tested = |d: &&Measured| matches!(d.parting.division, Division::Random | Division::Time);
        for division in [Division::Random, Division::Time] {
            let found = divisions.iter().filter(tested).find(|d| d.parting.division == division);
            let parting = found.map_or(Parting { division, count: 0 }, |d| d.parting);
            let sigmas = found.map_or(f64::NAN, |d| d.gain / d.sigma.max(f64::MIN_POSITIVE));
            conditions.push(Condition::least(Matter::Sigmas(parting), sigmas, LEAST_SIGMAS));
        }
        let mut near: Vec<&Measured> = divisions.iter().filter(|d| d.parting.division != Division::Time).collect();
        let distance = |d: &Measured| (d.leverage / before.leverage).ln().abs();
        near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        conditions.extend(near.iter().take(NEAREST).map(|d| Condition::least(Matter::Gain(d.parting), d.gain, 0.0)));
        conditions.push(Condition::most(Matter::Leverage, before.leverage, MOST_LEVERAGE));
        let count = drawn.len().max(1) as f64;
        let harmed = drawn.iter().filter(|[before, after]| after > before).count() as f64 / count;
        let mean = |k: usize| drawn.iter().map(|pair| pair[k]).sum::<f64>() / count;
        conditions.push(Condition::most(Matter::ChanceOfHarm, if drawn.is_empty() { 1.0 } else { harmed }, MOST_CHANCE));
        conditions.push(Condition::most(Matter::DrawnRatio, mean(1) / mean(0), MOST_RATIO));
        Gate { conditions }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(own: f64, gain: f64, leverage: f64, drawn: &[[f64; 2]]) -> Gate {
        let at = |own: f64| Expected { leverage, measured: own, own, spread: 0.1 };
        let of = |division: Division, leverage: f64, gain: f64| Measured {
            parting: Parting { division, count: 10 },
            leverage,
            errors: [1.0, 0.5],
            gain,
            sigma: 0.1,
        };
        let divisions = [
            of(Division::Random, 0.1, gain),
            of(Division::Time, 0.1, gain),
            of(Division::Blocks, 0.3, 0.01),
            of(Division::Blocks, 0.9, -0.3),
        ];
        Gate::of([&at(1.0), &at(own)], &divisions, drawn)
    }

    fn failing(gate: &Gate) -> Vec<Matter> {
        gate.conditions.iter().filter(|c| !c.holds()).map(|c| c.matter).collect()
    }

    #[test]
    fn every_condition_closes_the_gate_alone_and_says_so() {
        let drawn = [[1.0, 0.5]; 20];
        let open = gate(0.5, 0.3, 0.2, &drawn);
        assert!(open.is_open() && open.conditions.len() == 8, "{open:?}");
        assert_eq!(failing(&gate(0.95, 0.3, 0.2, &drawn)), [Matter::OwnRatio]);
        let [random, time] = [Division::Random, Division::Time].map(|division| Parting { division, count: 10 });
        assert_eq!(failing(&gate(0.5, 0.05, 0.2, &drawn)), [Matter::Sigmas(random), Matter::Sigmas(time)]);
        // The blocks that lose are as far away as these postures.
        assert_eq!(failing(&gate(0.5, 0.3, 0.7, &drawn)), [Matter::Gain(Parting { division: Division::Blocks, count: 10 })]);
        assert!(failing(&gate(0.5, 0.3, 3.1, &drawn)).contains(&Matter::Leverage));
        let mut harmed = drawn;
        harmed[0] = [0.1, 0.2];
        assert!(gate(0.5, 0.3, 0.2, &harmed).is_open());
        harmed[1] = [0.1, 0.2];
        assert_eq!(failing(&gate(0.5, 0.3, 0.2, &harmed)), [Matter::ChanceOfHarm]);
        assert_eq!(failing(&gate(0.5, 0.3, 0.2, &[[1.0, 0.95]; 20])), [Matter::DrawnRatio]);
        assert!(!gate(0.5, 0.3, 0.2, &[]).is_open());
    }
}
