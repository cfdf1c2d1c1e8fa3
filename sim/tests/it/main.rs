//! The promises of this package, one file each.
#![allow(clippy::unwrap_used)] // a test fails by panicking

mod a_mixed_campaign_is_logged_in_full;
mod a_perfect_robot_has_nothing_left;
mod both_rows_of_table_9_come_out;
mod compensation_holds_on_the_plant;
mod every_scenario_key_is_documented;
mod first_contacts_are_aimed;
mod instruments_are_as_noisy_as_specified;
mod intervals_cover_the_truth;
mod no_motion_touches_anything;
mod nulled_ball_stands_where_the_master_stood;
#[path = "../../../tests/it/oracles.rs"]
mod oracles;
mod planned;
mod plunger_reading_is_exact_geometry;
mod shifts_are_what_a_missing_effect_does;
mod slips_are_named;
mod the_true_arm_holds_the_ball;
mod tracker_registration_error_has_its_analytic_covariance;
mod true_arm;
mod truths_act_where_they_belong;
