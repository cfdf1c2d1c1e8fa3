//! Differences between runs of one robot: parameters of an effect that have other values in some datasets.

use crate::effects;
use crate::effects::situation::Situation;
use crate::effects::{Effect, EffectError, EffectId, Emit, Needs, Owner, ParameterSpec, Subject};
use crate::robot::sites::Site;

/// Parameters of an effect that have other values in some datasets: by an unknown amount times a known weight.
#[derive(Debug, Clone, PartialEq)]
pub struct RunChange {
    /// The runs that differ, in words: `since B`, `in B`.
    pub when: String,
    /// Id of the effect.
    pub effect: EffectId,
    /// Names of those of its parameters that differ; empty for all.
    pub parameters: Vec<String>,
    /// Datasets in which they do, by name, each with its weight.
    pub weights: Vec<(String, f64)>,
}

impl RunChange {
    /// The weight in a dataset; zero if nothing differs there.
    pub fn weight(&self, dataset: &str) -> f64 {
        self.weights.iter().find(|(name, _)| name == dataset).map_or(0.0, |(_, weight)| *weight)
    }

    /// Id of the change as an effect.
    pub fn id(&self) -> String {
        let which = if self.parameters.is_empty() { self.effect.to_string() } else { self.parameters.join("+") };
        format!("change:{which} {}", self.when)
    }

    /// Name of the change of a parameter.
    pub fn parameter_name(&self, parameter: &str) -> String {
        format!("{parameter} {}", self.when)
    }

    /// The change as an effect on a dataset; `None` if nothing differs there.
    ///
    /// # Errors
    /// When the effect does not fit the robot or the artifact.
    pub(super) fn built(&self, dataset: &str, subject: &Subject<'_>) -> Result<Option<Box<dyn Effect>>, EffectError> {
        let weight = self.weight(dataset);
        if weight == 0.0 {
            return Ok(None);
        }
        let inner = effects::build(&self.effect, subject)?;
        let takes = |spec: &ParameterSpec| self.parameters.is_empty() || self.parameters.contains(&spec.name);
        let taken: Vec<usize> = (0..inner.parameters().len()).filter(|&k| takes(&inner.parameters()[k])).collect();
        let parameters = taken.iter().map(|&k| {
            let spec = &inner.parameters()[k];
            ParameterSpec { name: self.parameter_name(&spec.name), nominal: 0.0, ..spec.clone() }
        });
        let parameters = parameters.collect();
        Ok(Some(Box::new(Changed { id: self.id(), parameters, taken, weight, inner })))
    }
}

/// Some parameters of an effect, as deviations from their values elsewhere.
struct Changed {
    id: String,
    parameters: Vec<ParameterSpec>,
    /// Index in the effect of each parameter.
    taken: Vec<usize>,
    weight: f64,
    inner: Box<dyn Effect>,
}

impl Effect for Changed {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        self.inner.owner()
    }

    fn needs(&self) -> &[Needs] {
        self.inner.needs()
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
        self.inner.terms(at, &mut |parameter: usize, site: Site, weight: f64| {
            if let Some(own) = self.taken.iter().position(|&k| k == parameter) {
                emit(own, site, weight * self.weight);
            }
        });
    }
}
