//! Effects of the catalogue that would cause what is significant.

use super::layout::Layout;
use super::standout::Subject;
use crate::effects;
use crate::effects::EffectId;
use crate::effects::facts::Follows;
use crate::effects::family::{Family, Scan};
use crate::identify::Model;
use crate::identify::calibration::Calibration;
use crate::measure::dataset::NamedDataset;
use crate::residuals::views::JointVariable;

impl Layout {
    /// Lists the effects of the catalogue that would show as `subject` and that the model does not contain. For a tool
    /// or a base, effects that mainly act there come first. The index in `subject` is that of this layout.
    pub fn suggestions(&self, subject: Subject, calibration: &Calibration, datasets: &[NamedDataset<'_>]) -> Vec<String> {
        let (balls, of_joint): (Vec<String>, Option<(usize, JointVariable)>) = match subject {
            Subject::Ball(b) => (datasets[self.ball_at(b).dataset].dataset.ball_ids(), None),
            Subject::Curve(c) => (Vec::new(), Some(self.curve_of(c))),
            Subject::Tool(_) | Subject::World(_) | Subject::Offset(_) | Subject::Sample(_) => (Vec::new(), None),
        };
        let ids: Vec<String> = match (subject, of_joint) {
            (Subject::Ball(b), _) => vec![EffectId::of_ball(&balls[self.ball_at(b).ball]).into()],
            (Subject::Tool(_), _) => everywhere(&calibration.model, Follows::Tool),
            (Subject::World(_), _) => everywhere(&calibration.model, Follows::World),
            (_, Some((j, against))) => {
                let follows: &[Follows] = match against {
                    JointVariable::Angle(_) => &[Follows::JointAngle, Follows::JointAngleInProportion],
                    JointVariable::Torque(_) => &[Follows::JointTorque],
                    JointVariable::Approach(_) => &[Follows::Approach],
                    JointVariable::Payload => &[Follows::Payload],
                    JointVariable::Time => &[Follows::Time],
                    JointVariable::Temperature => &[Follows::Temperature],
                    JointVariable::Lag(_) => &[Follows::Commanded],
                };
                let of_joint = |f: &&Family| f.is_per_joint() && f.follows.iter().any(|x| follows.contains(x));
                calibration.model.registry.families().filter(of_joint).map(|f| format!("{}:{j}", f.id)).collect()
            }
            _ => Vec::new(),
        };
        let subject = calibration.model.subject(&calibration.robot, &balls);
        let is_new = |id: &String| !calibration.model.holds(id) && effects::build(id, &subject).is_ok();
        ids.into_iter().filter(is_new).collect()
    }
}

/// Effects that are the same at every sample in the tool's axes or in the world; those of which this is the main
/// dependence come first.
fn everywhere(model: &Model, follows: Follows) -> Vec<String> {
    let place = |f: &'static Family| {
        let place = f.follows.iter().position(|x| *x == follows)?;
        (f.arguments.is_empty() && f.scan == Scan::None).then_some((place, f.id))
    };
    let mut all: Vec<(usize, &str)> = model.registry.families().filter_map(place).collect();
    all.sort_by_key(|(place, _)| *place);
    all.into_iter().map(|(_, id)| id.to_owned()).collect()
}
