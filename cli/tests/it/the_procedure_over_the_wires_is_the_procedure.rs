//! The paper's procedure with a served cell in one process and the measurement in another: all eighty probings over
//! pseudo-terminals and a socket, compared with the identification by the procedure in one process.
#![cfg(unix)]

use crate::served::{Bench, SEED};
use calibench::cell::{Manipulator, ManipulatorError, TriCal};
use calibench::identify::{Model, identify};
use calibench::measure::campaign::{Campaign, CampaignSettings};
use calibench::measure::centring::CenteringController;
use calibench::measure::dataset::file::read_dataset;
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::measure::poses::ways::ArmAt;
use calibench::planning::aim::FirstContacts;
use calibench::units::UM;
use calibench_sim::plans::session_s;
use calibench_sim::random::Streams;
use calibench_sim::session::{Session, centring};
use calibench_sim::world::SimulatedRobot;
use nalgebra::Vector3;

/// Largest distance between the TCP of a sample and that of the same pose measured in one process, m. Motions and draws are
/// equal except for the noise of the readings, 0.1 um, and the float32 rounding of a position, 0.03 um per axis; each centring
/// has three or four such steps.
const CENTRED: f64 = 2.0 * UM;

/// Largest distance between two centrings of one pose, m: each within the tolerance of 3 um in each axis.
const BOTH_CENTRED: f64 = 2.0 * 1.733 * 3.0 * UM;

/// Most probings of eighty by the Universal Robot that may differ by a step: with readings near the tolerance, their noise decides
/// about one step more. Seven of this plan do, three of another.
const ONE_STEP_MORE: usize = 8;

/// Largest difference of a parameter between the two, in its own one-sigma. Samples that differ by a micrometre differ by a
/// tenth of the noise on which the sigmas are based, that of a centring (paper, section 4: about 10 um); the largest of 31 is
/// twice as far out as one.
const SAME: f64 = 0.2;

/// A robot that comes to rest at every point of a way, like a controller that receives one motion after the other.
struct Stopping(SimulatedRobot);

impl Manipulator for Stopping {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        self.0.joints()
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.0.move_joints(target)
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.0.move_in_tool(offset)
    }

    fn clock_s(&mut self) -> f64 {
        self.0.clock_s()
    }
}

/// Simulates in one process the measurement made over the wires, with the gauge mastered before the first motion.
fn in_one_process(bench: &Bench) -> Dataset {
    let (poses, ways) = (&bench.poses, &bench.ways);
    let streams = Streams { seed: SEED, trial: 0 };
    let session = Session::begin(&bench.scenario, streams, session_s(&bench.scenario, poses, 0)).unwrap();
    let world = session.world();
    world.begin_at(&ways.home);
    let robot = Stopping(world.robot());
    let free_reading = session.mastering().free_reading;
    let settings = centring(&bench.scenario);
    let controller = CenteringController::new(robot, world.indicators(), TriCal::default(), free_reading, settings);
    let aim = FirstContacts::new(&bench.cell(), poses);
    let campaign = Campaign::new(controller, CampaignSettings::default()).by(ways.clone(), ArmAt::Home);
    let mut campaign = campaign.aiming(Some(Box::new(aim)));
    let record = campaign.run(poses, &mut ());
    assert_eq!(record.aborted, None);
    Dataset { samples: record.samples, ..bench.cell() }
}

#[test]
fn eighty_probings_over_the_wires_identify_what_eighty_in_one_process_do() {
    are_the_same(&Bench::new(), 0);
}

#[test]
fn eighty_probings_by_a_universal_robot_identify_what_eighty_in_one_process_do() {
    are_the_same(&Bench::ur(), ONE_STEP_MORE);
}

/// `one_step_more`: most probings that may have had one step more or less.
fn are_the_same(bench: &Bench, one_step_more: usize) {
    let served = bench.serve(&[]);
    // The simulated controller has no margin at its joints' limits.
    bench.write_cell(&served, "", "", "[guards]\njoint_margin_deg = 0.0");
    let output = bench.measured("wired", &[]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.starts_with("80 of 80 planned probings measured") && said.contains("bytes sent and received"), "{said}");
    println!("{said}{}", served.interrupt());

    let wired = read_dataset(&bench.path("wired")).unwrap();
    let plain = in_one_process(bench);
    assert_eq!((wired.samples.len(), plain.samples.len()), (80, 80));
    assert!(wired.samples.iter().all(|s| s.set == SampleSet::Fit && s.q_commanded.is_some()));

    // TCP at both samples of a pose, by the controller's own model.
    let tcp =
        |q: &[f64]| calibench::robot::kinematics::world_from_tool(&plain.robot, &plain.base, &plain.tool, q).translation.vector;
    let mut apart: Vec<f64> = Vec::new();
    for sample in &wired.samples {
        let Some(same) = plain.samples.iter().find(|s| s.id == sample.id) else { continue };
        apart.push((tcp(&sample.q) - tcp(&same.q)).norm());
    }
    assert_eq!(apart.len(), 80, "the same poses failed, and the same reserves stood in for them");
    apart.sort_by(f64::total_cmp);
    let steps = apart.iter().filter(|apart| **apart > CENTRED).count();
    println!(
        "apart: median {:.2} um, largest {:.2} um; {steps} differ by a step",
        apart[apart.len() / 2] / UM,
        apart[apart.len() - 1] / UM
    );

    let model = Model::default_for(&plain);
    let [over_wires, in_process] = [&wired, &plain].map(|d| identify(&[NamedDataset::new("d", d)], &model).unwrap());
    assert_eq!(over_wires.rank, in_process.rank);
    let differences = over_wires.estimates.iter().zip(&in_process.estimates).map(|(a, b)| {
        assert_eq!(a.name, b.name);
        (a.value - b.value).abs() / b.sigma
    });
    let largest = differences.fold(0.0, f64::max);
    println!(
        "largest difference of a parameter: {largest:.3} sigma; rms {:.4} and {:.4} um",
        over_wires.rms / UM,
        in_process.rms / UM
    );
    assert!(largest < SAME, "{largest} sigma");
    assert!(apart[apart.len() - 1 - one_step_more] < CENTRED, "{:.2} um", apart[apart.len() - 1 - one_step_more] / UM);
    assert!(apart[apart.len() - 1] < BOTH_CENTRED, "{:.2} um", apart[apart.len() - 1] / UM);
}
