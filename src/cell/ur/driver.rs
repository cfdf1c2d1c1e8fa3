//! A Universal Robot as a driver of the cell.

use calibench_wire::ur::Action;
use calibench_wire::ur::modes::{robot_mode, runtime_state, safety_status};

use super::UrRobot;
use super::robot::{EMERGENCY, numbers_of, pending, pose_of};
use crate::cell::gauge::Traffic;
use crate::cell::{ControllerFrames, ControllerState, Driver, DriverError, ManipulatorError};
use crate::robot::{FramePose, apart};
use crate::units::{DEG, MM};

/// Largest difference between a frame or a payload and what it was set to, m and rad, and kg.
const AS_SET: [f64; 3] = [1e-3 * MM, 1e-3 * DEG, 1e-3];

impl Driver for UrRobot {
    fn state(&mut self) -> Result<ControllerState, DriverError> {
        let (seen, runs) = self.with_program().map_err(DriverError::new)?;
        let program = runtime_state(seen.integer("runtime_state"));
        let safety = seen.integer("safety_status");
        let unfit = match Self::unfit(&seen) {
            None if !runs => self.unfit_to_start(&seen),
            unfit => unfit,
        };
        Ok(ControllerState {
            unfit,
            pending: if runs { pending(&seen) } else { None },
            mode: format!("{}, {}", robot_mode(seen.integer("robot_mode")), safety_status(safety)),
            program: if runs { format!("{program}: calibench") } else { program },
            emergency_stop: Some(EMERGENCY.contains(&safety)),
            speed_percent: 100.0 * seen.real("target_speed_fraction"),
            payload_kg: Some(seen.real("payload")),
            told_payload_kg: self.settings.payload.map(|payload| payload.mass),
        })
    }

    fn prepare(&mut self, speed_percent: u8, flange_from_tool: &FramePose) -> Result<(), ManipulatorError> {
        self.start_program()?;
        self.set_speed(speed_percent)?;
        self.carry_out(Action::Tool, numbers_of(&flange_from_tool.pose()))?;
        let is = pose_of(self.link.tool()?.flange_from_tool);
        let (distance, angle) = apart(&is, &flange_from_tool.pose());
        if distance > AS_SET[0] || angle > AS_SET[1] {
            let reason = format!("its TCP is not what it was set to, by {:.3} mm and {:.3} deg", distance / MM, angle / DEG);
            return Err(ManipulatorError::Refused { reason });
        }
        if let Some(payload) = self.settings.payload {
            let [x, y, z] = payload.com;
            self.carry_out(Action::Payload, [payload.mass, x, y, z, 0.0, 0.0])?;
            let is = self.link.state()?.real("payload");
            if (is - payload.mass).abs() > AS_SET[2] {
                let reason = format!("its payload stays at {is:.3} kg where {:.3} kg was requested", payload.mass);
                return Err(ManipulatorError::Refused { reason });
            }
        }
        Ok(())
    }

    fn frames(&mut self) -> Result<ControllerFrames, DriverError> {
        let tool = self.link.tool().map_err(DriverError::new)?;
        let base_from_tool = self.link.state().map_err(DriverError::new)?.six("actual_TCP_pose");
        Ok(ControllerFrames {
            root_from_base: FramePose::default(),
            base_from_tool: FramePose::from_pose(&pose_of(base_from_tool)),
            flange_from_tool: FramePose::from_pose(&pose_of(tool.flange_from_tool)),
        })
    }

    fn traffic(&self) -> Traffic {
        self.link.traffic()
    }
}
