//! Nulling needs precision, not accuracy: a datum ball brought to three zeros stands within microns of where the master ball stood,
//! whatever the channels, the disks and the places of the indicators are (paper Table 3: at most about 2 um).

use calibench::units::{MM, UM};
use calibench_sim::contact::{DATUM_RADIUS, MASTER_READING};
use calibench_sim::gauge::Gauge;
use calibench_sim::plunger::{PlungerSpec, PresentedBall};
use calibench_sim::random::Streams;
use nalgebra::Vector3;

/// Centre of the datum ball (m, from the master's) after mastering and nulling one gauge drawn from `spec`.
fn nulled(spec: &PlungerSpec, trial: u64) -> Vector3<f64> {
    let mut gauge = Gauge::draw(spec, &Streams { seed: 31, trial });
    gauge.seat_master(Vector3::zeros(), 0.0);
    for k in 0..3 {
        gauge.preset(k, MASTER_READING).expect("the master ball is in range");
    }
    gauge.present(None);
    let mut centre = Vector3::new(2.0, -1.5, 1.0) * MM;
    for _ in 0..8 {
        gauge.present(Some(PresentedBall {
            centre,
            radius: DATUM_RADIUS,
        }));
        let reading = Vector3::from_fn(|k, _| gauge.read(k).expect("the datum ball is in range"));
        if reading.amax() < 0.3 * UM {
            break;
        }
        centre -= reading;
    }
    centre
}

#[test]
fn with_every_flaw_of_the_default_gauge_it_is_microns() {
    let offsets: Vec<Vector3<f64>> = (0..500).map(|trial| nulled(&PlungerSpec::default(), trial)).collect();
    // Per axis: scale error at two places, hysteresis, 0.3 um left over, noise twice (5 sigma), display, 0.1 um of crosstalk.
    let worst = (2.0 * 1.8 + 0.5 + 0.3 + 2.0 * 5.0 * 0.1 + 0.1 + 0.1) * UM;
    assert!(offsets.iter().all(|offset| offset.amax() < worst));
    // The scale dominates: amplitude uniform up to A, two phases far apart, so each axis has A / sqrt(3) = 1.04 um rms; 500 x 3 draws know
    // the rms to 3 %, and hysteresis, noise and the rest add up to 0.35 um in squares: 1.0 to 1.2 um, a tenth either way allowed.
    let rms = (offsets.iter().map(Vector3::norm_squared).sum::<f64>() / 1500.0).sqrt();
    assert!((0.9 * UM..1.3 * UM).contains(&rms), "{} um", rms / UM);
}

#[test]
fn without_scale_noise_and_hysteresis_it_is_nanometres() {
    let spec = PlungerSpec {
        scale_amplitude: 0.0,
        hysteresis: [0.0; 2],
        noise: [0.0; 2],
        resolution: 0.0,
        ..PlungerSpec::default()
    };
    for trial in 0..200 {
        // Tilt of a milli-radian: 3 nm between the two balls, second order; four sigma on both slopes give 32 times that, and the last
        // step leaves its own readings' crosstalk, a thousandth or so of 0.3 um.
        assert!(nulled(&spec, trial).amax() < 0.3 * UM + 0.1 * UM);
    }
}
