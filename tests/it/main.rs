//! Promises of this package: one file a promise.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod a_campaign_survives_anything;
mod a_cell_file_is_read_or_refused_in_one_error;
mod a_check_knows_what_an_arm_repeats;
mod a_check_names_what_changed;
mod a_dataset_survives_the_disk;
mod a_field_of_joint_errors_is_kept;
mod a_fit_is_what_it_says;
mod a_fleet_helps_the_next_robot;
mod a_joint_may_count_either_way;
mod a_kuka_is_driven_or_named;
mod a_lost_zero_is_named;
mod a_mistake_is_named_whatever_was_measured;
mod a_printed_socket_names_the_joint;
mod a_recorded_session_replays;
mod a_run_of_bad_samples_is_found;
mod a_slip_beside_the_arm_is_told_from_it;
mod a_ur5e_stands_where_its_maker_says;
mod an_indicator_answers_or_is_named;
mod arms_on_rails_are_identified;
mod bad_input_is_one_clear_error;
mod benchmark_works_agree_with_the_goldens;
mod campaign_keeps_going;
#[path = "../../examples/centre_a_ball.rs"]
mod centre_a_ball;
mod centring_matches_golden;
mod centring_reaches_three_micrometres;
#[path = "../../examples/compare_and_diagnose.rs"]
mod compare_and_diagnose;
#[path = "../../examples/compensate.rs"]
mod compensate;
mod compensation_leaves_as_urdf_and_mdh;
mod compensation_reaches_its_targets;
mod compensation_refuses_by_name;
mod compensation_says_how_sure_it_is;
mod compensation_status_and_turn_are_kukas;
mod compensation_targets_are_read_or_refused;
mod custom_effect;
mod effect_cell;
mod effects_keep_their_contract;
mod every_centring_fault_is_named_and_backs_off;
mod every_kind_of_sample_identifies;
mod examples_run;
mod forbidden_motions_are_not_sent;
mod frames_are_byte_for_byte;
mod hot_loops_do_not_allocate;
mod identification_matches_the_golden;
mod identified;
#[path = "../../examples/identify_from_arrays.rs"]
mod identify_from_arrays;
mod jacobian_matches_jax;
mod kinematics_and_statics_match_pinocchio;
mod masses_are_never_missing;
mod mastering_refuses_what_is_not_a_master_ball;
mod mistakes_that_were_met_are_named;
mod orientations_are_identified;
mod other_peoples_data_comes_in_whole;
mod outside_robots;
#[path = "../../examples/own_effect.rs"]
mod own_effect;
mod pool_probes_every_ball_of_the_paper;
mod real_robots_are_identified;
mod real_robots_show_what_they_lack;
mod repeatability_intervals_cover;
mod robots_come_from_urdf;
mod runs_of_one_robot_are_told_apart;
mod selection_reaches_the_golden_observability;
mod several_points_of_a_tool_share_it;
mod tables_are_read_however_they_come;
mod the_gallery_is_whole;
mod the_loop_makes_the_golden_centrings;
mod the_order_of_effects_changes_nothing;
mod what_is_determined_is_asked_again;
mod what_is_identified_is_read_back;
mod what_is_noticed_is_offered;
mod what_moved_half_way_is_named;
mod what_stands_out_is_what_is_wrong;
#[path = "../../benches/works/mod.rs"]
mod works;

use works::oracles;
