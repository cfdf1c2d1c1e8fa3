//! Whatever goes wrong on the ball is called by its name, and the arm comes back out wherever the robot still obeys.

use calibench::cell::scripted::{Motion, Script, ScriptedCell, ScriptedFault, ScriptedIndicator};
use calibench::cell::{Indicator, IndicatorError, ManipulatorError, TriCal};
use calibench::measure::centring::{CenteringController, CentringFailure, CentringSettings, Probing, Suspicion};
use calibench::measure::poses::PlannedPose;
use calibench::units::{DEG, MM, UM};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, UnitSphere};

const APPROACH: [f64; 3] = [0.03, 0.03, 0.03];

fn probe_with(cell: &ScriptedCell, settings: CentringSettings) -> Probing {
    probe_by(cell, cell.indicators(), settings)
}

fn probe_by(cell: &ScriptedCell, indicators: [impl Indicator; 3], settings: CentringSettings) -> Probing {
    let pose = PlannedPose {
        id: "1".into(),
        ball: Some(0),
        payload: 0,
        contact: vec![0.0; 3],
        approach: APPROACH.to_vec(),
        reserve: false,
        reverses: None,
        via: Vec::new(),
        clearance: None,
    };
    let mut controller = CenteringController::new(cell.robot(), indicators, TriCal::default(), cell.free_reading(), settings);
    controller.probe(&pose, &mut |_| {})
}

fn probe(cell: &ScriptedCell) -> Probing {
    probe_with(cell, CentringSettings::default())
}

fn fault(fault: ScriptedFault) -> Script {
    Script { faults: vec![fault], ..Script::default() }
}

/// An indicator that fails for good from its reading `from` on; its reading 0 is taken at the approach, 1 at contact.
fn answers(axis: usize, from: usize, error: IndicatorError) -> Script {
    fault(ScriptedFault::Answer { axis, from, times: usize::MAX, error })
}

/// A robot that fails at a motion: 0 is the approach, 1 the contact, 2 the first step.
fn motion(number: usize, error: ManipulatorError) -> Script {
    fault(ScriptedFault::Motion { number, error })
}

fn off_by(x: f64, y: f64, z: f64) -> Script {
    // The ball in the tool frame is minus the stage's error.
    Script { error: Vector3::new(-x, -y, -z) * MM, ..Script::default() }
}

fn tool(tool_response: Matrix3<f64>) -> Script {
    Script { tool_response, ..Script::default() }
}

fn lost() -> ManipulatorError {
    ManipulatorError::Lost { detail: "connection reset".into() }
}

#[test]
fn each_fault_has_its_name_and_the_arm_is_back_at_the_approach() {
    let silent = IndicatorError::Silent;
    let garbled = IndicatorError::Garbled { frame: "+0a1.2".into() };
    let own_fault = IndicatorError::Fault { detail: "ERR0".into() };
    let refused = ManipulatorError::Refused { reason: "drives off".into() };
    let turned = Rotation3::from_axis_angle(&Vector3::x_axis(), 100f64.to_radians()).into_inner();
    let table: Vec<(&str, Script, &str)> = vec![
        ("ball missing", Script { ball: None, ..Script::default() }, "no_contact"),
        ("ball 7 mm short of the gauge", off_by(-7.0, 0.0, 0.0), "beyond_range"),
        ("ball pushing a plunger to its stop", off_by(0.0, 0.0, 7.0), "plunger_at_stop:3"),
        ("plunger outside its range", answers(1, 1, IndicatorError::OverRange), "plunger_at_stop:2"),
        ("ball 6 mm off", off_by(0.0, 6.0, 0.0), "step_too_large:2"),
        ("sign of y reversed", tool(Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0))), "wrong_sign:2"),
        ("indicators 1 and 3 exchanged", fault(ScriptedFault::Exchanged { a: 0, b: 2 }), "swapped_axes"),
        ("tool frame turned by 100 degrees", tool(turned), "wrong_tool_frame"),
        ("steps twice as long", tool(Matrix3::identity() * 2.05), "oscillating"),
        ("stuck at contact", fault(ScriptedFault::Stuck { axis: 0, from: 1 }), "stuck_indicator:1"),
        ("stuck once centred", fault(ScriptedFault::Stuck { axis: 2, from: 3 }), "stuck_indicator:3"),
        ("stuck before contact", fault(ScriptedFault::Stuck { axis: 1, from: 0 }), "beyond_range"),
        ("silent at contact", answers(2, 1, silent.clone()), "silent_indicator:3"),
        ("silent on the ball", answers(0, 2, silent.clone()), "silent_indicator:1"),
        ("silent at the approach", answers(0, 0, silent), "silent_indicator:1"),
        ("garbled", answers(1, 2, garbled), "garbled_indicator:2"),
        ("not a number", answers(1, 2, IndicatorError::Garbled { frame: "NaN".into() }), "garbled_indicator:2"),
        ("fault of its own", answers(2, 2, own_fault), "faulty_indicator:3"),
        ("contact refused", motion(1, refused.clone()), "robot_refused"),
        ("step refused", motion(2, refused), "robot_refused"),
        ("joint limit", motion(2, ManipulatorError::JointLimit { joint: 5 }), "joint_limit:5"),
        ("unreachable", motion(3, ManipulatorError::Unreachable), "unreachable"),
    ];
    for (what, script, name) in table {
        let cell = ScriptedCell::new(script);
        let probing = probe(&cell);
        let failure = probing.outcome.expect_err(what);
        assert_eq!(failure.reason.token(), name, "{what}: {failure}");
        assert!(failure.backed_off, "{what}");
        let last = cell.motions().pop();
        assert_eq!(last, Some(Motion::Joints(APPROACH.to_vec())), "{what}: the last motion is the way out");
        assert!(probing.iterations.iter().any(|i| i.fault.as_ref() == Some(&failure.reason)), "{what}: the record says where");
    }
}

#[test]
fn a_robot_that_is_gone_is_told_nothing_more() {
    let stopped = ManipulatorError::Stopped { reason: "emergency stop".into() };
    for (error, name) in [(lost(), "robot_lost"), (stopped, "robot_stopped")] {
        for number in 0..5 {
            let cell = ScriptedCell::new(motion(number, error.clone()));
            let failure = probe(&cell).outcome.expect_err(name);
            assert_eq!(failure.reason.token(), name);
            assert!(!failure.backed_off, "{name} at motion {number}");
            assert_eq!(cell.motions().len(), number + 1, "{name} at motion {number}: nothing was commanded after it");
        }
    }
}

#[test]
fn a_robot_that_only_says_it_moves_is_found_out() {
    // From the approach, the contact, the first step and the retreat on (the sound cell needs two steps).
    for (from, backed_off) in [(0, true), (1, true), (2, false), (4, false)] {
        let cell = ScriptedCell::new(fault(ScriptedFault::StandsStill { from }));
        let failure = probe(&cell).outcome.expect_err("it stands still");
        assert_eq!(failure.reason, CentringFailure::RobotDidNotMove, "from motion {from}");
        assert_eq!(failure.backed_off, backed_off, "from motion {from}");
    }
}

#[test]
fn too_few_steps_say_how_much_is_left() {
    let settings = CentringSettings { max_steps: 1, ..CentringSettings::default() };
    let failure = probe_with(&ScriptedCell::new(Script::default()), settings).outcome.expect_err("one step is too few");
    let CentringFailure::DidNotConverge { steps: 1, remaining } = failure.reason else { panic!("{failure}") };
    // 2 to 3 % of 2.3 mm.
    assert!((20e-6..70e-6).contains(&remaining), "{remaining}");
    assert!(failure.backed_off);
}

#[test]
fn a_small_stuck_reading_is_found_too() {
    // Stuck 40 um from zero, where a step is too short to be judged by how much it shrinks the distance.
    let cell = ScriptedCell::new(Script {
        error: Vector3::new(-0.04, -0.03, 0.02) * MM,
        faults: vec![ScriptedFault::Stuck { axis: 0, from: 1 }],
        ..Script::default()
    });
    let failure = probe(&cell).outcome.expect_err("stuck");
    assert_eq!(failure.reason, CentringFailure::StuckIndicator { axis: 0 });
    assert!(failure.backed_off);
}

#[test]
fn a_glitch_is_asked_again_and_counted() {
    for times in 1..=2 {
        let glitch = ScriptedFault::Answer { axis: 1, from: 2, times, error: IndicatorError::Silent };
        let probing = probe(&ScriptedCell::new(fault(glitch)));
        assert!(probing.outcome.is_ok());
        assert_eq!(probing.iterations.iter().map(|i| i.retries).sum::<usize>(), times);
    }
}

#[test]
fn the_suspicion_names_the_axes() {
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let failure = probe(&ScriptedCell::new(fault(ScriptedFault::Exchanged { a, b }))).outcome.expect_err("exchanged");
        let CentringFailure::NotShrinking { suspicion, .. } = failure.reason else { panic!("{failure}") };
        assert_eq!(suspicion, Suspicion::SwappedAxes { a, b });
    }
}

/// An indicator with noise; one whose plunger is pushed to its end says so instead of a value, where it is of that kind.
struct Noisy {
    indicator: ScriptedIndicator,
    random: ChaCha8Rng,
    sigma: f64,
    end: Option<f64>,
}

impl Indicator for Noisy {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        let value = self.indicator.read()?;
        if self.end.is_some_and(|end| value > end - 1.0 * UM) {
            return Err(IndicatorError::OverRange);
        }
        let noise = Normal::new(0.0, self.sigma).expect("a positive sigma");
        Ok(value + noise.sample(&mut self.random))
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.indicator.preset(value)
    }
}

/// A robot and a gauge as any workshop may have them: steps a few per cent too long or short, a tool frame wrong by up to 8 degrees,
/// indicators placed by hand that repeat to 0.1 to 5 um; the ball as far off as `reach` (m) along each axis.
fn probe_at_random(random: &mut ChaCha8Rng, reach: f64, faults: Vec<ScriptedFault>) -> Probing {
    let axis = nalgebra::Unit::new_normalize(Vector3::from(UnitSphere.sample(random)));
    let turned = Rotation3::from_axis_angle(&axis, random.random_range(0.0..8.0) * DEG).into_inner();
    let lengths = Vector3::from_fn(|_, _| random.random_range(0.96..1.04));
    let script = Script {
        placement: std::array::from_fn(|_| random.random_range(-0.5..0.5) * MM),
        error: Vector3::from_fn(|_, _| random.random_range(-1.0..1.0) * reach),
        tool_response: turned * Matrix3::from_diagonal(&lengths),
        faults,
        ..Script::default()
    };
    let cell = ScriptedCell::new(script);
    let (free, sigma) = (cell.free_reading(), random.random_range(0.1..5.0) * UM);
    let says_err3 = random.random_bool(0.5);
    let mut axis = 0;
    let indicators = cell.indicators().map(|indicator| {
        let end = says_err3.then(|| free[axis] + TriCal::PAPER.travel);
        axis += 1;
        Noisy { indicator, random: ChaCha8Rng::seed_from_u64(random.random()), sigma, end }
    });
    probe_by(&cell, indicators, CentringSettings::default())
}

/// 20,000 probings: by the rule of three a share of 1.5e-4 would be found with 95 %.
#[test]
fn a_sound_set_up_is_never_said_to_have_exchanged_indicators() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut centred = 0;
    for trial in 0..20_000 {
        // Beyond the flats of the tips too, where the first readings tell too little.
        let probing = probe_at_random(&mut random, 6.5 * MM, Vec::new());
        let Err(failure) = &probing.outcome else {
            centred += 1;
            continue;
        };
        let accused = matches!(failure.reason, CentringFailure::NotShrinking { .. });
        assert!(!accused, "trial {trial}: {failure}");
    }
    assert!(centred > 10_000, "{centred} centred");
}

/// From anywhere in the safe range, whatever the indicators say of plungers at their ends. Which are exchanged is told where the components
/// of the step are unlike; of two that are alike by a tenth of it two exchanges answer alike, and the likelier is named.
#[test]
fn exchanged_indicators_are_named_however_the_first_steps_end() {
    let exchanged =
        |pairs: &[(usize, usize)]| pairs.iter().map(|&(a, b)| ScriptedFault::Exchanged { a, b }).collect::<Vec<_>>();
    let cases = [
        (exchanged(&[(0, 1)]), Suspicion::SwappedAxes { a: 0, b: 1 }),
        (exchanged(&[(0, 2)]), Suspicion::SwappedAxes { a: 0, b: 2 }),
        (exchanged(&[(1, 2)]), Suspicion::SwappedAxes { a: 1, b: 2 }),
        // One exchange after the other: indicator 1 sits in channel 3, and so on.
        (exchanged(&[(0, 1), (1, 2)]), Suspicion::RotatedAxes { channels: [2, 0, 1] }),
        (exchanged(&[(1, 2), (0, 1)]), Suspicion::RotatedAxes { channels: [1, 2, 0] }),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let trials = 500;
    for (faults, truth) in cases {
        let (mut exact, mut alike) = (0, 0);
        for trial in 0..trials {
            let probing = probe_at_random(&mut random, 5.0 * MM / 3f64.sqrt(), faults.clone());
            match probing.outcome.map_err(|failure| failure.reason) {
                // A ball equally far along both axes is centred even so.
                Ok(_) => alike += 1,
                Err(CentringFailure::NotShrinking { suspicion, .. }) => {
                    let exchange = matches!(suspicion, Suspicion::SwappedAxes { .. } | Suspicion::RotatedAxes { .. });
                    assert!(exchange, "{truth}, trial {trial}: {suspicion}");
                    exact += usize::from(suspicion == truth);
                }
                Err(other) => panic!("{truth}, trial {trial}: {other}"),
            }
        }
        // 96 % and 0.05 % expected.
        assert!(exact > trials * 9 / 10 && alike < 10, "{truth}: {exact} exact, {alike} centred");
    }
}
