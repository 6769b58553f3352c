"""Stationary tests: unloading and guiding on twisted track (EN 14363, 6.1), roll coefficient.

Each case is solved by Newton's method (`railsim.linear.stationary`), twists to both sides, of
vehicles with dry friction from both directions.  A case without a steady state is reported, and the
verdict is then not a pass.

Guiding (EN 14363, 6.1, the method with two separate tests): the guiding force Y_a of the leading
outer wheel at walking pace in a level curve of R 150 m, over the smallest wheel load of that
wheelset on the twists, Y_a/Q_a <= 1.2; and Y/Q of this wheel rolling through the curve of R 150 m
with both twists, to either side.  Of curves to the right and to the left the worse one counts.  Dry
friction follows the way from straight level track.  On cant it holds nothing: the mean of both
directions.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from railsim.arrays import Floats, first_largest
from railsim.cant import cant_deficiency
from railsim.constants import CANT_BASE, WIDENED
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.limits import StationaryLimits, Value
from railsim.definitions.vehicle.flatten import FlatVehicle, flatten
from railsim.definitions.vehicle.loads import DESIGN
from railsim.errors import Fault, InputError, argument_error, input_error
from railsim.linear.circle import circle, left_out
from railsim.linear.sliding import has_pads
from railsim.linear.stationary import (
    WALKING_PACE,
    Standing,
    TwistLoop,
    on_cant,
    on_twist,
    roll_coefficient,
    twist_loop,
)
from railsim.linear.steady import NotConverged
from railsim.model.assembly import Model, assemble
from railsim.model.equilibrium import Equilibrium, equilibrium
from railsim.model.plausibility import profile_remarks
from railsim.notation import SIDES
from railsim.stability.curving import FAILED, curving
from railsim.table import Amount, Column, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

S = TypeVar("S")
UNLOADING = "unloading (Q0 - Q)/Q0"
LIFTED = (
    "unloading above 1: the wheel lifts; rails draw held wheelsets down, and its negative load is "
    "the force needed for that"
)

ENDS = 0.01  # of the mean axle load, by which those of both ends may differ
ONE_END = (
    "axle loads of the two ends differ: guiding is that of the end that leads in the file; test "
    "the vehicle turned round too (--set vehicle.turned=true)"
)


@dataclass(frozen=True)
class StationaryValue:
    """One quantity of one case, and its limit."""

    case: str  # track under the vehicle
    quantity: str
    value: float  # nan where no steady state was found [1 or rad]
    limit: float | None  # none where a value is only reported
    place: str  # wheel, or body
    source: str = ""  # of the limit
    checked: bool = False  # against the printed standard

    @property
    def exceeded(self) -> bool:
        """Whether the limit is exceeded; false for a case without a steady state."""
        return self.limit is not None and self.value > self.limit


@dataclass(frozen=True)
class Stationary:
    """Stationary tests of a vehicle."""

    vehicle: str
    edition: str
    held: bool  # whether the wheelsets were held across the track
    values: tuple[StationaryValue, ...]
    reasons: tuple[str, ...]  # why it is incomplete, a sentence each
    # wheel loads on the way to each twist, to the opposite one and back, by its name
    loops: dict[str, TwistLoop] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()  # what is left out

    @property
    def verdict(self) -> str:
        """``fail`` if a limit is exceeded, ``incomplete`` where there are reasons."""
        if any(value.exceeded for value in self.values):
            return "fail"
        return "incomplete" if self.reasons else "pass"

    def table(self) -> Table:
        """Return the values with their limits; a value without a steady state is left open."""
        columns = [Column("case", "standing on"), Column("quantity"), Column("place", "location"),
                   Column("value", format=">"), Column("limit", format=">")]  # fmt: skip
        number, angle = Column("", format=".3f"), Column("", unit="deg", format=".2f")

        def cell(quantity: str, value: float | None, limit: float | None = None) -> object:
            if value is None or np.isnan(value):
                return None
            if np.isinf(value):
                return "no load"
            column = angle if quantity.startswith("angle") else number
            return Amount(value, column, with_unit=True, limit=limit)

        rows = [[v.case, v.quantity, v.place, cell(v.quantity, v.value, v.limit),
                 cell(v.quantity, v.limit)] for v in self.values]  # fmt: skip
        return Table(columns, rows)

    def plot(
        self, path: str | Path | None = None, *, title: str = "", overwrite: bool = False
    ) -> "Figure":
        """Draw unloading over twist from both directions; to a file too if a path is given."""
        from railsim.plot.stability import twist_figure
        from railsim.plot.style import save

        limit = next(v.limit for v in self.values if v.quantity == UNLOADING)
        words = title or f"{self.vehicle}: wheels unloaded by twist"
        figure = twist_figure(self.loops, limit or 0.0, words)
        if path is not None:
            save(figure, path, overwrite=overwrite)
        return figure

    def record(self) -> dict[str, object]:
        """Return the tests as plain numbers and strings, SI."""
        values = [{**v.__dict__, "exceeded": v.exceeded} for v in self.values]
        keys = ("share", "Q", "Q0")
        loops = {n: {k: getattr(one, k).tolist() for k in keys} for n, one in self.loops.items()}
        return {
            "vehicle": self.vehicle, "edition": self.edition, "verdict": self.verdict,
            "reasons": list(self.reasons), "remarks": list(self.remarks), "held": self.held,
            "values": values, "loops": loops,
        }  # fmt: skip


def stationary(
    vehicle: Vehicle,
    track: Track,
    limits: StationaryLimits,
    *,
    cant: float | None = None,
    held: bool = True,
    settings: Settings | None = None,
) -> Stationary:
    """Stationary tests of a vehicle on twisted track and on cant.

    `vehicle`: vehicle on two bogies, or on two axles; `track`: gives rails, friction and support,
    as they are at its beginning; `cant`: [m]; by default the admissible cant deficiency of the
    service table; `held`: hold the wheelsets across the track, as the closed formulas do. Raises
    InputError: no cant; neither two bogies nor two axles; a cant above 0.5 m.
    """
    flat = flatten(vehicle)
    if cant is None:
        if vehicle.service is None:
            allowed, name = "give `cant`, or add [service] with cant_deficiency", vehicle.name
            raise InputError([Fault(name, "service", "missing", allowed, name)])
        cant = vehicle.service.cant_deficiency
    if not 0.0 < cant <= 0.5:
        raise argument_error("cant", f"found {cant:.12g} m", "above 0, up to 0.5 m")
    twists = twist_heights(flat, limits)
    settings = settings or Settings()
    model = assemble(vehicle, circle(track), settings.in_steady_rolling())
    balance = equilibrium(model, WALKING_PACE)
    values: list[StationaryValue] = []
    reasons: list[str] = []

    def solve(case: str, stand: Callable[[], S]) -> S | None:
        try:
            return stand()
        except NotConverged as error:
            reasons.append(f"{case}: {error}")
            return None

    loops: dict[str, TwistLoop] = {}
    for name, heights in twists.items():
        loop = solve(name, partial(twist_loop, balance, track, heights, held=held))
        if loop is not None:
            loops[name] = loop
        values += _unloading(name, loop, limits.unloading, has_pads(balance.model))
    whole = len(loops) == len(twists)
    load = min(float(loop.smallest[0].min()) for loop in loops.values()) if whole else np.nan
    curve = f"R {limits.guiding.radius:g} m"
    forces, quotients = [], []
    for hand, bend in (("right", 1.0), ("left", -1.0)):
        bend /= limits.guiding.radius
        case = f"{curve} to the {hand}"
        force = solve(f"{case}, level", partial(_force, vehicle, balance, track, settings, bend))
        forces.append(np.nan if force is None else force)
        for sign in (1.0, -1.0):
            roll = partial(_quotient, balance, track, sign * heights, bend)
            combined = solve(f"{case}, {name}", roll)
            quotients.append(np.nan if combined is None else combined)
    level = _y_over_q(float(np.fmax.reduce(forces)), load)
    values.append(_value(f"{curve}, level", "guiding Y/Q", level, limits.guiding))
    worst = float(np.fmax.reduce(quotients))
    values.append(_value(f"{curve}, {name}", "guiding Y/Q, combined", worst, limits.guiding))
    name = f"cant {1e3 * cant:g} mm"
    both = solve(name, lambda: [on_cant(balance, track, s * cant, held=held) for s in (1.0, -1.0)])
    values += _lean(name, balance.model, flat.reference, both or [], cant, limits)
    omitted = left_out(vehicle, track, settings, model)
    remarks = (*balance.remarks, *profile_remarks(model), *omitted)
    if any(value.quantity == UNLOADING and value.value > 1.0 for value in values):
        remarks += (LIFTED,)
    axles = balance.Q0.sum(axis=1)
    if np.abs(axles - axles[::-1]).max() > ENDS * axles.mean():
        remarks += (ONE_END,)
    if vehicle.loads:
        remarks = (f"load case: {vehicle.load or DESIGN}", *remarks)
    if limits.gauge is not None and abs(track.gauge - limits.gauge.value) > WIDENED:
        nominal = f"{1e3 * limits.gauge.value:g} mm"
        reasons.append(f"limits are those of {nominal}, the gauge is {1e3 * track.gauge:g} mm")
    judged = tuple(values), tuple(reasons), loops, remarks
    return Stationary(vehicle.name_with_load, limits.edition, held, *judged)


def twist_heights(flat: FlatVehicle, limits: StationaryLimits) -> dict[str, Floats]:
    """Height of the left rail above the right one at each wheelset, by the name of the twist [m].

    For a vehicle on two bogies: twist over the wheelbase of the bogies, over their spacing, and
    both; for a vehicle on two axles: twist over their spacing.

    Raises InputError: neither two bogies nor two axles.
    """
    wheelsets = flat.of_kind("wheelset")
    x = np.array([wheelset.position[0] for wheelset in wheelsets])
    ends = np.array([wheelset.name.split(".")[0] for wheelset in wheelsets])
    names = list(dict.fromkeys(ends.tolist()))
    if len(names) != 2:
        found = f"{len(wheelsets)} wheelsets in {len(names)} assemblies"
        allowed = "two bogies, or two axles, each an assembly or a wheelset of the vehicle"
        raise input_error(flat.name, found, allowed, key="wheelsets")
    middles = np.array([x[ends == name].mean() for name in names])
    of_wheelset = np.array([middles[names.index(end)] for end in ends])
    spacing = float(abs(middles[0] - middles[1]))
    over_body = limits.body_twist.over(spacing)
    body = over_body * (of_wheelset - middles.mean())
    name = f"twist {1e3 * over_body:.2f} permille over {spacing:g} m"
    within = x - of_wheelset
    if not np.any(within):
        return {name: body}
    base = float(np.ptp(within))
    over_bogie = limits.bogie_twist.over(base)
    bogie = over_bogie * within
    of_bogie = f"twist {1e3 * over_bogie:.2f} permille over {base:g} m"
    return {of_bogie: bogie, name: body, "both twists": bogie + body}


def _unloading(
    case: str, loop: TwistLoop | None, limit: Value, friction: bool
) -> list[StationaryValue]:
    """The worst wheel of a loop, and both branches on level track; nan without a loop."""
    level = "on level track, twist rising", "on level track, twist falling"
    if loop is None:
        wheel, worst, left = "", np.nan, (np.nan, np.nan)
    else:
        wheelset, side = loop.worst
        wheel = f"wheelset {wheelset + 1} {SIDES[side]}"
        worst, left = float(np.max(1.0 - loop.smallest / loop.Q0)), loop.on_level
    values = [_value(case, UNLOADING, worst, limit, wheel)]
    for name, value in zip(level, left, strict=True) if friction else ():
        values.append(StationaryValue(case, name, value, None, wheel))
    return values


def _force(
    vehicle: Vehicle, balance: Equilibrium, track: Track, settings: Settings, bend: float
) -> float:
    """Guiding force of the leading outer wheel in a level curve, outwards positive [N].

    `bend`: 1/radius, positive to the right [1/m].  Where Newton's method fails, a run on the circle
    finds it (`railsim.stability.curving`).
    """
    try:
        Y = on_twist(balance, track, np.zeros(len(balance.Q0)), curvature=bend).Y
    except NotConverged:
        found = curving(
            vehicle, radius=[1.0 / bend], cant=0.0,
            cant_deficiency=[cant_deficiency(WALKING_PACE, abs(bend), 0.0)], track=track,
            settings=settings,
        )  # fmt: skip
        if found.converged.item() == FAILED:
            raise
        Y = found.Y.reshape(-1, 2)
    outer, outwards = _outer_wheel(bend)
    return float("nan") if Y is None else outwards * float(Y[0, outer])


def _quotient(balance: Equilibrium, track: Track, heights: Floats, bend: float) -> float:
    """Y/Q of the leading outer wheel in a twisted curve, outwards positive."""
    state, (outer, outwards) = on_twist(balance, track, heights, curvature=bend), _outer_wheel(bend)
    assert state.Y is not None  # its wheelsets roll
    return _y_over_q(outwards * float(state.Y[0, outer]), float(state.Q[0, outer]))


def _y_over_q(Y: float, Q: float) -> float:
    """Y/Q; infinite of a wheel without load, held ones being drawn by their rails: no pass."""
    return np.inf if Q <= 0.0 else Y / Q


def _outer_wheel(bend: float) -> tuple[int, float]:
    """Side of the outer wheels in a curve, and the sign of forces outwards."""
    return (0, -1.0) if bend > 0.0 else (1, 1.0)


def _value(
    case: str, quantity: str, value: float, limit: Value, place: str = "wheelset 1 outer"
) -> StationaryValue:
    return StationaryValue(case, quantity, value, limit.value, place, limit.source, limit.checked)


def _lean(
    case: str,
    model: Model,
    body: str,
    standings: Sequence[Standing],
    cant: float,
    limits: StationaryLimits,
) -> list[StationaryValue]:
    """Unloading, angle of the floor and roll coefficient on a cant [m]; nan without a state.

    `standings`: leaning to the right and to the left.  The worse side counts, and for the roll
    coefficient the mean, in which the roll of a load to one side cancels out.
    """
    worst, wheel, share, most = np.nan, "", np.nan, np.nan
    if standings:
        shares = np.array([(standing.Q0 - standing.Q) / standing.Q0 for standing in standings])
        way, w, side = first_largest(shares)
        worst, wheel = float(shares[way, w, side]), f"wheelset {w + 1} {SIDES[side]}"
        leaning = zip(standings, (cant, -cant), strict=True)
        rolls = [roll_coefficient(model, standing, height, body) for standing, height in leaning]
        share, most = float(np.mean(rolls)), max(rolls)
    floor = float(np.arcsin(cant / CANT_BASE)) * (1.0 + most)
    return [
        _value(case, UNLOADING, worst, limits.lean_unloading, wheel),
        _value(case, "angle of the floor", floor, limits.lean_angle, body),
        StationaryValue(case, "roll coefficient", share, None, body),
    ]
