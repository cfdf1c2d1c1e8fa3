//! What an effect means and where to look, in the words of the shop floor.

use crate::effects::family;

/// What stands behind a family, and what to look at before it is added to the model.
pub(super) struct Meaning {
    /// The physics, in a clause.
    pub physics: &'static str,
    /// Where to look; empty where the model is the place to mend it.
    pub look: &'static str,
}

/// The meaning of an effect's family; of a user's own effect, nothing more than that it is one.
pub(super) fn meaning(effect: &str) -> Meaning {
    let (physics, look) = match effect.split(':').next().unwrap_or_default() {
        "base_frame" => ("the robot does not stand where the program believes", ""),
        "mdh" => ("lengths and zeros of the arm are not those of the drawing", ""),
        "joint_compliance" => ("gearboxes are springs: the load twists them by c times its torque", ""),
        "stiffening" => ("a strain-wave gear is stiffer at high torque than at low, so its twist is no straight line", ""),
        "cross_compliance" => ("two gears share a housing: the torque of one turns the other", ""),
        "gravity_backlash" => {
            ("the play of a gear closes on the side to which the load pulls", "test the play of the joint by hand")
        }
        "hysteresis" => (
            "a gear stops short on the side from which it came: friction and lost motion",
            "approach every pose from the same side",
        ),
        "harmonic1" => ("a gear or an encoder disc runs eccentric: an error once per turn", ""),
        "harmonic2" => ("a gear runs oval, or an encoder is read at two opposite places: an error twice per turn", ""),
        "harmonic" => (
            "teeth, or the wave generator of a strain-wave gear, repeat many times per turn",
            "compare the order with the gear ratio and its double",
        ),
        "error_curve" => ("a joint errs by a smooth curve of its own angle", ""),
        "joint_scale" => (
            "a joint turns a constant share too far: a wrong gear ratio or encoder scale",
            "check the ratio entered in the controller",
        ),
        "wrist_coupling" => {
            ("turning one wrist joint drags the next ones along", "check the coupling entered in the controller")
        }
        "joint_source" => {
            ("the joints stand where they were sent, not where they are said to be", "log the joints as the encoders read them")
        }
        "bearing_tilt" => ("a bearing gives way: the axis tips under the load's moment", ""),
        "link_bending" => ("a link bends and twists as a beam", ""),
        "link_mass" => ("the arm's links weigh otherwise than entered; it acts through the compliance of the joints", ""),
        "thermal_growth" => ("links grow as the arm warms up", "warm the robot up, or log temp_c"),
        "thermal_joint" => ("the zero of a joint drifts as its gear warms up", "warm the robot up, or log temp_c"),
        "joint_step" => (
            "a joint slipped once: a belt, a clamp, or a collision",
            "look at the robot's log at that moment, and check its mastering",
        ),
        "tool_frame" => ("the TCP is not where it was measured to be", "measure the tool again"),
        "tool_step" => ("the tool moved on the flange once", "check the tool's screws, and measure it again"),
        "gauge_zero" => ("an indicator's zero is not where mastering put it", "master the gauge again"),
        "gauge_gain" => ("an indicator shows a share too much or too little", "check its scale with a gauge block"),
        "gauge_tilt" => ("a plunger's flat is not square to its travel", "check the flat"),
        "stiction" => ("a plunger hangs up on the side from which it came", "clean it, and approach from one side"),
        "ball" => (
            "one ball is not where it was certified to be",
            "look at that ball: dirt, a loose seat, a damaged thread; measure it again",
        ),
        "artifact_scale" => ("the artifact is warmer or colder than when it was certified", "log its temperature"),
        "artifact_sag" => ("the artifact leans, more so higher up", "check its clamping"),
        "pedestal" => ("what the robot stands on tips under its overturning moment", "check the anchor bolts"),
        "payload_mass" => {
            ("the payload weighs otherwise than entered; it acts through the compliance of the joints", "weigh it")
        }
        "payload_com" => (
            "the payload's centre of mass is not as entered; it acts through the compliance of the joints",
            "check its drawing",
        ),
        "gravity_direction" => ("the cell is not level", "put a level on the base"),
        "base_drift" => ("base and artifact drift apart in the course of the session", "check both clamps, and sunlight"),
        "base_step" => {
            ("base or artifact was bumped once", "check both clamps; what was measured before and after are two sessions")
        }
        "tracker_registration" => {
            ("the tracker's frame does not sit on the world's", "measure the tracker's reference points again")
        }
        "outlier" => (
            "one sample disagrees with all others",
            "look at that sample: a wrong ball, a bad contact, a centring that did not end; repeat it or leave it out",
        ),
        _ => ("an effect of your own", ""),
    };
    Meaning { physics, look }
}

/// What an effect is, as the catalogue says it.
pub(super) fn what(effect: &str) -> &'static str {
    family(effect).map_or("an effect of your own", |f| f.what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::CATALOGUE;

    #[test]
    fn every_family_of_the_catalogue_means_something() {
        for family in CATALOGUE {
            assert_ne!(meaning(family.id).physics, "an effect of your own", "{}", family.id);
        }
    }
}
