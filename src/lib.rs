//! Calibrates industrial robots: measurement, identification, diagnosis of what the model is missing, compensation.
//!
//! A robot repeats to a few hundredths of a millimetre and misses its targets by a millimetre. This library takes what was
//! measured, by laser tracker or by a gauge of three indicators on balls, finds the parameters of the arm with their
//! uncertainties, names the physical effect that the model lacks, predicts the error at poses that nobody measured, and says
//! what to command instead. It knows nothing of simulation, reports or the command line: those are the packages
//! `calibench-sim`, `calibench-report` and `calibench-cli`.
//!
//! # The equation
//!
//! Everything rests on one equation, with three residual components per sample, never collapsed to a norm:
//!
//! ```text
//! residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)
//! ```
//!
//! A laser-tracker sample obeys the same equation, with the measured point in place of the ball. The arm is a chain in
//! modified Denavit-Hartenberg parameters with Hayati's beta and joints that twist under gravity,
//!
//! ```text
//! T_i = Rx(alpha_{i-1}) Tx(a_{i-1}) Ry(beta_{i-1}) Rz(theta_i) Tz(d_i),    theta_i = q_i + offset_i + c_i tau_i
//! ```
//!
//! and every other error is an effect that says which parts of the arm it moves, per unit of its parameters. The method is
//! that of Icli, Stepanenko and Bonev, Sensors 20 (2020) 5919.
//!
//! # Reading order
//!
//! [`robot`] (the arm), [`effects`] (its possible errors), [`cell`] (the objects in the cell), [`measure`] (taking the data),
//! [`identify`] (estimating the parameters), [`residuals`], [`diagnosis`], [`prediction`] and
//! [`selection`] (judging them, and finding what is missing), [`planning`] (the next measurements), [`compensate`] (using
//! them) and [`monitoring`] (whether they still hold); beside them [`import`] (data of others), [`files`] (reading and writing)
//! and [`math`].
//! SI inside; millimetres, micrometres and degrees outside, with the unit in the name ([`units`]).
//!
//! # From a dataset to a calibration
//!
//! ```
//! use calibench::identify::calibration::write_calibration;
//! use calibench::identify::{Model, identify};
//! use calibench::measure::dataset::NamedDataset;
//! use calibench::measure::dataset::file::read_dataset;
//! # use calibench::measure::dataset::file::write_dataset;
//! # use calibench::measure::dataset::{Dataset, Measured, Noise, Sample};
//! # use calibench::robot::kinematics::world_from_tool;
//! # use calibench::robot::{FramePose, built_in};
//! # let temporary = tempfile::tempdir()?;
//! # let folder = temporary.path();
//! # let (robot, base, tool) = (built_in("kr6_r700").ok_or("built in")?, FramePose::default(), FramePose::default());
//! # let q = |k: usize| (1..=6).map(|i| ((k * i) as f64 * 0.618).fract() - 0.5).collect::<Vec<f64>>();
//! # let point = |k: usize| world_from_tool(&robot, &FramePose { xyz: [0.002, 0.0, 0.0], ..base }, &tool, &q(k)).translation.vector;
//! # let samples = (0..40).map(|k| Sample::new(format!("p{k}"), q(k), Measured::Point(point(k)))).collect();
//! # let noise = Noise { point: Some(20e-6), ..Noise::default() };
//! # let robot_reference = "kr6_r700".into();
//! # let robot = std::sync::Arc::new(robot.clone());
//! # let made = Dataset { robot, robot_reference, base, tool, noise, samples, ..Dataset::default() };
//! # write_dataset(&made, &folder.join("campaign"))?;
//! let data = read_dataset(&folder.join("campaign"))?;
//! let model = Model::of(&["base_frame", "mdh"]);
//! let calibration = identify(&[NamedDataset::new("campaign", &data)], &model)?;
//! for e in &calibration.estimates {
//!     println!("{} = {} ± {} {}", e.name, e.unit.from_si(e.value), e.unit.from_si(e.sigma), e.unit.printed());
//! }
//! write_calibration(&calibration, &folder.join("calibration.toml"))?;
//! # let base_x = calibration.estimate("base_x").ok_or("fitted")?;
//! # assert!((base_x.value - 0.002).abs() < base_x.sigma);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! * `schema`: the JSON Schemas of the files that this library reads. Off by default.
//!
//! # Limits
//!
//! * Errors of an arm at rest: no dynamics, no vibration, no control.
//! * Serial chains of joints that turn or slide. Those that slide are identified and compensated; poses are planned and
//!   motions checked for chains of joints that turn.
//! * A diagnosis knows the effects of its catalogue and those that a user adds; of others it says that something is left.
//! * Parameters that the data cannot distinguish are named, not guessed.
//! * The drivers are for KUKA controllers, tried on servers that emulate one.
//!
//! Public names stay within a minor version; `docs/stability.md` in the repository says what else does.

pub mod cell;
pub mod compensate;
pub mod diagnosis;
pub mod effects;
#[cfg(feature = "schema")]
pub mod file_formats;
pub mod files;
pub mod identify;
pub mod import;
pub mod judgement;
pub mod math;
pub mod measure;
pub mod monitoring;
pub mod planning;
pub mod prediction;
pub mod residuals;
pub mod robot;
#[cfg(feature = "schema")]
pub mod schema;
pub mod selection;
pub mod units;

/// The linear algebra of this library's interfaces, in the version that they speak.
pub use nalgebra;
