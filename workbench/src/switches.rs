//! The effects that can be switched on and off, and the model of those that are on.

use std::cmp::Ordering;
use std::sync::Arc;

use calibench::effects::EffectId;
use calibench::effects::family::Scan;
use calibench::effects::own::OwnEffect;
use calibench::effects::registry::Registry;
use calibench::identify::Model;

/// An effect, on or off.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Switch {
    /// Its id in a model.
    pub effect: String,
    /// The id by which it was requested: of a curve, the joint and the variable.
    pub asked: String,
    /// True if it is part of the model.
    pub on: bool,
    /// True if the initial model has it.
    pub initial: bool,
    /// Its prior width, if other than the ordinary one.
    width: Option<f64>,
    /// Its definition, if it was defined since.
    own: Option<OwnEffect>,
}

impl Switch {
    /// True if it goes by this id.
    fn is(&self, id: &str) -> bool {
        self.effect == id || self.asked == id
    }
}

/// All effects that were ever on, in the order in which they came.
///
/// The model depends on which are on, not on the order in which they were switched: the same set gives the same numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Switches {
    initial: Arc<Model>,
    all: Vec<Switch>,
}

impl Switches {
    /// The effects of the initial model, all on.
    pub fn of(model: Model) -> Self {
        let own = |id: String| Switch {
            width: model.width.get(&id).copied(),
            effect: id.clone(),
            asked: id,
            on: true,
            initial: true,
            own: None,
        };
        Switches { all: model.ids().into_iter().map(own).collect(), initial: Arc::new(model) }
    }

    /// The switches, in the order in which they came.
    pub fn all(&self) -> &[Switch] {
        &self.all
    }

    /// The switch with this id.
    pub fn find(&self, id: &str) -> Option<&Switch> {
        self.all.iter().find(|s| s.is(id))
    }

    /// An effect in words, as it was requested if there is a switch for it.
    pub fn words(&self, id: &str) -> String {
        self.initial.registry.in_words(self.find(id).map_or(id, |switch| &switch.asked))
    }

    /// True if the effects of the initial model are on, and no others.
    pub fn are_initial(&self) -> bool {
        self.all.iter().all(|s| s.on == s.initial)
    }

    /// The same with one switch turned.
    pub fn turned(&self, id: &str, on: bool) -> Self {
        let mut turned = self.clone();
        turned.all.iter_mut().filter(|s| s.is(id)).for_each(|s| s.on = on);
        turned
    }

    /// The same with the effects of the initial model on, and no others.
    pub fn reset(&self) -> Self {
        let mut initial = self.clone();
        initial.all.iter_mut().for_each(|s| s.on = s.initial);
        initial
    }

    /// The same with the effects `added` of `wider` on as well, each as that model has it; a single one was requested as
    /// `asked`.
    pub fn with(&self, wider: &Model, added: &[String], asked: &str) -> Self {
        let mut with = self.clone();
        for effect in added {
            with.all.retain(|s| s.effect != *effect || s.initial);
            if let Some(initial) = with.all.iter_mut().find(|s| s.effect == *effect) {
                initial.on = true;
                continue;
            }
            let defined = wider.own.iter().find(|o| o.name == *effect);
            with.all.push(Switch {
                effect: effect.clone(),
                asked: if added.len() == 1 { asked.to_owned() } else { effect.clone() },
                on: true,
                initial: false,
                width: wider.width.get(effect).copied(),
                own: defined.filter(|own| !self.initial.own.contains(own)).cloned(),
            });
        }
        with
    }

    /// The effects that are on here and not in `before`, and those that are on there and not here.
    pub fn changed_from(&self, before: &Switches) -> [Vec<String>; 2] {
        let on =
            |switches: &Switches| -> Vec<String> { switches.all.iter().filter(|s| s.on).map(|s| s.effect.clone()).collect() };
        let (here, there) = (on(self), on(before));
        let not_in = |these: &[String], others: &[String]| these.iter().filter(|e| !others.contains(e)).cloned().collect();
        [not_in(&here, &there), not_in(&there, &here)]
    }

    /// The model of the effects that are on: those of the initial model in their order, then the others in the order of the
    /// catalogue and of their arguments, whenever they were switched on.
    pub fn model(&self) -> Model {
        let mut model = Model { effects: Vec::new(), ..(*self.initial).clone() };
        for off in self.all.iter().filter(|s| !s.on) {
            model.width.remove(&off.effect);
        }
        let on = |initial: bool| self.all.iter().filter(move |s| s.on && s.initial == initial);
        let mut added: Vec<&Switch> = on(false).collect();
        added.sort_by(|a, b| in_order(&self.initial.registry, &a.effect, &b.effect));
        for switch in on(true).chain(added) {
            model.effects.push(EffectId::new(&switch.effect));
            if let Some(width) = switch.width {
                model.width.insert(switch.effect.clone(), width);
            }
            if let Some(own) = &switch.own {
                model.own.retain(|o| o.name != own.name);
                model.own.push(own.clone());
            }
        }
        model
    }
}

/// Orders ids as a ladder lists the whole library: by family, those last whose order or moment a scan finds; then argument by
/// argument, numbers by size.
fn in_order(registry: &Registry, a: &str, b: &str) -> Ordering {
    let family = |id: &str| {
        let family = registry.family(id);
        let place = registry.families().position(|f| family.is_some_and(|family| f.id == family.id));
        (family.is_none_or(|f| f.scan != Scan::None), place.unwrap_or(usize::MAX))
    };
    let number = |part: &str| part.parse::<u64>().ok();
    let parts = |(a, b): (&str, &str)| match (number(a), number(b)) {
        (Some(a), Some(b)) => a.cmp(&b),
        _ => a.cmp(b),
    };
    let arguments = || a.split(':').zip(b.split(':')).map(parts).find(|o| o.is_ne());
    family(a).cmp(&family(b)).then_with(|| arguments().unwrap_or(Ordering::Equal)).then_with(|| a.cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_set_is_the_same_model_whatever_the_order() {
        let begin = Switches::of(Model::paper());
        let add = |switches: &Switches, effect: &str| {
            let wider = switches.model().with(effect);
            switches.with(&wider, &[effect.to_owned()], effect)
        };
        let [a, b, c] = ["harmonic:2:17", "harmonic:10:5", "gravity_backlash:2"];
        let orders = [[a, b, c], [a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]];
        let models = orders.map(|order| order.iter().fold(begin.clone(), |s, e| add(&s, e)).model());
        assert!(models.iter().all(|m| *m == models[0]));
        assert_eq!(models[0].effects, ["base_frame", "mdh", "joint_compliance", c, a, b]);
        // On, on, off leaves the other.
        let both = add(&add(&begin, a), b);
        assert_eq!(both.turned(a, false).model(), add(&begin, b).model());
        // Off and on again, one of the initial model is where it was.
        assert_eq!(both.turned("mdh", false).turned("mdh", true).model(), both.model());
        assert_eq!(both.reset().model(), Model::paper());
        assert_eq!(both.changed_from(&begin), [vec![a.to_owned(), b.to_owned()], Vec::new()]);
    }
}
