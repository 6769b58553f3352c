"""Picture of a wheel that wears: profiles, depth over the profile, conicity over the distance."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from railsim.plot.style import Picture, styled
from railsim.profiles import Profile

SHOWN = (-0.045, 0.035)  # m from the nominal rolling circle


@styled()
def wear_figure(
    wheels: Sequence[tuple[float, Profile]], rows: Sequence[Mapping[str, float | None]], title: str
) -> Figure:
    """New and worn profiles, depth of wear, equivalent conicity at 3 mm.

    `wheels` ([m]): The new wheel, then the wheel after each step. `rows`: Of
    `railsim.studies.wear_loop.wear_rows`. `title`: What was analysed.
    """
    new = wheels[0][1]
    figure = Picture(8.6, 7.6, title)
    outline, depth, conicity = figure.subplots(3, 1, height_ratios=[1.0, 1.2, 0.8])
    depth.sharex(outline)
    outline.plot(1e3 * new.y, 1e3 * new.z, color="0.2", lw=1.2, label="new")
    last = wheels[-1][1]
    outline.plot(1e3 * last.y, 1e3 * last.z, color="C3", lw=1.0, label=_km(wheels[-1][0]))
    outline.invert_yaxis()
    outline.set_ylabel("z (mm)")
    outline.legend()
    for number, (distance, wheel) in enumerate(wheels[1:], start=1):
        lost = 1e3 * (np.asarray(new.z) - np.asarray(wheel.z))
        share = 0.25 + 0.75 * number / (len(wheels) - 1)
        label = _km(distance) if number in (1, len(wheels) - 1) else None
        depth.plot(1e3 * new.y, lost, color="C3", alpha=share, lw=1.0, label=label)
    depth.set_xlim(1e3 * SHOWN[0], 1e3 * SHOWN[1])
    depth.set_ylim(bottom=0.0)
    depth.set(xlabel="y from the nominal rolling circle, flange negative (mm)")
    depth.set(ylabel="depth of wear in z (mm)")
    depth.legend()
    values = [row["equivalent_conicity"] for row in rows]
    kilometres = [1e-3 * distance for distance, _ in wheels]
    conicity.plot(kilometres, [np.nan if v is None else v for v in values], "o-", ms=4)
    conicity.set(xlabel="distance (km)", ylabel="conicity at 3 mm")
    conicity.set_ylim(0.0, 1.15 * conicity.get_ylim()[1])
    conicity.set_xlim(left=0.0)
    return figure


def _km(distance: float) -> str:
    return f"{1e-3 * distance:g} km"
