//! `tool_frame`: the TCP is not where the coordinate measuring machine said. Three numbers, in the last frame.

use super::{Effect, EffectError, Family, Id, Owner, ParameterSpec, Situation, Subject};
use crate::robot::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family =
    Family { id: "tool_frame", arguments: "", what: "the TCP is not where the CMM said", equation: "tool += (x, y, z)", build };

struct ToolFrame {
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, _: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    id.at_most(0)?;
    let parameters =
        ["x", "y", "z"].iter().map(|axis| ParameterSpec::new(format!("tool_{axis}"), Unit::MM, 0.03 * MM)).collect();
    Ok(Box::new(ToolFrame { parameters }))
}

impl Effect for ToolFrame {
    fn id(&self) -> &str {
        "tool_frame"
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        Owner::Session
    }

    fn terms(&self, _: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        for k in 0..3 {
            emit(k, Site::Tool(k), 1.0);
        }
    }
}
