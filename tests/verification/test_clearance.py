"""Wide gauges and narrow wheelsets: the contact table covers the whole clearance."""

import pytest
from dynamics import Settings, changed, load_any_track, load_track, load_vehicle
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


@points("coach", ["coach_manchester", "coach_flexicoil"], always=(0,))
def test_flanging_wheelset_on_elastic_rails_lies_farther_out_by_half_of_what_the_gauge_widens(
    coach,
):
    """Its displacement is that from the middle of the rails where they are, along their tops.

    0.05 mm: the outer rail settles by 0.5 mm more than the inner one, and leans the axle by 0.4
    mrad; if the displacement were along the design track, its centre, 0.46 m above the rails,
    would be 0.17 mm off.
    """
    settings = Settings(outputs={"track": True})
    rigid, elastic = (
        simulate(load_vehicle(coach), track, speed=20.0, start=380.0, until=396.0,
                 settings=settings)
        for track in (load_track("curve_r250"), load_any_track("curve_r250"))
    )  # fmt: skip
    left, right = elastic["rail_deflection_lateral"][-1, 0]
    widened = 0.5 * (right - left)
    assert widened > 0.8e-3
    further = rigid.wheelset_lateral[-1, 0] - elastic.wheelset_lateral[-1, 0]
    assert further == pytest.approx(widened, abs=0.05e-3)
