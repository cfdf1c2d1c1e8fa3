//! Which effects of the catalogue would leave the mark that was found.

use super::finding::Subject;
use super::layout::Layout;
use crate::assess::residual_views::JointVariable;
use crate::effects::{self, Subject as EffectSubject};
use crate::identify::Calibration;
use crate::measure::Dataset;

impl Layout {
    /// Effects that the catalogue has and the model lacks, likeliest first; `subject` by place in this layout.
    pub fn suggestions(&self, subject: Subject, calibration: &Calibration, datasets: &[(&str, &Dataset)]) -> Vec<String> {
        let (balls, of_joint): (Vec<String>, Option<(usize, JointVariable)>) = match subject {
            Subject::Ball(b) => (datasets[self.ball_at(b).0].1.ball_ids(), None),
            Subject::Curve(c) => (Vec::new(), Some(self.curve_of(c))),
            Subject::Tool(_) | Subject::World(_) | Subject::Offset(_) | Subject::Sample(_) => (Vec::new(), None),
        };
        let ids: Vec<String> = match (subject, of_joint) {
            (Subject::Ball(b), _) => vec![format!("ball:{}", balls[self.ball_at(b).1])],
            (Subject::Tool(_), _) => vec!["tool_frame".into()],
            (Subject::World(_), _) => ["base_frame", "base_drift", "base_step", "pedestal"].map(String::from).to_vec(),
            (_, Some((j, against))) => {
                let kinds: &[&str] = match against {
                    JointVariable::Angle(_) => &["harmonic1", "harmonic2", "error_curve", "joint_scale"],
                    JointVariable::Torque(_) => &["joint_compliance", "stiffening", "gravity_backlash"],
                    JointVariable::Approach(_) => &["hysteresis"],
                    JointVariable::Payload => &["joint_compliance", "stiffening"],
                    JointVariable::Time | JointVariable::Temperature => &["thermal_joint", "joint_step"],
                    JointVariable::Lag(_) => &[],
                };
                kinds.iter().map(|kind| format!("{kind}:{j}")).collect()
            }
            _ => Vec::new(),
        };
        let subject = EffectSubject { own: &calibration.model.own, ..EffectSubject::new(&calibration.robot, &balls) };
        let in_model = |id: &String| {
            let whole = id.split(':').next().unwrap_or_default();
            calibration.model.effects.iter().any(|e| e == id || e == whole)
        };
        ids.into_iter().filter(|id| !in_model(id) && effects::build(id, &subject).is_ok()).collect()
    }
}
