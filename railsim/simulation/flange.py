"""The vehicle in the tightest curve of its track, for judging the time step in flange contact.

In a flange the contact is stiff laterally, and its damping and its friction couple the motions of a
wheelset in another way than on the treads.
"""

import math

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections
from railsim.kernels.state import LAST_STEP
from railsim.kernels.status import RUNNING
from railsim.kernels.system import System
from railsim.kernels.time_loop import FAST
from railsim.model.assembly import Model
from railsim.model.work import CONSTANT_SPEED, without_loads
from railsim.simulation.auxiliary_track import DOING, Progress, advance, curve_to_settle_in
from railsim.track.alignment import alignment_of
from railsim.track.tables import track_tables

WIDEST = 1500.0  # m; in wider curves wheelsets run on their treads
TIMES = 3.0, 3.0  # in transition and curve, at least [s]
# The state sought is one of rest and does not depend on the contact damping: with more of it, it is
# reached also where the wheelset would vibrate.
MORE_DAMPING = 4.0


def tightest_curve(track: Track) -> tuple[float, float] | None:
    """Curvature [1/m] and cant [m] in the tightest curve; None where all are wide."""
    sections = curvature_sections(track)
    ends = [
        (abs(value), value, s)
        for section in sections
        for value, s in ((section.start_value, section.begin), (section.end_value, section.end))
    ]
    size, curvature, s = max(ends)
    if size < 1.0 / WIDEST:
        return None
    for section in sections:
        if section.start_value == section.end_value == curvature:
            s = 0.5 * (section.begin + section.end)
            break
    return curvature, float(alignment_of(track).cant(s))


def in_flange_contact(
    model: Model, track: Track, rolling: Floats, step: float, progress: Progress | None = None
) -> tuple[System, Floats] | None:
    """System on a curve as tight as the tightest one of the track, and the settled vehicle there.

    Parameters
    ----------
    rolling : float64[n_state]
        Steady rolling on straight track at the speed in question.
    step : float
        Step of the fast scheme, stable on straight track [s].
    progress : callable, optional
        Called repeatedly with the time simulated so far and the time to simulate [s].

    Returns
    -------
    tuple or None
        None where all curves are wide, or the vehicle does not stay on the track at this speed.
    """
    curve = tightest_curve(track)
    if curve is None:
        return None
    system = model.system
    speed = float(rolling[-1])
    rail = system.track.rail
    auxiliary = curve_to_settle_in(
        model,
        track,
        speed,
        *curve,
        (float(np.max(rail[:, 4, 0])), float(np.max(rail[:, 5, 0]))),
        TIMES,
    )
    smooth = without_loads(system)._replace(
        track=track_tables(auxiliary),
        drive=CONSTANT_SPEED,
        support=system.support._replace(variation=system.support.variation[:0]),
    )
    contact = smooth.contact
    damped = smooth._replace(contact=contact._replace(damping=MORE_DAMPING * contact.damping))
    state = rolling.copy()
    short = 0.5 * step
    steps = math.floor(auxiliary.length / speed / short)
    DOING.info("settling in flange contact, for judging the time step")
    status = advance(model, damped, state, short, steps, FAST, progress)
    state[LAST_STEP] = 0.0  # of the last step's length: steps of any length are judged from here
    return (smooth, state) if status == RUNNING else None
