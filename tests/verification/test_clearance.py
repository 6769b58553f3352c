"""Wide gauges and narrow wheelsets: the contact table covers the whole clearance."""

import pytest
from dynamics import changed, load_track, load_vehicle
from selection import points

from railsim import simulate


@pytest.mark.usefixtures("small_contact_tables")
@points(
    ("gauge", "back_to_back", "widening"),
    [(1.455, 1.360, 0.0), (1.435, 1.345, 0.0), (1.435, 1.360, 0.015)],
    always=(2,),
)
def test_coach_runs_in_a_curve_with_more_clearance(gauge, back_to_back, widening):
    """Its leading wheelset lies farther out by half of the clearance that is added."""

    def narrower(kind, _name, table):
        if kind == "wheelsets":
            table["back_to_back"] = back_to_back

    coach = changed(load_vehicle("coach_manchester"), narrower)
    track = load_track("curve_r250").replace(gauge=gauge)
    if widening:
        track = track.replace(gauge_widening=[[0.0, widening], [track.length, widening]])
    result = simulate(coach, track, speed=20.0, start=390.0, duration=0.5)
    assert result.status == "complete"
    added = 0.5 * (gauge - 1.435 + 1.360 - back_to_back + widening)
    # to the left, with the flange on the outer rail: R 250 m with the usual clearance -6.3 mm
    assert result.wheelset_lateral[-1, 0] == pytest.approx(-6.3e-3 - added, abs=1.0e-3)
