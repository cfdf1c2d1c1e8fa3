//! Monitoring of a calibrated robot: whether a calibration still holds ([`check`]), its
//! [`history`], and what many runs of one robot have in common ([`runs`]).
//!
//! ```
//! use calibench::identify::{Model, identify};
//! # use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
//! use calibench::monitoring::check::RobotCheck;
//! use calibench::monitoring::check::conditions::Condition;
//! # use calibench::robot::kinematics::world_from_tool;
//! # use calibench::robot::{FramePose, built_in};
//! use calibench::units::{MRAD, UM};
//! # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
//! # let measured = |k: usize, slip: f64, visit: usize| {
//! #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
//! #     let mut there = q.clone();
//! #     there[1] += slip;
//! #     let fraction = |i: usize| (((k + 50 * visit) * (i + 3)) as f64 * 0.414).fract();
//! #     let noise = calibench::nalgebra::Vector3::from_fn(|i, _| 40.0 * UM * (fraction(i) - 0.5));
//! #     let seen = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &there).translation.vector;
//! #     Sample::new(format!("p{k}"), q, Measured::Point(seen + noise))
//! # };
//! # let dataset = |samples: Vec<Sample>| {
//! #     let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
//! #     Dataset { robot: robot.clone(), noise, samples, ..Dataset::default() }
//! # };
//!
//! // Eight poses of a campaign again, after joint 2 has slipped by a milliradian.
//! let campaign = dataset((0..60).map(|k| measured(k, 0.0, 0)).collect());
//! let today = dataset((0..8).map(|k| measured(k, 1.0 * MRAD, 1)).collect());
//! let calibration = identify(&[NamedDataset::new("campaign", &campaign)], &Model::of(&["base_frame", "mdh"]))?;
//! let check = RobotCheck::of(&calibration, NamedDataset::new("campaign", &campaign), NamedDataset::new("today", &today))?;
//! assert_eq!(check.named().map(|judged| &judged.condition), Some(&Condition::JointSlipped(2)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod check;
pub mod history;
pub mod runs;
