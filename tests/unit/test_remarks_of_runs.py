"""Remarks on a run that ended, from what it counted."""

from railsim.kernels.support import MOST_CORRECTIONS
from railsim.simulation.remarks import creep_range, unsettled_rails


def test_nothing_counted_is_nothing_said():
    assert unsettled_rails(0) == creep_range(0, 1000) == ()


def test_all_corrections_used_are_told_with_their_number_and_a_way_to_check():
    (remark,) = unsettled_rails(17)
    assert "17 evaluations" in remark
    assert f"all {MOST_CORRECTIONS} corrections" in remark
    assert "0.02%" in remark
    assert "--check-step" in remark


def test_patches_outside_the_creep_law_are_a_share_of_all():
    (remark,) = creep_range(5, 1000)
    assert remark.startswith("5 of 1000 contact patches in the time loop (5.0e-03)")
