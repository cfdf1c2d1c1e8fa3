//! The examples run, and find what they are said to find.

use calibench::diagnosis::Verdict;
use calibench::units::{MM, UM};

use crate::{centre_a_ball, compare_and_diagnose, compensate, identify_from_arrays, own_effect};

#[test]
fn arrays_are_identified() {
    let calibration = identify_from_arrays::identified().unwrap();
    // The forearm was made 0.2 mm longer than the 315 mm of the drawing.
    let length = calibration.estimate("a2").unwrap();
    assert!((length.value - 315.2 * MM).abs() < 4.0 * length.sigma, "{} ± {} mm", length.value / MM, length.sigma / MM);
    assert!(length.sigma < 0.05 * MM, "± {} mm tells nothing", length.sigma / MM);
    identify_from_arrays::main().unwrap();
}

#[test]
fn an_effect_of_one_s_own_is_named_and_fitted() {
    let (named, pull) = own_effect::named_and_fitted().unwrap();
    assert_eq!(named, ["hose_pull:1"]);
    assert!((pull.value - own_effect::PULL).abs() < 4.0 * pull.sigma && own_effect::PULL > 8.0 * pull.sigma, "{pull:?}");
    own_effect::main().unwrap();
}

#[test]
fn a_gauge_of_one_s_own_centres_its_ball() {
    // What it asks for is 1 um.
    assert!(centre_a_ball::centred().unwrap() < 1.0 * UM);
    centre_a_ball::main().unwrap();
}

#[test]
fn the_hidden_effect_is_named() {
    let (comparison, diagnosis) = compare_and_diagnose::compared_and_diagnosed().unwrap();
    assert!(comparison.lack_of_fit.p.unwrap() < 1e-6, "the comparison overlooks {} um", comparison.rms / UM);
    assert_eq!((diagnosis.verdict, &diagnosis.set95[..]), (Verdict::Identified, &["harmonic2:2".into()][..]));
    let sine = &diagnosis.findings[0].parameters[0];
    assert!((sine.value - compare_and_diagnose::HIDDEN).abs() < 4.0 * sine.sigma, "{sine:?}");
    compare_and_diagnose::main().unwrap();
}

#[test]
fn a_compensated_target_is_met() {
    let compensation = compensate::compensated().unwrap();
    assert!(compensation.off_plain > 0.5 * MM, "the test could not fail");
    assert!(compensation.off_compensated < 4.0 * compensation.fake.uncertainty.three_d);
    compensate::main().unwrap();
}
