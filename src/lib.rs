//! Calibrate an industrial robot: measure it, identify it, find what its model is missing, compensate.
//!
//! Everything here rests on one equation, three numbers a sample, never collapsed to a norm:
//!
//! ```text
//! residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)
//! ```
//!
//! A laser-tracker sample is the same line with the measured point in place of the ball.
//! Modules in reading order: [`robot`] (what the arm is), [`effects`] (what can be wrong with it), [`cell`] (what stands in the
//! cell), [`measure`] (taking the data), [`identify`] (finding the numbers), [`assess`] (judging them), [`compensate`] (using them),
//! [`report`] (showing them).
//! SI inside; millimetres, micrometres and degrees outside, with the unit in the name ([`units`]).

pub mod assess;
pub mod cell;
pub mod compensate;
pub mod effects;
pub mod files;
pub mod identify;
pub mod import;
pub mod measure;
pub mod report;
pub mod robot;
pub mod units;
