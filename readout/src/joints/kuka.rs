//! KUKA: the measured joints of a variable server; no program needs to run on the controller.

use std::fmt;

use calibench::cell::kuka::{Link, joints_of};
use calibench::cell::patience::Patience;
use calibench::units::DEG;

use super::JointReader;
use crate::ReadoutError;

/// Joints by the motors' resolvers.
const MEASURED: &str = "$AXIS_ACT_MEAS";

/// A variable server.
pub(super) struct KukaVariables {
    whom: String,
    link: Link,
}

impl KukaVariables {
    pub fn open(address: &str) -> Result<Self, ReadoutError> {
        let whom = format!("KUKA at {address}");
        let link = Link::open(address, Patience::default()).map_err(|e| unread(&whom, &e))?;
        Ok(KukaVariables { whom, link })
    }
}

impl JointReader for KukaVariables {
    fn joints(&mut self) -> Result<Vec<f64>, ReadoutError> {
        let value = self.link.read(MEASURED).map_err(|e| unread(&self.whom, &e))?;
        let joints = value.structure().and_then(joints_of);
        let joints = joints.ok_or_else(|| unread(&self.whom, &format!("{MEASURED} holds no six joints")))?;
        Ok(joints.map(|q| q / DEG).to_vec())
    }
}

fn unread(whom: &str, error: &dyn fmt::Display) -> ReadoutError {
    ReadoutError::new(whom, error.to_string(), "check that the variable server runs, and its port (7000)")
}
