//! A plunger's reading is exact geometry: closed form, parry's exact distances and an independent program agree, on
//! flat and rim.

use calibench::units::{MM, MRAD};
use calibench_sim::contact::{
    Channel, DATUM_RADIUS, DISK_RADIUS, FREE_READING, MASTER_RADIUS, MASTER_READING, Touch, readings_closed_form,
};
use calibench_sim::random::Streams;
use nalgebra::{Unit, Vector3};
use rand::RngExt;

use crate::oracles;

/// The promise: one nanometre, anywhere.
const PROMISE: f64 = 1e-9;
/// If the ball overlaps the disk by more than 0.1 mm, both sides have a few rounding errors of 20 mm (4e-18 m), magnified at
/// most sqrt(R / 0.2 mm) = 8 times by the slope of the ball, and Newton's remaining error is less than its last step of 1e-13
/// m.
const ROUNDING: f64 = 2e-13;
/// Tip coordinate at a reading of zero, m.
const ZERO_TIP: f64 = MASTER_RADIUS - MASTER_READING;

/// Overlap of the ball with the disk's rim: near zero it only grazes it.
fn overlap(centre: &Vector3<f64>, k: usize, radius: f64) -> f64 {
    let lateral = (centre.norm_squared() - centre[k] * centre[k]).sqrt();
    DISK_RADIUS + radius - lateral
}

fn tolerance(overlap: f64) -> f64 {
    if overlap > 0.1 * MM { ROUNDING } else { PROMISE }
}

fn reading(touch: Touch) -> f64 {
    match touch {
        Touch::Free => FREE_READING,
        Touch::At { tip, .. } => tip - ZERO_TIP,
        Touch::Beyond => Channel::ideal(0).stop_tip - ZERO_TIP,
    }
}

#[test]
fn closed_form_is_the_geometry_of_the_ideal_gauge() {
    let mut rng = Streams { seed: 1, trial: 0 }.stream("contact");
    let mut rims = 0;
    for trial in 0..100_000 {
        // A third within the flat, a third around the rim, a third as far as the ball can still be touched.
        let reach = [5.0, 9.0, 20.0][trial % 3] * MM;
        let centre = Vector3::from_fn(|_, _| rng.random_range(-reach..reach));
        let radius = DATUM_RADIUS + rng.random_range(-2e-6..2e-6);
        let closed = readings_closed_form(centre.into(), radius);
        for k in 0..3 {
            let channel = Channel::ideal(k);
            let geometry = channel.touch_by_geometry(&centre, radius);
            let off = (closed[k] - reading(geometry)).abs();
            assert!(off <= tolerance(overlap(&centre, k, radius)), "{off} m off at {centre:?}, axis {k}: {geometry:?}");
            rims += usize::from(matches!(geometry, Touch::At { on_rim: true, .. }));
        }
    }
    assert!(rims > 50_000, "only {rims} rim contacts");
}

#[test]
fn fast_path_is_the_geometry_of_a_gauge_with_every_flaw() {
    let mut rng = Streams { seed: 2, trial: 0 }.stream("contact");
    let (mut flats, mut rims) = (0, 0);
    for trial in 0..100_000 {
        let k = trial % 3;
        // Ten times the tolerances acceptable in a workshop.
        let mut tilted = |size: f64| Vector3::ith(k, 1.0) + Vector3::from_fn(|_, _| rng.random_range(-size..size));
        let channel = Channel {
            along: Unit::new_normalize(tilted(10.0 * MRAD)),
            normal: Unit::new_normalize(tilted(10.0 * MRAD)),
            foot: Vector3::from_fn(|_, _| rng.random_range(-0.5..0.5) * MM),
            ..Channel::ideal(k)
        };
        let reach = [4.0, 9.0, 20.0][rng.random_range(0..3)] * MM;
        let centre = Vector3::from_fn(|_, _| rng.random_range(-reach..reach));
        let (fast, geometry) = (channel.touch(&centre, DATUM_RADIUS), channel.touch_by_geometry(&centre, DATUM_RADIUS));
        let off = (reading(fast) - reading(geometry)).abs();
        // The tilted disk's rim is displaced from the ideal one by up to 10 mrad x 25 mm.
        let allowed = tolerance(overlap(&(centre - channel.foot), k, DATUM_RADIUS) - 0.5 * MM);
        assert!(off <= allowed, "{off} m off at {centre:?} on {channel:?}: {fast:?}, {geometry:?}");
        if let (Touch::At { normal: a, on_rim: rim_a, .. }, Touch::At { normal: b, on_rim: rim_b, .. }) = (fast, geometry) {
            // Both normals have a rounding error of 20 mm over 12.7 mm.
            assert!((a - b).norm() < 1e-9, "{a:?} {b:?}");
            assert_eq!(rim_a, rim_b);
            flats += usize::from(!rim_a);
            rims += usize::from(rim_a);
        }
    }
    assert!(flats > 20_000 && rims > 10_000, "{flats} flats, {rims} rims");
}

/// The recorded readings are those of a disk that moves along +k: the mirror image of ours, `ours(c) = -theirs(-c)`.
#[test]
fn an_independent_program_reads_the_same() {
    let file = oracles::folder().join("golden/contact_500.json");
    let text = std::fs::read_to_string(file).expect("the recorded contacts are there");
    let golden: serde_json::Value = serde_json::from_str(&text).expect("the recorded contacts are JSON");
    let rows = |name: &str| -> Vec<[f64; 3]> { serde_json::from_value(golden[name].clone()).expect("rows of three numbers") };
    let (analytic, mujoco) = (rows("reading_analytic_m"), rows("reading_mujoco_geomdistance_m"));
    let mut compared = 0;
    for (i, c) in rows("centres_m").iter().enumerate() {
        let mirrored = c.map(|x| -x);
        let closed = readings_closed_form(mirrored, DATUM_RADIUS);
        for k in 0..3 {
            let geometry = reading(Channel::ideal(k).touch_by_geometry(&Vector3::from(mirrored), DATUM_RADIUS));
            // The recorded plunger has no end of travel.
            for (theirs, allowed) in [(-analytic[i][k], ROUNDING), (-mujoco[i][k], PROMISE)] {
                let theirs = theirs.max(FREE_READING);
                assert!((closed[k] - theirs).abs() <= allowed, "centre {i}, axis {k}");
                assert!((geometry - theirs).abs() <= allowed, "centre {i}, axis {k}");
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 3000);
}
