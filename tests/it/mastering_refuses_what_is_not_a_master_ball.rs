//! A TriCal is mastered by the master ball and nothing else, and by a sound set of indicators.

use calibench::cell::scripted::{Script, ScriptedCell, ScriptedFault};
use calibench::cell::{Indicator, IndicatorError, TriCal};
use calibench::measure::campaign::mastering::{Attendant, CalledOff, Mastering, MasteringError, MasteringSettings, master};
use calibench::units::{MM, UM};

/// Puts a ball of some radius into the socket, if any, and takes it away, or forgets to.
struct Hand {
    cell: ScriptedCell,
    radius: Option<f64>,
    removes: bool,
}

impl Attendant for Hand {
    fn place_master_ball(&mut self) -> Result<(), CalledOff> {
        self.cell.seat(self.radius);
        Ok(())
    }

    fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
        if self.removes {
            self.cell.seat(None);
        }
        Ok(())
    }
}

fn mastered(script: Script, radius: Option<f64>, removes: bool) -> Result<Mastering, MasteringError> {
    // No datum ball near the gauge while it is mastered.
    let cell = ScriptedCell::new(Script { ball: None, ..script });
    let mut hand = Hand { cell: cell.clone(), radius, removes };
    master(&mut cell.indicators(), &mut hand, &TriCal::default(), &MasteringSettings::default(), || 12.0)
}

fn master_ball() -> Option<f64> {
    Some(TriCal::default().master_radius)
}

#[test]
fn the_master_ball_is_accepted_and_the_free_readings_are_measured() {
    let placement = [0.15 * MM, 1.2 * MM, 0.4 * MM];
    let mastering = mastered(Script { placement, ..Script::default() }, master_ball(), true).expect("sound");
    for k in 0..3 {
        // -6.150 mm ideally (paper, section 2.1); an indicator too far out by e is pushed in less and reads e more when free.
        assert!((mastering.free_reading[k] - (-6.150 * MM + placement[k])).abs() < 1e-9);
        assert!(mastering.preset_residual[k].abs() < 1e-9);
    }
    assert_eq!(mastering.time_s, 12.0);
}

#[test]
fn other_balls_are_refused() {
    // A datum ball, the 7/8-inch and the half-inch reflector.
    for radius in [12.7 * MM, 11.1125 * MM, 6.35 * MM] {
        let error = mastered(Script::default(), Some(radius), true).expect_err("not the master ball");
        match radius > 6.55 * MM {
            true => assert!(matches!(error, MasteringError::NotTheMasterBall { .. }), "{error}"),
            // Too small to touch a plunger at all.
            false => assert_eq!(error, MasteringError::BallNotRemoved),
        }
    }
}

#[test]
fn a_ball_that_was_never_there_or_never_left_is_noticed() {
    assert_eq!(mastered(Script::default(), None, true), Err(MasteringError::BallNotRemoved));
    assert_eq!(mastered(Script::default(), master_ball(), false), Err(MasteringError::BallNotRemoved));
}

#[test]
fn unsound_indicators_are_named() {
    let all = usize::MAX;
    let silent = ScriptedFault::Answer { axis: 1, from: 3, times: all, error: IndicatorError::Silent };
    let table: Vec<(ScriptedFault, MasteringError)> = vec![
        (silent, MasteringError::Indicator { axis: 1, error: IndicatorError::Silent }),
        (ScriptedFault::PresetIgnored { axis: 0 }, MasteringError::PresetNotTaken { axis: 0, reading: 6.5 * MM }),
        (ScriptedFault::Stuck { axis: 2, from: 5 }, MasteringError::PlungerStuck { axis: 2 }),
        (ScriptedFault::CountsBackwards { axis: 1 }, MasteringError::CountsBackwards { axis: 1 }),
    ];
    for (fault, expected) in table {
        let script = Script {
            // A preset that is ignored must differ from what the indicator happens to read.
            faults: vec![fault],
            ..Script::default()
        };
        let cell = ScriptedCell::new(Script { ball: None, ..script });
        if let MasteringError::PresetNotTaken { .. } = expected {
            cell.shift_zero(0, 0.15 * MM);
        }
        let mut hand = Hand { cell: cell.clone(), radius: master_ball(), removes: true };
        let error = master(&mut cell.indicators(), &mut hand, &TriCal::default(), &MasteringSettings::default(), || 0.0)
            .expect_err("unsound");
        match (&error, &expected) {
            (MasteringError::PresetNotTaken { axis: a, reading }, MasteringError::PresetNotTaken { axis: b, reading: r }) => {
                assert!(a == b && (reading - r).abs() < 0.1 * UM, "{error}");
            }
            _ => assert_eq!(error, expected),
        }
    }
}

#[test]
fn an_indicator_far_from_its_place_is_refused_alone() {
    let placement = [0.2 * MM, 2.0 * MM, 0.2 * MM];
    let error = mastered(Script { placement, ..Script::default() }, master_ball(), true).expect_err("misplaced");
    assert!(matches!(error, MasteringError::Misplaced { axis: 1, .. }), "{error}");
}

#[test]
fn a_reading_that_does_not_settle_is_refused() {
    let cell = ScriptedCell::new(Script { ball: None, ..Script::default() });
    cell.add_fault(ScriptedFault::Drifts { axis: 2, per_reading: 5.0 * UM });
    let mut hand = Hand { cell: cell.clone(), radius: master_ball(), removes: true };
    let error = master(&mut cell.indicators(), &mut hand, &TriCal::default(), &MasteringSettings::default(), || 0.0)
        .expect_err("drifting");
    // Five readings span four intervals.
    let MasteringError::Unstable { axis: 2, spread } = error else { panic!("{error}") };
    assert!((spread - 20.0 * UM).abs() < 1e-9);
}

/// Shows whole micrometres, the last digit now one up, now one down.
struct Flickering<I>(I, bool);

impl<I: Indicator> Indicator for Flickering<I> {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        self.1 = !self.1;
        let steps = (self.0.read()? / UM).floor() + f64::from(u8::from(self.1));
        // As it comes over the wire: millimetres with three decimals.
        Ok(format!("{:.3}", steps / 1000.0).parse::<f64>().expect("a number") * MM)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.0.preset(value)
    }
}

#[test]
fn a_last_digit_that_flickers_is_at_rest() {
    let cell = ScriptedCell::new(Script { ball: None, placement: [0.1 * MM, 0.2 * MM, 0.3 * MM], ..Script::default() });
    let mut hand = Hand { cell: cell.clone(), radius: master_ball(), removes: true };
    let mut indicators = cell.indicators().map(|indicator| Flickering(indicator, false));
    let mastering = master(&mut indicators, &mut hand, &TriCal::default(), &MasteringSettings::default(), || 0.0);
    let mastering = mastering.expect("one digit of flicker is no motion");
    assert!(mastering.preset_residual.iter().all(|r| r.abs() < 1.0 * UM), "{mastering:?}");
}

#[test]
fn an_attendant_may_call_it_off() {
    struct Nobody;
    impl Attendant for Nobody {
        fn place_master_ball(&mut self) -> Result<(), CalledOff> {
            Err(CalledOff)
        }
        fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
            Err(CalledOff)
        }
    }
    let cell = ScriptedCell::new(Script::default());
    let result = master(&mut cell.indicators(), &mut Nobody, &TriCal::default(), &MasteringSettings::default(), || 0.0);
    assert_eq!(result, Err(MasteringError::CalledOff(CalledOff)));
}
