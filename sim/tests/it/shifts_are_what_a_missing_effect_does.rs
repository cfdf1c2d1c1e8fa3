//! The shifts predicted by `identify --shifts` for an effect occur: cells measured with and without it, everything else and
//! every instrument perfect, and identified by a model without it.

use std::path::Path;

use calibench::diagnosis::shifts::Shifts;
use calibench::identify::calibration::Calibration;
use calibench::identify::identify;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::units::{DEG, MM, Unit};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::measure_all;
use calibench_sim::scenario::{Scenario, load_scenario};

/// The cell of Table 8 with perfect instruments, from a small pool.
fn cell() -> Scenario {
    let mut cell = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/table8.toml")).unwrap();
    (cell.plan.pool_per_ball, cell.plan.starts, cell.tracker.validation_poses) = (200, 1, 1);
    let mut truth = cell.truth().keys().clone();
    let indicators = &mut truth.indicators;
    (indicators.resolution_um, indicators.noise_um, indicators.scale_error_um, indicators.hysteresis_um) =
        (1e-4, 0.0, 0.0, 0.0);
    (indicators.tilt_mrad, indicators.squareness_mrad, indicators.concurrency_um) = (0.0, 0.0, 0.0);
    (indicators.ball_diameter_um, indicators.ball_form_um) = (0.0, 0.0);
    let controller = &mut truth.controller;
    controller.encoder_resolution_deg = 1e-9;
    for errors in
        [&mut controller.servo_error_arcsec, &mut controller.lost_motion_arcsec, &mut controller.small_move_play_arcsec]
    {
        errors.fill(0.0);
    }
    (truth.artifact.ball_sigma_um, truth.tool.sigma_um) = (0.0, 0.0);
    cell.with_truth(truth).unwrap()
}

fn calibrated(scenario: &Scenario, plans: &Plans) -> (Dataset, Calibration) {
    let measured = measure_all(scenario, Streams { seed: 1, trial: 0 }, plans, &mut ()).unwrap();
    let calibration = identify(&[NamedDataset::new("fit", &measured.fit)], &scenario.model).unwrap();
    (measured.fit, calibration)
}

#[test]
fn the_identified_parameters_move_as_the_table_says() {
    let cell = cell();
    let plans = Plans::new(&cell, 1).unwrap();
    let (data, plain) = calibrated(&cell, &plans);
    let shifts = Shifts::of(&[NamedDataset::new("fit", &data)], &cell.model).unwrap();
    assert_eq!(shifts.parameters.len(), 31);
    // Effects that act on a joint, tilt an axis, move the base, act through the springs and bend with the load, each at its
    // plausible size. `missing` is the part of the whole shift that may be missing: loads follow the posture, and the
    // springs' own part is multiplied.
    for (id, number, key, missing) in [
        ("harmonic1:2", "harmonic1:2.sin", "sin_urad", 0.03),
        ("bearing_tilt:1", "bearing_tilt:1.k", "k_urad_per_nm", 0.03),
        ("pedestal", "pedestal.x", "x_urad_per_nm", 0.03),
        ("payload_com", "payload_com.z", "z_mm", 0.03),
        ("stiffening:3", "stiffening:3.k", "k_urad", 0.03),
    ] {
        let shift = shifts.shifts.iter().find(|s| s.number == number).unwrap_or_else(|| panic!("no {number}"));
        let mut truth = cell.truth().keys().clone();
        truth.effects.entry(id.into()).or_default().insert(key.into(), shift.unit.from_si(shift.size));
        let (_, moved) = calibrated(&cell.with_truth(truth).unwrap(), &plans);
        let (mut off, mut whole) = (0.0, 0.0);
        for (parameter, by) in shifts.parameters.iter().zip(&shift.by) {
            let value = |c: &Calibration| c.estimate(&parameter.name).unwrap().value;
            // Parameters have several units; each is scaled by a plausible shift.
            let scale = match parameter.unit {
                Unit::MM => 0.01 * MM,
                Unit::DEG => 0.002 * DEG,
                unit => unit.to_si(0.1),
            };
            off += ((value(&moved) - value(&plain) - by) / scale).powi(2);
            whole += (by / scale).powi(2);
        }
        println!("{id}: {:.4} of a shift of {:.3}", (off / whole).sqrt(), whole.sqrt());
        assert!(whole > 0.0 && off.sqrt() < missing * whole.sqrt(), "{id}: {off} of {whole}");
    }
}
