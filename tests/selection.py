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
        "interface/test_docs.py::test_blocks_of_a_page_run_in_their_order[docs/user/stability.md]",
        "interface/test_benchmarks.py::test_script_runs_in_its_small_form[mechanisms.py]",
        "interface/test_benchmarks.py::test_script_runs_in_its_small_form[springs.py]",
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
    }
)
"""Tests of four seconds and more beside shorter ones of the same thing; marked `further`."""
