"""Which points of a grid always run.

The others, and long checks beside shorter ones of the same thing, carry the mark ``further``:
``tests/check --all`` runs them too.
"""

import pytest


def points(names, values, always, **options):
    """``pytest.mark.parametrize`` whose values at the indices `always` run every time.

    Parameters
    ----------
    names : str or tuple of str
        One name, or the names of each value's parts.
    values : sequence
        Points of the grid.
    always : sequence of int
        Indices of those that run without ``--all``.
    **options
        Of ``pytest.mark.parametrize``.
    """
    one = isinstance(names, str)
    chosen = [
        pytest.param(
            *((value,) if one else value), marks=() if i in always else pytest.mark.further
        )
        for i, value in enumerate(values)
    ]
    return pytest.mark.parametrize(names, chosen, **options)


LONG = frozenset(
    {
        "interface/test_fmu.py::test_the_unit_without_commands_is_the_run",
        "verification/test_model_validation.py::"
        "test_a_study_gives_the_result_on_the_same_track_in_the_same_load",
        "verification/test_model_validation.py::"
        "test_sections_in_which_a_channel_rests_are_left_out_and_named",
        "unit/test_threads.py::test_workers_that_end_by_themselves_in_time_are_not_killed",
        "interface/test_modes.py::test_root_locus_in_json_and_folder",
        "verification/test_bridge.py::"
        "test_a_heavy_bridge_under_the_coach_deflects_as_under_its_loads[40.0]",
        "verification/test_creep_law_runs.py::"
        "test_error_of_the_step_with_the_table_is_that_with_fastsim",
        "interface/test_report.py::test_the_most_unloaded_wheel_has_the_strongest_colour_of_a_map",
        "interface/test_wear.py::test_steps_are_kept_and_a_longer_distance_goes_on",
        "interface/test_contact.py::test_pictures_and_tables_are_written_and_kept",
        "reliability/test_ends.py::test_physical_end_keeps_its_result[standstill]",
        "verification/test_identification.py::test_the_command_writes_vehicle_page_and_json",
        "interface/test_report.py::"
        "test_study_without_results_has_table_curves_map_and_parallel_coordinates",
        "verification/test_critical_speed.py::test_a_limit_that_is_not_reached_is_said_so",
        "verification/test_start_in_curve.py::"
        "test_curving_has_what_the_way_leaves_in_friction_elements",
        "verification/test_linear_relations.py::"
        "test_response_to_waves_is_that_of_a_run_on_them[cross_level]",
        "properties/test_mechanism_scaling.py::"
        "test_an_enlarged_mechanism_has_every_result_enlarged_by_its_unit[atr95_lift_5]",
        "interface/test_stationary.py::test_limit_in_the_picture_has_its_value",
        "interface/test_imports.py::test_commands_import_nothing_that_they_do_not_use[result]",
        "interface/test_examples.py::test_measured_run_is_that_of_today_but_for_its_noise",
        "reliability/test_other_systems.py::test_command_works_without_what_posix_has[study]",
        "verification/test_twin_tracks.py::"
        "test_cross_level_is_a_wave_of_the_cant[0.0033333333333333335-0.1-10.0-0.002]",
        "interface/test_info.py::test_vehicles_and_tracks_can_be_drawn[coach_manchester]",
        "interface/test_modes.py::test_results_draw_themselves[<lambda>1]",
        "interface/test_modes.py::test_results_draw_themselves[<lambda>2]",
        "interface/test_optimise.py::test_no_more_designs_than_the_given_number[nsga2]",
        "reliability/test_surroundings.py::test_odd_surroundings[home is not there]",
        "reliability/test_surroundings.py::test_odd_surroundings[ascii]",
        "verification/test_step_halving.py::"
        "test_half_the_step_changes_peaks_by_one_and_rms_by_a_fifth_of_a_per_cent[3 m/s]",
        "verification/test_vehicles.py::"
        "test_mirrored_vehicle_on_the_mirrored_track_gives_the_mirrored_result[articulated]",
        "verification/test_hunting.py::test_hunting_is_said[44.4-erri_b176_low]",
        "verification/test_hunting.py::"
        "test_a_forced_motion_on_waves_of_one_length_is_no_hunting[lateral]",
        "verification/test_wear_loop.py::"
        "test_routes_wear_by_their_shares_and_deep_steps_in_parts[3]",
        "verification/test_linear_relations.py::"
        "test_response_to_waves_is_that_of_a_run_on_them[lateral]",
        "unit/test_optimise_search.py::test_a_fifth_of_a_grid_finds_its_front[kursawe]",
        "interface/test_study_pictures.py::test_seeds_are_no_axis[speeds0]",
        "interface/test_study_pictures.py::test_study_is_drawn[chosen1]",
        "interface/test_study_pictures.py::test_study_is_drawn[chosen2]",
        "verification/test_contact_table.py::"
        "test_worn_and_conformal_pairs_have_forces_without_jumps[conformal rail]",
        "interface/test_assess.py::test_command_of_other_standards[wear]",
        "verification/test_start_in_curve.py::"
        "test_steady_start_is_the_end_of_a_long_run_in[coach_flexicoil-elastic-300.0]",
        "reference/test_gritti_pantograph.py::"
        "test_a9_local_optima_from_the_printed_values_reconstructed[atr95_lift_4-optimum2]",
        "reference/test_gritti_pantograph.py::"
        "test_a9_local_optima_from_the_printed_values_reconstructed[atr95_lift_3-optimum1]",
        "reference/test_gritti_pantograph.py::"
        "test_no_seed_ends_above_the_published_design_reconstructed[3-1]",
        "interface/test_friction_along_track.py::"
        "test_curving_takes_the_friction_of_each_rail_as_a_run_does[1.0]",
        "verification/test_creep_law_runs.py::"
        "test_sum_of_lateral_forces_in_a_curve_does_not_depend_on_the_law[fastrip]",
        "reliability/test_kills.py::test_killed_runs_and_studies",
        "verification/test_track_from_accelerations.py::"
        "test_filters_of_the_amplifier_do_not_move_the_track[filters0]",
        "interface/test_study.py::test_first_run_compiles_alone[compiled before]",
        "interface/test_run.py::test_interrupt_leaves_nothing[4.0]",
        "interface/test_stationary.py::"
        "test_guiding_takes_the_worse_of_both_hands[vehicle1-friction1]",
        "verification/test_track_from_accelerations.py::"
        "test_a_curve_without_simulated_runs_is_said_and_spoils_nothing_elsewhere",
        "verification/test_mechanism_search.py::"
        "test_an_optimum_keeps_its_limits_between_the_positions_too[2]",
        "verification/test_out_of_round.py::test_measured_flat_as_contact_finds_it",
        "interface/test_stationary.py::test_load_to_one_side_is_leant_to_its_own_side",
        "verification/test_model_validation.py::test_one_late_channel_does_not_move_the_others",
        "verification/test_rail_wear.py::test_every_vehicle_of_a_mix_that_hunts_is_named",
        "interface/test_examples.py::test_example_runs_and_draws_its_picture[11_skyhook]",
        "interface/test_stability_commands.py::"
        "test_damaged_point_of_a_map_is_computed_again_and_told",
        "unit/test_kernel_cache.py::test_without_a_folder_to_write_to_kernels_run_uncached",
        "verification/test_crossing_runs.py::"
        "test_short_ramps_are_what_the_formula_leaves_out[10.0]",
        "verification/test_steady_curving.py::"
        "test_where_steady_rolling_is_unstable_values_are_means_of_the_motion",
        "interface/test_mechanism.py::test_out_writes_a_self_contained_page_pictures_and_positions",
        "interface/test_study.py::test_pictures_of_runs_and_of_vehicles_against_each_other",
        "reference/test_gritti_pantograph.py::test_a19_linear_ratio_new",
        "verification/test_random_combinations.py::test_random_combination[97]",
        "interface/test_manual_site.py::"
        "test_no_page_of_the_manual_runs_off_the_screen_or_needs_a_network",
        "interface/test_docs.py::test_blocks_of_a_page_run_in_their_order[docs/user/mechanisms.md]",
        "interface/test_docs.py::"
        "test_blocks_of_a_page_run_in_their_order[docs/user/creep_forces.md]",
        "interface/test_stationary.py::test_both_branches_of_a_wagon_are_told_and_drawn",
        "interface/test_study.py::test_cost_of_a_run_does_not_grow_with_their_number",
        "interface/test_campaign.py::"
        "test_quiet_records_of_the_whole_campaign_pass_and_one_missing_run_does_not",
        "verification/test_identification.py::test_a_stretched_arc_length_is_said",
        "verification/test_random_combinations.py::test_random_combination[138]",
        "interface/test_stability_commands.py::"
        "test_what_fails_on_rigid_rails_takes_no_critical_speed_on_others",
        "verification/test_spring_search.py::test_the_lightest_nest_is_not_missed",
        "verification/test_spring_search.py::test_it_is_said_that_stresses_are_not_limited",
        "reference/test_gritti_pantograph.py::"
        "test_lift_5_follows_the_cam_as_closely_as_it_can_reconstructed",
        "verification/test_identification.py::"
        "test_a_channel_that_a_robust_loss_leaves_out_does_not_widen_the_intervals[cauchy]",
        "reference/test_gritti_pantograph.py::test_a18_constant_ratio_new",
        "reference/test_gritti_pantograph.py::test_a23_constant_actuator_force_new",
        "interface/test_stability_commands.py::test_linear_critical_speed",
        "interface/test_examples.py::"
        "test_example_runs_and_draws_its_picture[16_how_loud_is_this_flat]",
        "interface/test_examples.py::test_example_runs_and_draws_its_picture[12_tilting]",
        "interface/test_examples.py::"
        "test_example_runs_and_draws_its_picture[10_study_friction_speed]",
        "interface/test_mechanism.py::test_a_motion_is_written_with_every_link_and_actuator",
        "interface/test_manual.py::test_tables_of_the_curving_study_are_up_to_date[flexicoil]",
        "interface/test_check_step.py::test_check_in_json_is_the_difference_of_two_runs",
        "interface/test_simulation.py::test_changing_speed_has_the_same_bits[0.25-drive0]",
        "interface/test_simulation.py::test_changing_speed_has_the_same_bits[None-drive0]",
        "interface/test_simulation.py::test_changing_speed_has_the_same_bits[None-drive1]",
        "interface/test_wear.py::test_straight_above_the_critical_speed_is_a_remark[30.0-False]",
        "verification/test_critical_speed.py::test_critical_speed_over_amplitude_and_its_smallest",
        "verification/test_model_validation.py::"
        "test_the_command_writes_its_files_and_fails_on_request",
        "verification/test_identification.py::"
        "test_a_model_that_lacks_a_damper_leaves_residuals_that_are_not_white",
        "verification/test_compliant_rails.py::"
        "test_what_lateral_compliance_of_the_rails_costs[coach_flexicoil-7.1-1.5]",
        "verification/test_linear_contact.py::"
        "test_a_run_from_the_modes_own_shape_decays_with_its_damping[6.0-coach_manchester]",
        "verification/test_rail_sections.py::test_wing_and_nose_share_the_load_as_in_contact",
        "verification/test_hollow_wheels.py::"
        "test_coach_on_hollow_wheels_runs_the_same_with_half_the_step[0.0025-0.025-ballasted-250.0-20.0]",
        "verification/test_rail_wear.py::test_rails_wear_over_the_tonnage_of_a_mix",
        "verification/test_creep_law_runs.py::"
        "test_friction_that_falls_by_nothing_or_at_once[table]",
        "verification/test_creep_law_runs.py::test_mirrored_track_gives_the_mirrored_run[polach]",
        "verification/test_creep_law_runs.py::"
        "test_third_body_softens_and_keeps_the_friction[table]",
        "verification/test_library.py::"
        "test_vehicle_runs_its_track_at_the_permitted_speed[wagon_three_piece_25t-curve_r250-480.0]",
        "reference/test_gritti_pantograph.py::test_a21_better_lift_4_from_every_seed_new[2]",
        "reference/test_gritti_pantograph.py::"
        "test_no_seed_ends_above_the_published_design_reconstructed[1-1]",
        "interface/test_docs.py::test_blocks_of_a_page_run_in_their_order[docs/user/stability.md]",
        "interface/test_examples.py::test_example_runs_and_draws_its_picture[05_when_does_it_hunt]",
        "interface/test_examples.py::test_example_runs_and_draws_its_picture[18_coach_on_a_bridge]",
        "interface/test_run.py::test_braking_to_a_standstill_keeps_the_run[True]",
        "interface/test_mechanism.py::test_search_without_a_solution_gives_the_least_broken_compromise",
        "verification/test_speed.py::"
        "test_start_in_a_curve_at_walking_speed_is_the_state_on_the_way[6.0]",
        "verification/test_critical_speed.py::"
        "test_linear_critical_speed_has_no_jumps_over_friction[rigid]",
        "verification/test_model_validation.py::test_missing_vertical_dampers_fail_in_the_vertical",
        "verification/test_creep_table.py::test_table_follows_the_solver_between_its_nodes",
        "verification/test_track_forces.py::"
        "test_wider_gauge_lets_the_guiding_wheel_run_further_out",
        "verification/test_controllers.py::test_a_tilted_car_body_feels_less[1.0]",
        "verification/test_rail_wear.py::test_left_hand_curve_wears_the_other_rail_alike",
        "verification/test_robustness.py::"
        "test_step_and_contact_damping_move_no_peak[coach_flexicoil-300.0-0.6--0.05]",
        "reference/test_gritti_pantograph.py::"
        "test_a22_lift_5_that_fits_its_cylinder_from_every_seed_new[2]",
        "verification/test_bridge.py::"
        "test_a_heavy_bridge_under_the_coach_deflects_as_under_its_loads[25.0]",
        "interface/test_study.py::test_processes_end_after_a_study_that_was_killed",
        "interface/test_study.py::"
        "test_run_whose_process_dies_twice_is_given_up_and_the_others_go_on",
        "interface/test_study.py::test_request_to_end_while_workers_begin_leaves_no_traceback",
        "verification/test_identification.py::test_what_nothing_depends_on_keeps_its_value",
        "verification/test_identification.py::test_a_bound_that_keeps_the_value_out_is_said[0.99]",
        "verification/test_identification.py::test_misfit_is_that_in_the_band",
        "verification/test_creep_table.py::test_shipped_nodes_are_what_the_generator_makes[7-0]",
        "interface/test_plot.py::"
        "test_a_recording_is_drawn_as_read_and_as_it_acts_with_its_spectrum",
        "interface/test_stationary.py::"
        "test_where_newton_fails_steady_curving_gives_the_same_guiding_force",
        "verification/test_model_validation.py::"
        "test_a_section_with_a_wheel_without_load_is_left_out_and_named",
        "verification/test_model_validation.py::"
        "test_a_place_beyond_what_is_looked_for_is_not_taken_for_another",
        "verification/test_model_validation.py::test_a_run_that_is_compared_in_part_only_is_said",
        "reliability/test_cluster.py::"
        "test_study_survives_the_death_of_a_worker_and_is_that_of_one_process",
        "interface/test_wear.py::test_loop_that_is_refused_keeps_what_was_done",
        "interface/test_wear.py::test_straight_above_the_critical_speed_is_a_remark[60.0-True]",
        "interface/test_optimise.py::"
        "test_designs_are_within_bounds_of_many_digits_and_differ[31391237.0]",
        "interface/test_examples.py::test_example_runs_and_draws_its_picture[06_which_modes]",
        "interface/test_examples.py::"
        "test_example_runs_and_draws_its_picture[03_manchester_or_flexicoil]",
        "verification/test_twin_tracks.py::"
        "test_longitudinal_level_is_a_wave_of_the_gradient_in_a_curve[10.0-0.002]",
        "verification/test_twin_tracks.py::test_alignment_is_a_wave_of_the_plan[20.0-0.004]",
        "interface/test_contact.py::test_exact_patches_stand_beside_those_of_the_table",
        "verification/test_crossing_runs.py::"
        "test_short_ramps_are_what_the_formula_leaves_out[20.0]",
        "verification/test_crossing_runs.py::test_wheel_passes_the_nose_on_its_wrong_side",
        "reference/test_gritti_pantograph.py::"
        "test_lifts_2_and_3_are_found_without_their_published_parameters_reconstructed[3-0.2183-1]",
        "interface/test_modes.py::test_wrong_input_is_told_in_a_line[arguments16-no steady state]",
        "verification/test_actuators.py::test_slide_protection_on_falling_friction",
        "interface/test_campaign.py::test_report_of_a_scenario_is_titled_by_its_name",
        "verification/test_start_in_curve.py::"
        "test_mean_of_a_vehicle_that_does_not_come_to_rest_in_a_curve",
        "unit/test_kernel_cache.py::"
        "test_process_that_ends_while_it_compiles_lets_one_of_the_next_ones_compile",
        "unit/test_kernel_cache.py::test_folder_that_a_user_chose_for_numba_is_used",
        "verification/test_spring_search.py::"
        "test_every_nest_meets_all_checks_of_the_verification[fatigue]",
        "verification/test_spring_search.py::"
        "test_nests_meet_stricter_checks_and_the_largest_load_of_the_file",
        "interface/test_spring.py::"
        "test_existing_pages_are_kept_without_overwrite_and_the_same_every_time",
        "interface/test_stability_commands.py::test_curving_over_a_grid",
        "interface/test_stability_commands.py::"
        "test_picture_of_a_short_wagon_in_a_curve_has_its_whole_title",
        "interface/test_compare.py::"
        "test_results_that_keep_few_quantities_are_drawn_by_what_all_have",
        "reliability/test_ends.py::test_physical_end_keeps_its_result[in the first step]",
        "verification/test_flange.py::test_state_of_rest_is_the_end_of_a_long_run[rigid]",
        "verification/test_flange.py::test_growth_does_not_depend_on_the_step_of_the_way",
        "reliability/test_disk.py::test_full_disk_is_one_line[plot-61440]",
        "interface/test_info.py::test_a_vehicle_of_another_gauge_stands_on_the_rails_of_a_track",
        "verification/test_robustness.py::"
        "test_step_and_contact_damping_move_no_peak[coach_manchester-300.0-0.5-0.0]",
        "unit/test_compiler.py::test_public_means_of_numba_give_the_same_numbers",
        "verification/test_elements.py::test_loop_of_constant_friction_has_masings_area[triangle]",
        "verification/test_support.py::test_reference_scheme_and_fast_one_agree_without_masses",
        "verification/test_check_rail.py::"
        "test_work_at_the_check_rail_is_part_of_the_frictional_power",
        "verification/test_wear_depth.py::test_worn_profile_goes_back_into_the_simulation",
        "verification/test_non_elliptic.py::test_mirrored_contour_has_the_same_patch",
        "interface/test_interrupts.py::test_full_disk_leaves_nothing_and_is_told_in_a_line",
        "unit/test_kernels_without_compiler.py::test_a_run_is_the_same_without_compilation",
        "interface/test_study.py::"
        "test_script_without_a_guard_runs_once_and_nothing_of_the_folder_it_is_started_in",
        "interface/test_plot.py::test_picture_has_the_format_of_its_ending[pdf]",
        "interface/test_plot.py::test_radii_in_the_plan_stand_within_its_axes[1]",
        "interface/test_plot.py::test_wheelsets_in_a_curve_are_drawn_over_the_whole_width[19.0]",
        "unit/test_solutions.py::"
        "test_tracks_of_other_curves_share_the_judgement_on_straight_track[other1-2]",
        "unit/test_solutions.py::"
        "test_tracks_of_other_curves_share_the_judgement_on_straight_track[other3-2]",
        "verification/test_crossing_runs.py::"
        "test_a_run_that_begins_on_the_crossing_is_that_of_one_from_before_it[39.3]",
        "verification/test_derailment.py::"
        "test_wheel_that_climbs_is_derailed_and_stands_on_its_flange[0.0]",
        "verification/test_sensitivity.py::"
        "test_derivatives_of_a_free_oscillation_are_the_closed_ones[forward]",
        "properties/test_mechanism_scaling.py::"
        "test_an_enlarged_mechanism_has_every_result_enlarged_by_its_unit[tilting_two_springs]",
        "unit/test_kernel_cache.py::test_edited_callee_in_another_file_gives_the_new_number",
        "unit/test_threads.py::test_exception_in_the_block_of_a_pool_kills_its_workers",
        "interface/test_benchmarks.py::"
        "test_script_runs_in_its_small_form_and_a_process_of_its_own[growth.py]",
        "interface/test_benchmarks.py::"
        "test_script_runs_in_its_small_form_and_a_process_of_its_own[study_cost.py]",
        "interface/test_report.py::"
        "test_printed_page_names_the_runs_of_its_curves_and_cuts_off_no_table",
        "interface/test_study_pictures.py::test_seeds_are_no_axis[speeds1]",
        "reliability/test_surroundings.py::test_names_are_shown_literally",
        "unit/test_foreign_calls.py::"
        "test_ten_thousand_calls_leave_all_arrays_alive_and_the_result_the_same[many_derivatives]",
        "unit/test_kernels_without_compiler.py::"
        "test_fields_of_a_patch_are_the_same_without_compilation[0.3]",
        "verification/test_crossing_runs.py::test_short_ramps_are_what_the_formula_leaves_out[27.8]",
        "verification/test_hollow_wheels.py::"
        "test_coach_on_hollow_wheels_runs_the_same_with_half_the_step[0.0025-0.025-rigid-250.0-20.0]",
        "verification/test_step_halving.py::test_run_is_lively[3 m/s]",
        "interface/test_study.py::"
        "test_killed_group_that_is_resumed_has_the_summary_of_an_undisturbed_study",
        "interface/test_benchmarks.py::test_script_runs_in_its_small_form[versions.py]",
        "unit/test_threads.py::test_workers_end_with_a_process_that_ends_without_a_word",
        "verification/test_sprung_wheelset.py::"
        "test_a_coned_wheelset_on_springs_follows_random_alignment",
        "verification/test_actuators.py::test_speed_over_a_gradient_and_after_a_profile",
        "interface/test_mechanism.py::test_every_axis_of_every_picture_says_its_unit",
        "reliability/test_fuzzed_inputs.py::test_results_made_up_by_others",
        "reliability/test_kills.py::"
        "test_end_that_hangs_is_ended_and_a_second_signal_does_not_disturb_it",
        "interface/test_stability_commands.py::"
        "test_map_that_is_interrupted_while_it_is_drawn_goes_on",
        "verification/test_hollow_wheels.py::"
        "test_load_moves_across_a_hollow_as_by_boundary_elements[0.0015-0.05-0.0032]",
        "verification/test_contact_table.py::"
        "test_patch_under_load_lies_on_the_common_normal_of_two_circles[30.0]",
        "verification/test_crossing_runs.py::test_contacts_evaluated_again_are_counted_once",
        "verification/test_sliding.py::test_slow_run_over_ramps_leaves_what_the_loop_leaves",
        "interface/test_imports.py::test_commands_import_nothing_that_they_do_not_use[definitions]",
        "verification/test_twin_tracks.py::"
        "test_alignment_is_a_wave_of_the_plan_in_a_curve[10.0-0.002]",
    }
)
"""Long tests, most of them beside others of the same thing; marked `further`."""
