//! The parts of a scenario, from which its plant is built.

use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Robot};
use calibench::units::UM;
use nalgebra::Vector3;

use crate::cmm::SimulatedCmm;
use crate::contact::DATUM_RADIUS;
use crate::gauge::Gauge;
use crate::mechanics::Parts;
use crate::plunger::PresentedBall;
use crate::random::{Streams, normal};
use crate::scenario::Scenario;

impl Parts {
    /// The parts of a scenario, with `gauge` on the flange and errors sampled from the streams of a trial.
    pub fn of(scenario: &Scenario, streams: &Streams, gauge: &Gauge) -> Self {
        let nominal = scenario.dataset();
        let truth = scenario.truth().keys();
        let mut robot = Robot::clone(&nominal.robot);
        for (link, error) in robot.links.iter_mut().zip(&truth.link_mass_error) {
            link.mass *= 1.0 + error;
        }
        // Certified positions result from a CMM measuring the true ones; its error is symmetric.
        let cmm = |sigma_um: f64| SimulatedCmm { centre: sigma_um * UM };
        let mut artifact = streams.stream("artifact");
        let balls = nominal
            .balls
            .iter()
            .map(|b| PresentedBall {
                centre: cmm(truth.artifact.ball_sigma_um).measure_ball(&b.position, &mut artifact),
                radius: DATUM_RADIUS + normal(truth.indicators.radius_sigma(), &mut artifact),
            })
            .collect();
        let certified = Vector3::from(nominal.tool.xyz);
        let tool_xyz = cmm(truth.tool.sigma_um).measure_ball(&certified, &mut streams.stream("tool"));
        Parts {
            robot,
            tool: FramePose { xyz: tool_xyz.into(), ..nominal.tool },
            payload: nominal.payloads.first().map_or_else(Payload::none, |p| scenario.truth().payload(p)),
            balls,
            gauge: gauge.mechanisms(),
            nominal,
        }
    }
}
