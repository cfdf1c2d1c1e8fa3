//! A KUKA as a driver of the cell.

use super::KukaRobot;
use crate::cell::gauge::Traffic;
use crate::cell::{ControllerFrames, ControllerState, Driver, DriverError, ManipulatorError};
use crate::robot::FramePose;

impl Driver for KukaRobot {
    fn state(&mut self) -> Result<ControllerState, DriverError> {
        let state = self.kuka_state().map_err(DriverError::new)?;
        Ok(ControllerState {
            unfit: self.unfit(&state),
            pending: (state.action != 0).then(|| format!("action {} is not done; reset the program", state.action)),
            mode: state.mode,
            program: state.program,
            emergency_stop: state.emergency_stop,
            speed_percent: state.speed,
            payload_kg: None,
            told_payload_kg: None,
        })
    }

    fn prepare(&mut self, speed_percent: u8, flange_from_tool: &FramePose) -> Result<(), ManipulatorError> {
        self.set_speed(speed_percent)?;
        self.set_tool(flange_from_tool)
    }

    fn frames(&mut self) -> Result<ControllerFrames, DriverError> {
        let (flange_from_tool, root_from_base) = self.tool_and_base().map_err(DriverError::new)?;
        let base_from_tool = self.position().map_err(DriverError::new)?;
        Ok(ControllerFrames { root_from_base, base_from_tool, flange_from_tool })
    }

    fn traffic(&self) -> Traffic {
        self.link().traffic()
    }
}
