//! The name of an effect in plain words: that of its family, with the arguments of its id filled in.

use super::EffectId;
use super::registry::Registry;

impl Registry {
    /// The name of an effect for people, such as "gear ripple of joint 2, 17 per turn" for `harmonic:2:17`.
    ///
    /// A curve as `add` accepts it, `curve:J:VARIABLE`, has a name as well. What belongs to no family is an effect of the user, who
    /// named it: it keeps its id.
    ///
    /// ```
    /// use calibench::effects::registry::Registry;
    ///
    /// let catalogue = Registry::catalogue();
    /// assert_eq!(catalogue.in_words("harmonic:2:17"), "gear ripple of joint 2, 17 per turn");
    /// assert_eq!(catalogue.in_words("joint_compliance"), "compliance of all joints");
    /// assert_eq!(catalogue.in_words("curve:3:tau2"), "error curve of joint 3 over the gravity torque on joint 2");
    /// ```
    pub fn in_words(&self, id: &str) -> String {
        let id = EffectId::new(id);
        if let (None, "curve", Some((joint, variable))) =
            (self.family(id.whole()), id.family(), id.rest().and_then(|rest| rest.split_once(':')))
        {
            return format!("error curve of joint {joint} over the {}", variable_in_words(variable));
        }
        if id == EffectId::ERROR_FIELD {
            return EffectId::ERROR_FIELD_IN_WORDS.to_owned();
        }
        let Some(family) = self.family(id.whole()) else { return id.whole().to_owned() };
        // The time is the last argument; what stands before it may contain colons.
        let rest = id.rest().unwrap_or_default();
        let before_time =
            if family.name.contains("{time}") { rest.rsplit_once(':').map_or("", |(name, _)| name) } else { rest };
        let numbered = |kind: &str, k: usize| match id.argument(k) {
            Some(number) => format!("{kind} {number}"),
            None => format!("all {kind}s"),
        };
        let mut words = String::new();
        let mut left = family.name;
        while let Some((plain, (place, after))) = left.split_once('{').and_then(|(a, b)| Some((a, b.split_once('}')?))) {
            words.push_str(plain);
            words.push_str(&match place {
                "joint" => numbered("joint", 0),
                "joint 2" => numbered("joint", 1),
                "joint 3" => numbered("joint", 2),
                "link" => numbered("link", 0),
                "indicator" => numbered("indicator", 0),
                "order" => id.argument(1).unwrap_or("many").to_owned(),
                "time" => id.last_argument().map_or_else(|| "once".to_owned(), |seconds| format!("after {seconds} s")),
                "clock" => if id.rest() == Some("temp") { "temperature" } else { "time" }.to_owned(),
                _ => before_time.to_owned(),
            });
            left = after;
        }
        words + left
    }
}

/// A variable of a curve for people, such as "gravity torque on joint 2" for `tau2`.
///
/// ```
/// assert_eq!(calibench::effects::variable_in_words("q3"), "angle of joint 3");
/// ```
pub fn variable_in_words(name: &str) -> String {
    let joint = |prefix: &str| name.strip_prefix(prefix)?.parse::<usize>().ok();
    match (joint("q"), joint("tau"), joint("approach"), name) {
        (Some(joint), ..) => format!("angle of joint {joint}"),
        (_, Some(joint), ..) => format!("gravity torque on joint {joint}"),
        (_, _, Some(joint), _) => format!("side of approach of joint {joint}"),
        (.., "q2+q3") => "sum of the angles of joints 2 and 3".to_owned(),
        (.., "time_s") => "time".to_owned(),
        (.., other) => match other.strip_prefix("qcmd").and_then(|rest| rest.split_once('-')) {
            Some((joint, _)) => format!("commanded minus reported angle of joint {joint}"),
            None => other.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::effects::catalogue::CATALOGUE;

    #[test]
    fn every_family_has_a_name_of_its_own_that_tells_its_members_apart() {
        let mut names = BTreeSet::new();
        for family in CATALOGUE {
            // Its only argument may be left out.
            let places = if family.arguments.starts_with('[') { 0 } else { family.arguments.matches(':').count() };
            let id =
                |values: [&str; 3]| values[..places].iter().fold(family.id.to_owned(), |id, value| format!("{id}:{value}"));
            let one = Registry::catalogue().in_words(&id(["1", "2", "3"]));
            assert!(!one.contains(['{', '}', '_', ':']), "{}: {one}", family.id);
            for k in 0..places {
                let mut values = ["1", "2", "3"];
                values[k] = "7";
                assert_ne!(Registry::catalogue().in_words(&id(values)), one, "{}: argument {k}", family.id);
            }
            assert!(names.insert(one), "{} has the name of another", family.id);
        }
    }

    #[test]
    fn arguments_stand_in_their_places() {
        for (id, words) in [
            ("ball_step:a:1:600", "ball a:1 knocked after 600 s"),
            ("base_step:12.5", "base bumped after 12.5 s"),
            ("outlier:day2:p7", "sample day2:p7 excluded"),
            ("product:4:5:6", "error of joint 4 by the angles of joint 5 and joint 6 together"),
            ("thermal_growth:temp", "thermal growth of the links with temperature"),
            ("link_bending:2", "bending of link 2"),
            ("ripple", "ripple"),
        ] {
            assert_eq!(Registry::catalogue().in_words(id), words);
        }
    }
}
