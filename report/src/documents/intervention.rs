//! What a maintenance engineer does about an effect or a change.

use calibench::effects::facts;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a maintenance engineer does, how it is verified, and what happens otherwise.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Intervention {
    /// `re_master`, `secure_tool`, `measure_tool`, `secure_base`, `warm_up`, `service`, `enter_load`, `correct_setting`,
    /// `look_at_artifact`, `look_at_instrument`, `repeat_sample`, `measure_otherwise`; `leave_alone` if the model corrects it.
    pub work: String,
    /// What to do; null if the model corrects it.
    pub act: Option<String>,
    /// The measurement that shows that it helped.
    pub verify: Option<String>,
    /// What happens if nothing is done.
    pub if_nothing_is_done: String,
}

impl From<facts::Intervention> for Intervention {
    fn from(intervention: facts::Intervention) -> Self {
        let facts::Intervention { work, act, verify } = intervention;
        let said = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        Intervention {
            work: work.name().into(),
            act: said(act),
            verify: said(verify),
            if_nothing_is_done: work.if_nothing_is_done().into(),
        }
    }
}
