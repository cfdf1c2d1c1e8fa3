//! Calibrates industrial robots: measurement, identification, diagnosis of what the model is missing, compensation.
//!
//! Everything rests on one equation, with three residual components per sample, never collapsed to a norm:
//!
//! ```text
//! residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)
//! ```
//!
//! A laser-tracker sample obeys the same equation, with the measured point in place of the ball.
//! Modules in reading order: [`robot`] (the arm), [`effects`] (its possible errors), [`cell`] (the objects in the cell),
//! [`measure`] (taking the data), [`identify`] (estimating the parameters), [`residuals`], [`diagnosis`], [`prediction`] and
//! [`selection`] (judging them and finding what is missing), [`planning`] (the next measurements), [`monitoring`] (whether a
//! calibration still holds), [`compensate`] (using it).
//! SI inside; millimetres, micrometres and degrees outside, with the unit in the name ([`units`]).
//!
//! From a dataset to a calibration:
//!
//! ```
//! use calibench::identify::calibration::write_calibration;
//! use calibench::identify::{Model, identify};
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
//! let calibration = identify(&[("campaign", &data)], &model)?;
//! for e in &calibration.estimates {
//!     println!("{} = {} ± {} {}", e.name, e.unit.from_si(e.value), e.unit.from_si(e.sigma), e.unit.printed());
//! }
//! write_calibration(&calibration, &folder.join("calibration.toml"))?;
//! # let base_x = calibration.estimate("base_x").ok_or("fitted")?;
//! # assert!((base_x.value - 0.002).abs() < base_x.sigma);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod cell;
pub mod compensate;
pub mod diagnosis;
pub mod effects;
#[cfg(feature = "schema")]
pub mod file_formats;
pub mod files;
pub mod identify;
pub mod import;
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
