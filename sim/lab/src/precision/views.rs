//! The procedure's interfaces to the table: the small arm as its robot, the indicators, and the operator of the master ball.

use std::cell::RefCell;
use std::rc::Rc;

use calibench::cell::{Indicator, IndicatorError, Manipulator, ManipulatorError};
use calibench::measure::campaign::mastering::{Attendant, CalledOff};
use nalgebra::Vector3;

use super::bench::Bench;
use calibench_sim::world::HANDLING_S;

/// A table shared by all its users.
#[derive(Clone)]
pub(super) struct SharedBench(Rc<RefCell<Bench>>);

impl SharedBench {
    pub fn new(bench: Bench) -> Self {
        SharedBench(Rc::new(RefCell::new(bench)))
    }

    pub fn indicators(&self) -> [BenchIndicator; 3] {
        [0, 1, 2].map(|k| BenchIndicator { bench: self.clone(), k })
    }

    pub fn small_arm(&self) -> SmallArm {
        SmallArm(self.clone())
    }

    pub fn attendant(&self) -> MachineOperator {
        MachineOperator { bench: self.clone(), master: Vector3::zeros() }
    }

    pub fn time_s(&self) -> f64 {
        self.0.borrow().time_s()
    }

    /// Joints of the small arm at a random position near the gauge's centre.
    pub fn draw_start(&self) -> Vec<f64> {
        self.0.borrow_mut().draw_start().as_slice().to_vec()
    }

    /// Centre of the ball in the gauge as measured by the machine, m.
    pub fn measure(&self) -> Vector3<f64> {
        self.0.borrow_mut().measure()
    }
}

/// The small arm as a robot for centring. It has three axes, so its joints are lengths in m and not angles.
///
/// Here the gauge is fixed and the ball is moved: moving the tool by an offset means moving the ball by the opposite.
pub(super) struct SmallArm(SharedBench);

impl SmallArm {
    /// Takes the datum ball out of the gauge.
    ///
    /// # Errors
    /// If the motion is refused.
    pub fn move_away(&mut self) -> Result<(), ManipulatorError> {
        self.move_joints(Bench::away().as_slice())
    }
}

impl Manipulator for SmallArm {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.0.0.borrow().arm_position().as_slice().to_vec())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        let &[x, y, z] = target else {
            return Err(ManipulatorError::Refused { reason: format!("it has three axes and got {} targets", target.len()) });
        };
        self.0.0.borrow_mut().move_to(Vector3::new(x, y, z));
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.0.0.borrow_mut().move_by(&-offset);
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        self.0.time_s()
    }
}

/// One indicator of the gauge on the table.
pub(super) struct BenchIndicator {
    bench: SharedBench,
    k: usize,
}

impl Indicator for BenchIndicator {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        self.bench.0.borrow_mut().read(self.k)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.bench.0.borrow_mut().preset(self.k, value)
    }
}

/// The operator, who handles the master ball and measures it while it lies in the socket.
pub(super) struct MachineOperator {
    bench: SharedBench,
    /// Measured position of the master ball, m.
    pub master: Vector3<f64>,
}

impl Attendant for MachineOperator {
    fn place_master_ball(&mut self) -> Result<(), CalledOff> {
        let mut bench = self.bench.0.borrow_mut();
        bench.seat_master(true);
        bench.wait(HANDLING_S);
        Ok(())
    }

    /// The indicators are preset by then: the ball is first measured (step 3 of the procedure), then taken away (step 4).
    fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
        self.master = self.bench.measure();
        let mut bench = self.bench.0.borrow_mut();
        bench.seat_master(false);
        bench.wait(HANDLING_S);
        Ok(())
    }
}
