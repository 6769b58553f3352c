"""Stationary tests: unloading and guiding on twisted track (EN 14363, 6.1), roll coefficient.

Each case is solved by Newton's method (`railsim.linear.stationary`), twists to both sides.  A case
without a steady state is reported, and the verdict is then not a pass.

Guiding (EN 14363, 6.1, the method with two separate tests): the guiding force Y_a of the leading
outer wheel at walking pace in a level curve of R 150 m (`railsim.stability.curving`), over the
smallest wheel load of that wheelset on the twists, Y_a/Q_a <= 1.2; and Y/Q of this wheel rolling
through the curve of R 150 m with both twists, to either side.  Dry friction of the suspension is in
one state only: the hysteresis between loading and unloading is not followed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from railsim.cant import cant_deficiency
from railsim.constants import CANT_BASE
from railsim.definitions.flatten import FlatVehicle, flatten
from railsim.definitions.limits import StationaryLimits, Value
from railsim.definitions.settings import Settings
from railsim.definitions.track import Track
from railsim.definitions.vehicle import Vehicle
from railsim.errors import Fault, InputError
from railsim.linear.stationary import WALKING_PACE, Standing, on_cant, on_twist, roll_coefficient
from railsim.linear.steady import NotConverged
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.result.filters import Floats
from railsim.stability.curving import FAILED, curving
from railsim.table import Amount, Column, Table


@dataclass(frozen=True)
class StationaryValue:
    """One quantity of one case, and its limit.

    Attributes
    ----------
    case, quantity : str
        Track under the vehicle; quantity.
    value : float
        nan where no steady state was found [1 or rad].
    limit : float or None
        None where a value is only reported.
    place : str
        Wheel, or body.
    source : str
        Source of the limit.
    checked : bool
        Whether the limit has been compared with the printed standard.
    """

    case: str
    quantity: str
    value: float
    limit: float | None
    place: str
    source: str = ""
    checked: bool = False

    @property
    def exceeded(self) -> bool:
        """Whether the limit is exceeded; false for a case without a steady state."""
        return self.limit is not None and self.value > self.limit


@dataclass(frozen=True)
class Stationary:
    """Stationary tests of a vehicle.

    Attributes
    ----------
    vehicle, edition : str
    held : bool
        Whether the wheelsets were held across the track.
    values : tuple of StationaryValue
    reasons : tuple of str
        Cases without a steady state, a sentence each.
    """

    vehicle: str
    edition: str
    held: bool
    values: tuple[StationaryValue, ...]
    reasons: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """``fail`` if a limit is exceeded, ``incomplete`` if a case has no steady state."""
        if any(value.exceeded for value in self.values):
            return "fail"
        return "incomplete" if self.reasons else "pass"

    def table(self) -> Table:
        """Return the values with their limits; a value without a steady state is left open."""
        columns = [Column("case", "standing on"), Column("quantity"), Column("place", "location"),
                   Column("value", format=">"), Column("limit", format=">")]  # fmt: skip
        number, angle = Column("", format=".3f"), Column("", format=".2f")

        def shown(quantity: str, value: float | None) -> object:
            if value is None or np.isnan(value):
                return None
            if quantity.startswith("angle"):
                return f"{angle.text(float(np.degrees(value)))} deg"
            return Amount(value, number)

        rows = [[v.case, v.quantity, v.place, shown(v.quantity, v.value),
                 shown(v.quantity, v.limit)] for v in self.values]  # fmt: skip
        return Table(columns, rows)

    def record(self) -> dict[str, object]:
        """Return the tests as plain numbers and strings, SI."""
        values = [{**v.__dict__, "exceeded": v.exceeded} for v in self.values]
        return {
            "vehicle": self.vehicle, "edition": self.edition, "verdict": self.verdict,
            "reasons": list(self.reasons), "held": self.held, "values": values,
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

    Parameters
    ----------
    vehicle : Vehicle
        Vehicle on two bogies, or on two axles.
    track : Track
        Gives rail profiles and friction.
    limits : StationaryLimits
    cant : float, optional
        [m]; by default the admissible cant deficiency of the service table.
    held : bool
        Hold the wheelsets across the track, as the closed formulas do.
    settings : Settings, optional

    Raises
    ------
    InputError : no cant; neither two bogies nor two axles; a cant above 0.5 m.
    """
    flat = flatten(vehicle)
    if cant is None:
        cant = _admissible_cant(vehicle)
    if not 0.0 < cant <= 0.5:
        raise InputError([Fault("cant", "", f"{cant:g} m", "above 0, up to 0.5 m")])
    height = cant
    twists = twist_heights(flat, limits)
    balance = equilibrium(assemble(vehicle, track, settings or Settings()), WALKING_PACE)
    values: list[StationaryValue] = []
    reasons: list[str] = []

    def found(case: str, stand: Callable[[], Standing]) -> Standing | None:
        try:
            return stand()
        except NotConverged as error:
            reasons.append(f"{case}: {error}")
            return None

    def twisted(case: str, heights: Floats) -> Standing | None:
        return found(case, lambda: on_twist(balance, track, heights, held=held))

    loads = []
    for name, heights in twists.items():
        stands = [twisted(name, heights), twisted(name, -heights)]
        values.append(_unloading(name, stands, limits.unloading))
        loads += [np.nan if stand is None else float(stand.Q[0].min()) for stand in stands]
    values.append(_guiding(vehicle, track, limits, float(np.min(loads)), settings, reasons))
    curve, bend = f"R {limits.guiding.radius:g} m, {name}", 1.0 / limits.guiding.radius

    def rolling(heights: Floats) -> Standing | None:
        return found(curve, lambda: on_twist(balance, track, heights, curvature=bend))

    values.append(_climbing(curve, [rolling(heights), rolling(-heights)], limits))
    name = f"cant {1e3 * height:g} mm"
    standing = found(name, lambda: on_cant(balance, track, height, held=held))
    values.append(_unloading(name, [standing], limits.lean_unloading))
    body, slope = flat.reference, float(np.arcsin(height / CANT_BASE))
    share = roll_coefficient(balance.model, standing, height, body) if standing else float("nan")
    lean = limits.lean_angle
    values.append(StationaryValue(
        name, "angle of the floor", slope * (1.0 + share), lean.value, body, lean.source,
        lean.checked,
    ))  # fmt: skip
    values.append(StationaryValue(name, "roll coefficient", share, None, body))
    return Stationary(vehicle.name, limits.edition, held, tuple(values), tuple(reasons))


def twist_heights(flat: FlatVehicle, limits: StationaryLimits) -> dict[str, Floats]:
    """Height of the left rail above the right one at each wheelset, by the name of the twist [m].

    For a vehicle on two bogies: twist over the wheelbase of the bogies, over their spacing, and
    both; for a vehicle on two axles: twist over their spacing.

    Raises
    ------
    InputError : neither two bogies nor two axles.
    """
    wheelsets = flat.of_kind("wheelset")
    x = np.array([wheelset.position[0] for wheelset in wheelsets])
    ends = np.array([wheelset.name.split(".")[0] for wheelset in wheelsets])
    names = list(dict.fromkeys(ends.tolist()))
    if len(names) != 2:
        found = f"{len(wheelsets)} wheelsets in {len(names)} assemblies"
        allowed = "two bogies, or two axles, each an assembly or a wheelset of the vehicle"
        raise InputError([Fault(flat.name, "wheelsets", found, allowed)])
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
    return {
        f"twist {1e3 * over_bogie:.2f} permille over {base:g} m": bogie,
        name: body,
        "both twists": bogie + body,
    }


def _admissible_cant(vehicle: Vehicle) -> float:
    if vehicle.service is None:
        allowed = "give --cant, or add [service] with cant_deficiency"
        raise InputError([Fault(vehicle.name, "service", "missing", allowed)])
    return vehicle.service.cant_deficiency


def _guiding(
    vehicle: Vehicle,
    track: Track,
    limits: StationaryLimits,
    load: float,
    settings: Settings | None,
    reasons: list[str],
) -> StationaryValue:
    """Guiding force in the tight curve over the smallest wheel load of the leading wheelset."""
    limit = limits.guiding
    case = f"R {limit.radius:g} m, level"
    deficiency = cant_deficiency(WALKING_PACE, 1.0 / abs(limit.radius), 0.0)
    found = curving(
        vehicle,
        radius=[limit.radius],
        cant=0.0,
        cant_deficiency=[deficiency],
        track=track,
        settings=settings,
    )
    quotient = float("nan")
    if found.converged.item() == FAILED:
        reasons.append(f"{case}: no steady state in the curve")
    else:
        outer = 0  # left in a right-hand curve
        quotient = abs(float(found.Y.reshape(-1, 2)[0, outer])) / load
    return StationaryValue(
        case, "guiding Y/Q", quotient, limit.value, "wheelset 1 outer", limit.source, limit.checked
    )


def _climbing(
    case: str, rolling: Sequence[Standing | None], limits: StationaryLimits
) -> StationaryValue:
    """Largest Y/Q of the leading outer wheel, the left one, over some states."""
    quotients = [
        float("nan") if state is None or state.Y is None else -state.Y[0, 0] / state.Q[0, 0]
        for state in rolling
    ]
    limit = limits.guiding
    return StationaryValue(
        case, "guiding Y/Q, combined", float(np.max(quotients)), limit.value, "wheelset 1 outer",
        limit.source, limit.checked,
    )  # fmt: skip


def _unloading(case: str, stands: Sequence[Standing | None], limit: Value) -> StationaryValue:
    """Return the worst wheel over some states; nan if one of them was not found."""
    worst, label = -np.inf, ""
    for standing in stands:
        if standing is None:
            worst, label = np.nan, ""
            break
        shares = (standing.Q0 - standing.Q) / standing.Q0
        w, side = np.unravel_index(int(np.argmax(shares)), shares.shape)
        if shares[w, side] > worst:
            worst = float(shares[w, side])
            label = f"wheelset {w + 1} {('left', 'right')[side]}"
    words = "unloading (Q0 - Q)/Q0"
    return StationaryValue(
        case, words, float(worst), limit.value, label, limit.source, limit.checked
    )
