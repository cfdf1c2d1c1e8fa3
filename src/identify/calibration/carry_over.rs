//! Values of a calibration that apply to the parameters of other data.

use super::{Calibration, MeasuredSetup};
use crate::effects::Owner;
use crate::identify::problem::{Parameter, Prior, Problem, Setup};
use crate::robot::sites::Axis6;

impl Calibration {
    /// The calibrated deviations of another problem's parameters, and those parameters that are unknown because their
    /// set-up is unseen.
    pub fn values_for(&self, problem: &Problem) -> (Vec<f64>, Vec<usize>) {
        let mut values = problem.start();
        let mut unseen = Vec::new();
        for (p, parameter) in problem.parameters().iter().enumerate() {
            match self.value_for(parameter, problem) {
                Some(value) => values[p] = value - parameter.start,
                None if parameter.knowledge == Prior::Uninformative => unseen.push(p),
                None => {}
            }
        }
        (values, unseen)
    }

    /// The calibrated (or nominal) value of a parameter of another problem; `None` if it belongs to an unseen set-up or
    /// ball.
    fn value_for(&self, parameter: &Parameter, problem: &Problem) -> Option<f64> {
        let name = self.name_for(parameter, problem)?;
        let value = self.estimate(&name).map(|e| e.value);
        match parameter.owner {
            Owner::Robot => Some(value.unwrap_or(parameter.start)),
            Owner::Artifact => value.or_else(|| self.knows(&name).then_some(parameter.start)),
            Owner::Session => {
                let base = &self.seen(&problem.setups()[parameter.setup?])?.base;
                let plain = parameter.spec.name.as_str();
                let left = || match Axis6::ALL.iter().find(|axis| plain == format!("base_{}", axis.name())) {
                    Some(&axis) => base.to_array()[axis as usize],
                    None => parameter.start,
                };
                Some(value.unwrap_or_else(left))
            }
        }
    }

    /// The name in this calibration of a parameter of another problem; `None` if it belongs to an unseen set-up.
    pub fn name_for(&self, parameter: &Parameter, problem: &Problem) -> Option<String> {
        let plain = parameter.spec.name.as_str();
        if parameter.owner == Owner::Robot {
            return Some(plain.to_owned());
        }
        let seen = self.seen(&problem.setups()[parameter.setup?])?;
        let several = || self.setups.iter().any(|s| s.dataset != self.setups[0].dataset);
        Some(match parameter.owner {
            Owner::Artifact if several() => labelled(plain, &seen.dataset),
            // Beside data that are only judged, those that are fitted have their name.
            Owner::Artifact => {
                Some(labelled(plain, &seen.dataset)).filter(|name| self.knows(name)).unwrap_or_else(|| plain.to_owned())
            }
            Owner::Robot | Owner::Session => self.name_in(seen, plain),
        })
    }

    /// The name of a parameter of a set-up: with its label, or with that of its dataset, or without any, if all sessions share it.
    pub fn name_in(&self, setup: &MeasuredSetup, plain: &str) -> String {
        let names = [&setup.label, &setup.dataset, ""].map(|label| labelled(plain, label));
        names.into_iter().find(|name| self.knows(name)).unwrap_or_else(|| labelled(plain, &setup.label))
    }

    /// True if a parameter of this name was estimated, or left out as undetermined.
    fn knows(&self, name: &str) -> bool {
        let left_out = || self.unresolved.iter().any(|group| group.first().is_some_and(|first| first == name));
        self.estimate(name).is_some() || left_out()
    }

    /// The set-up of this calibration that corresponds to one of other samples: the one of the same session; if sessions
    /// are not named, the one of the same dataset, or the only one.
    fn seen(&self, setup: &Setup) -> Option<&MeasuredSetup> {
        let named = |s: &&MeasuredSetup| !s.session.is_empty() && s.session == setup.session;
        let unnamed = |s: &&MeasuredSetup| {
            (s.session.is_empty() || setup.session.is_empty()) && (self.setups.len() == 1 || s.dataset == setup.dataset)
        };
        self.setups.iter().find(named).or_else(|| self.setups.iter().find(unnamed))
    }
}

/// The name of a parameter with the label of its set-up.
fn labelled(plain: &str, label: &str) -> String {
    if label.is_empty() { plain.to_owned() } else { format!("{plain}@{label}") }
}
