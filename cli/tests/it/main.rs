//! The guarantees of this package, one file each.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_designed_artifact_keeps_its_promise;
mod a_diagnosis_says_what_to_do;
mod a_killed_campaign_becomes_the_same_dataset;
mod a_killed_campaign_goes_on;
mod a_plan_is_made_for_a_real_cell;
mod a_robot_of_a_urdf_is_calibrated;
mod a_step_is_judged_before_it_is_taken;
mod a_study_is_the_same_however_it_is_cut;
mod advice_is_held_to_rows_left_out;
mod bad_input_ends_in_one_clear_error;
mod compare_tells_where_a_calibration_fails;
mod compensate_goes_through_the_program;
mod data_show_what_they_can;
mod documents_come_back_as_written;
mod every_command_on_the_pages_runs;
mod every_fault_of_a_cell_is_survived_or_named;
mod hunting_tells_the_truth;
mod mujoco_runs_the_whole_procedure;
mod next_measurements_are_planned;
#[path = "../../../tests/it/oracles.rs"]
mod oracles;
mod other_peoples_clients_drive_the_served_cell;
mod programs_go_through_the_program;
mod public_data_go_through_the_program;
mod python_packages_are_pinned;
mod readme_is_true;
mod repeatability_is_that_of_the_cell;
mod rivals_measure_as_specified;
mod same_seed_same_bytes;
mod scenarios_meet_their_expectations;
mod served;
mod the_gallery_shows_what_it_says;
mod the_house_stands;
mod the_ladder_stops_where_it_should;
mod the_precision_test_lands_where_the_paper_did;
mod the_procedure_over_the_wires_is_the_procedure;
mod the_report_is_one_honest_file;
mod the_report_sets_two_models_side_by_side;
mod the_shell_knows_the_program;
mod the_terminal_is_wide_enough;
mod the_terminal_says_what_is_asked;
mod the_workbench_is_closed_to_strangers;
mod the_workbench_says_what_the_command_line_says;
mod third_party_is_listed;
mod workbench;
