//! Shape mismatch: the true effect only roughly has the shape of a catalogue effect, so the model that fits it is
//! slightly wrong.
//!
//! A catalogue fixes the constants in which its effects are not linear: an exponent, a torque at which play closes, a
//! time constant, a moment. A real robot need not have these values. At full mismatch the true constants lie anywhere
//! in the ranges given by the effect's file; at partial mismatch, in that share of the ranges.

use calibench::effects::EffectId;
use calibench::effects::facts::Stray;
use calibench::effects::situation::Situation;
use calibench::robot::sites::Site;
use rand::{Rng, RngExt};

use crate::flaw::{Flaw, TrueEffect};

/// Steps occur within these shares of the session.
const STEPS: [f64; 2] = [0.05, 0.95];

/// Distortion of the shape of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Distortion {
    /// `|x|` to the nominal power becomes `|x|` to another power.
    Power { nominal: f64, truly: f64 },
    /// `tanh(x)` becomes `tanh(x / this)`.
    Closing(f64),
    /// This share of the third harmonic is added to `sin` and `cos`.
    Overtone(f64),
    /// Time runs slower by this factor.
    Slower(f64),
    /// An event at `stated` (s) is shifted by the fraction `way` towards this `share` of the session.
    Moved { stated: f64, share: f64, way: f64 },
}

/// A catalogue effect with a distorted shape.
struct Misshapen {
    effect: TrueEffect,
    distortion: Distortion,
}

/// The effect with a shape sampled at this mismatch (0 to 1), if its family has a shape constant, as `stray` says. Always takes exactly one number
/// from `rng`.
pub(crate) fn misshapen(effect: TrueEffect, stray: Stray, mismatch: f64, rng: &mut impl Rng) -> Box<dyn Flaw> {
    let draw = rng.random_range(-1.0..=1.0f64);
    let swing = mismatch * draw;
    let id = effect.effect.id();
    let distortion = match stray {
        Stray::None => return Box::new(effect),
        Stray::Power { nominal, spread } => Distortion::Power { nominal, truly: nominal + spread * swing },
        Stray::Closing(factor) => Distortion::Closing(factor.powf(swing)),
        Stray::Slower(factor) => Distortion::Slower(factor.powf(swing)),
        Stray::Overtone(share) => Distortion::Overtone(share * swing),
        Stray::Moment => {
            let stated = EffectId::new(id).last_argument().and_then(|t| t.parse().ok()).unwrap_or(0.0);
            let share = STEPS[0] + (STEPS[1] - STEPS[0]) * 0.5 * (1.0 + draw);
            Distortion::Moved { stated, share, way: mismatch }
        }
    };
    Box::new(Misshapen { effect, distortion })
}

impl Distortion {
    /// Distorts a weight of the catalogue; sines have even parameter numbers, cosines odd ones.
    fn weight(self, parameter: usize, w: f64) -> f64 {
        match self {
            Distortion::Power { nominal, truly } => w.signum() * w.abs().powf(truly / nominal),
            Distortion::Closing(torque) => (w.atanh() / torque).tanh(),
            // sin 3a = 3 sin a - 4 sin³ a, cos 3a = 4 cos³ a - 3 cos a
            Distortion::Overtone(share) => {
                let third = 3.0 * w - 4.0 * w.powi(3);
                w + share * if parameter.is_multiple_of(2) { third } else { -third }
            }
            Distortion::Slower(_) | Distortion::Moved { .. } => w,
        }
    }

    /// Distorted time at which the catalogue's effect is evaluated, s.
    fn time_s(self, time_s: f64, duration_s: f64) -> f64 {
        match self {
            Distortion::Slower(factor) => time_s / factor,
            Distortion::Moved { stated, share, way } => time_s + way * (stated - share * duration_s),
            Distortion::Power { .. } | Distortion::Closing(_) | Distortion::Overtone(_) => time_s,
        }
    }
}

impl Flaw for Misshapen {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        let time_s = at.time_s.zip(at.duration_s).map(|(t, d)| self.distortion.time_s(t, d));
        let TrueEffect { effect, sizes } = &self.effect;
        effect.terms(&Situation { time_s, ..*at }, &mut |k, site, w| {
            moved(site, self.distortion.weight(k, w) * sizes[k]);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mismatch_is_the_catalogue() {
        let none = [
            Distortion::Power { nominal: 3.0, truly: 3.0 },
            Distortion::Closing(1.0),
            Distortion::Overtone(0.0),
            Distortion::Slower(1.0),
            Distortion::Moved { stated: 60.0, share: 0.3, way: 0.0 },
        ];
        for distortion in none {
            for w in [-1.0, -0.7, 0.0, 0.2, 0.99] {
                // Two transcendental functions, each accurate to an ulp or two.
                assert!((distortion.weight(0, w) - w).abs() < 1e-14, "{distortion:?} {w}");
            }
            assert_eq!(distortion.time_s(77.0, 1000.0), 77.0);
        }
    }

    #[test]
    fn shapes_become_what_they_are_said_to() {
        let x = 0.6f64;
        assert!((Distortion::Power { nominal: 3.0, truly: 2.2 }.weight(0, -x.powi(3)) + x.powf(2.2)).abs() < 1e-14);
        assert!((Distortion::Closing(2.0).weight(0, x.tanh()) - (x / 2.0).tanh()).abs() < 1e-14);
        let overtone = Distortion::Overtone(0.05);
        assert!((overtone.weight(0, x.sin()) - x.sin() - 0.05 * (3.0 * x).sin()).abs() < 1e-14);
        assert!((overtone.weight(1, x.cos()) - x.cos() - 0.05 * (3.0 * x).cos()).abs() < 1e-14);
        // A step stated at 60 s that truly happens at 300 s of 1000.
        let moved = Distortion::Moved { stated: 60.0, share: 0.3, way: 1.0 };
        assert!((moved.time_s(300.0, 1000.0) - 60.0).abs() < 1e-9);
    }
}
