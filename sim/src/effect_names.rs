//! Comparison of effect names.

use calibench::effects::EffectId;
use calibench::effects::family::Scan;
use calibench::effects::registry::Registry;

/// True if two ids of the catalogue name the same effect; for ids with a moment found by a scan, the moments are not compared.
pub fn same(a: &str, b: &str) -> bool {
    let is_sample = |id: &str| Registry::catalogue().family(id).is_some_and(|f| f.scan == Scan::Sample);
    a == b || (step_of(a).is_some() && step_of(a) == step_of(b)) || (is_sample(a) && b == EffectId::OUTLIER)
}

/// The family of a step and the joint or ball that it names, without the moment.
fn step_of(id: &str) -> Option<(&'static str, String)> {
    let family = Registry::catalogue().family(id).filter(|f| f.scan == Scan::Time)?;
    let names_one = family.arguments.matches(':').count() > 1;
    let of = EffectId::new(id).argument(0).filter(|_| names_one).unwrap_or_default().to_owned();
    Some((family.id, of))
}

/// The joint that an effect of the catalogue names, counted from 1.
pub fn joint_of(id: &str) -> Option<usize> {
    Registry::catalogue().family(id)?.joint(&EffectId::new(id))
}

/// The id up to its first colon.
pub fn family_of(id: &str) -> &str {
    id.split_once(':').map_or(id, |(family, _)| family)
}

/// True if a model with these `effects` contains the given one, by itself or through its whole family.
pub fn holds(effects: &[EffectId], id: &str) -> bool {
    effects.iter().any(|e| e == id || e == family_of(id))
}

/// True if an effect is the part of one joint, say, of an effect that concerns several: `joint_scale:1` of `joint_scale`.
pub fn belongs(id: &str, whole: &str) -> bool {
    id != whole && family_of(id) == whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_the_same_at_any_moment_but_not_of_another_joint_or_ball() {
        assert!(same("joint_step:3:600", "joint_step:3:12.5") && !same("joint_step:3:600", "joint_step:2:600"));
        assert!(same("ball_step:2", "ball_step:2:p17") && !same("ball_step:2:p17", "ball_step:3:p17"));
        assert!(same("base_step:10", "base_step:20") && !same("base_step:10", "tool_step:10"));
    }

    #[test]
    fn only_what_is_of_a_joint_names_one() {
        assert_eq!(joint_of("harmonic:2:17"), Some(2));
        assert_eq!([joint_of("ball:2"), joint_of("ball_step:2:p17"), joint_of("outlier:7"), joint_of("mdh")], [None; 4]);
    }

    #[test]
    fn a_family_holds_its_members() {
        let model = ["joint_compliance", "harmonic1:2"].map(EffectId::new);
        assert!(holds(&model, "joint_compliance:3") && holds(&model, "harmonic1:2") && !holds(&model, "harmonic1:3"));
        assert!(
            belongs("harmonic1:2", "harmonic1")
                && !belongs("harmonic1:2", "harmonic1:2")
                && !belongs("harmonic1:2", "harmonic2")
        );
    }
}
