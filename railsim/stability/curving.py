"""Quasi-static curving over radius, cant deficiency and friction.

Each point is steady rolling on a circle by Newton's method (`railsim.linear.steady`), led from the
neighbouring point.  Where that fails or its state is unstable, and with friction elements, which
hold what the way leaves in them, the vehicle runs through a transition into the circle and on until
it is still; such points are marked, and those where it leaves the track too.  Where it does not
come to rest, values are means over time.

    V^2 = g R (h + I)/1.5 m        speed from radius R, cant h and cant deficiency I
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.cant import curve_speed
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.loading import check_types, load_track
from railsim.errors import Faults, ModelError, optional_package
from railsim.kernels.contact_columns import C_Y, NORMAL, W_Q, W_T_GAMMA, W_Y
from railsim.kernels.internal import PAD
from railsim.kernels.state import ARC_LENGTH, SPEED
from railsim.kernels.system import System
from railsim.kernels.time_loop import FAST
from railsim.linear.circle import POSITION, at_middle, circle, left_out
from railsim.linear.coordinates import FreeVehicle, coordinates
from railsim.linear.eigenmodes import GROWS, eigenmodes
from railsim.linear.modes import SPEED_RANGE
from railsim.linear.naming import parts_of
from railsim.linear.steady import NotConverged, SteadyRolling, follow
from railsim.linear.vehicle import WALKING_PACE
from railsim.model.assembly import assemble, check_fixed
from railsim.model.equilibrium import equilibrium
from railsim.model.plausibility import profile_remarks
from railsim.model.time_step import Stability
from railsim.model.work import CONSTANT_SPEED, against_rails, without_loads
from railsim.notation import ROLL, YAW
from railsim.plottable import Plottable
from railsim.profiles import Profile
from railsim.simulation.auxiliary_track import advance, curve_to_settle_in
from railsim.simulation.run_in import TIMES
from railsim.table import Column, Table
from railsim.track.tables import track_tables

Progress = Callable[[float], None]

SMALLEST_RADIUS, LARGEST_CANT = 20.0, 0.3  # m
# m, of the deficiency: 6.5 m/s2, in which vehicles overturn, so that millimetres are no metres
LARGEST_DEFICIENCY = 1.0
FAILED, NEWTON, TIME, MEAN = range(4)
SETTLING = 60.0  # s, longest time integration of a point
SAMPLED, SAMPLES = 20.0, 400  # s, over which means are taken, and number of instants
INTERVAL = 5e-3  # s, which steps divide
COLUMNS = (
    Column("radius", unit="m", format="g"),
    Column("cant_deficiency", "I", "mm", "g"),
    Column("friction", "mu", format="g"),
    Column("speed", "V", "m/s", ".2f"),
    Column("lateral", "y", "mm", ".2f"),
    Column("attack", unit="mrad", format=".2f"),
    Column("Q", unit="kN", format=".1f"),
    Column("Y", unit="kN", format=".1f"),
    Column("Y_over_Q", "Y/Q", format=".3f"),
    Column("T_gamma", unit="N", format=".0f"),
    Column("found", " "),
)
METHODS = (
    "leaves the track, or no stable step",
    "",
    "by time integration",
    "mean: does not come to rest",
)
SAME = 1e-4  # m and rad, of equal states
STILL = 1e-4  # share of the wheel loads by which forces still change after a second


@dataclass(frozen=True, repr=False)
class Curving(Plottable):
    """Steady curving on a grid.

    - `radius`, `cant_deficiency`, `friction`: the grid [m], [m], [1]
    - `cant`: of the outer rail over the inner one [m]
    - `speed`: [m/s]
    - `converged`: 1 by Newton's method, 2 by time integration, 3 by means of a motion that does not
      come to rest, 0 where the vehicle leaves the track, or no step is stable: NaN
    - `Q`, `Y`, `Y_over_Q`, `dQ_over_Q0`, `T_gamma`, `contact_y`: see `railsim.notation`;
      `contact_y` is the lateral position of the most loaded patch [m]
    - `lateral`, `attack`: lateral displacement [m] and angle of attack, the yaw against the radial
      direction [rad]
    - `sum_Y`: [N]
    - `steering`: yaw of the bogie frames against the track at their own positions [rad]
    - `car_roll`: roll of the (first) car body against the track [rad]
    - `wheelsets`, `bogies`: names
    - `wheelset_position`: positions of the wheelsets along the vehicle, against its reference body
      [m]
    - `vehicle`, `place`: name of the vehicle; rails of the track
    - `remarks`: remarks for the reader
    """

    radius: Floats
    cant_deficiency: Floats
    friction: Floats
    cant: float
    speed: Floats
    converged: Integers
    Q: Floats
    Y: Floats
    Y_over_Q: Floats
    dQ_over_Q0: Floats
    T_gamma: Floats
    contact_y: Floats
    lateral: Floats
    attack: Floats
    sum_Y: Floats
    steering: Floats
    car_roll: Floats
    wheelsets: tuple[str, ...]
    bogies: tuple[str, ...]
    wheelset_position: tuple[float, ...]
    vehicle: str = ""
    place: str = ""
    remarks: tuple[str, ...] = ()
    DIMS: ClassVar = ("radius", "cant_deficiency", "friction")
    OF_WHEELS: ClassVar = ("Q", "Y", "Y_over_Q", "dQ_over_Q0", "T_gamma", "contact_y")
    VALUES: ClassVar[dict[str, tuple[str, ...]]] = {
        **dict.fromkeys(OF_WHEELS, ("wheelset", "side")),
        **dict.fromkeys(("lateral", "attack", "sum_Y"), ("wheelset",)),
        "steering": ("bogie",),
        "car_roll": (),
    }

    def record(self) -> dict[str, Any]:
        """Return everything as plain data; dimensions are named."""
        return {
            **{name: getattr(self, name).tolist() for name in self.DIMS},
            "cant": self.cant,
            "wheelset": list(self.wheelsets),
            "wheelset_position": list(self.wheelset_position),
            "side": ["left", "right"],
            "bogie": list(self.bogies),
            "remarks": list(self.remarks),
            "speed": self.speed.tolist(),
            "converged": self.converged.tolist(),
            "dims": {name: [*self.DIMS, *dims] for name, dims in self.VALUES.items()},
            **{name: getattr(self, name).tolist() for name in self.VALUES},
        }

    @property
    def title(self) -> str:
        """Vehicle, track and cant in words."""
        cant = f"cant {1e3 * self.cant:g} mm (outer rail higher)"
        return f"{self.vehicle}: steady curving, {cant}, {self.place}"

    def table(self) -> Table:
        """Return leading wheelset, its outer wheel and the wear number of all at every point."""
        rows = []
        for index in np.ndindex(self.converged.shape):
            r, i, m = index
            outer = 0 if self.radius[r] > 0.0 else 1
            wheel = [getattr(self, name)[index][0, outer] for name in ("Q", "Y", "Y_over_Q")]
            at = self.radius[r], self.cant_deficiency[i], self.friction[m], self.speed[r, i]
            leading = self.lateral[index][0], self.attack[index][0], *wheel
            found = METHODS[int(self.converged[index])]
            rows.append([*at, *leading, self.T_gamma[index].sum(), found])
        caption = f"{self.title}; leading wheelset, its outer wheel, T_gamma of all wheels"
        return Table(COLUMNS, rows, caption)

    def to_xarray(self) -> Any:
        """Return an `xarray.Dataset`; needs xarray."""
        xarray = optional_package("xarray", "to_xarray", "'railsim[xarray]'")
        record = self.record()
        coords = {name: record[name] for name in (*self.DIMS, "wheelset", "side", "bogie")}
        variables = {name: (dims, getattr(self, name)) for name, dims in record["dims"].items()}
        variables["speed"] = (self.DIMS[:2], self.speed)
        variables["converged"] = (self.DIMS, self.converged)
        return xarray.Dataset(variables, coords, {"cant": self.cant})


def curving(
    vehicle: Vehicle,
    track: Track | None = None,
    *,
    radius: float | Sequence[float],
    cant: float = 0.15,
    cant_deficiency: float | Sequence[float] = 0.0,
    friction: float | Sequence[float] | None = None,
    settings: Settings | None = None,
    profiles: Mapping[str, Profile] | None = None,
    progress: Progress | None = None,
) -> Curving:
    """Find how a vehicle runs steadily in curves.

    Parameters
    ----------
    vehicle : Vehicle
        See `load_vehicle`.
    track : Track, optional
        Whose rails, gauge, inclination and support count; by default ``straight``.
    radius : float or sequence of float
        Radii, positive to the right [m].
    cant : float
        Of the outer rail over the inner one [m].
    cant_deficiency : float or sequence of float
        Cant deficiency, negative for an excess of cant [m].
    friction : float or sequence of float, optional
        Coefficients of friction of both rails; by default those of the track's rails at its
        beginning, of which the result holds the mean.
    settings : Settings, optional
        Creep law and contact.
    profiles : mapping of str to Profile, optional
        Profiles that take precedence over built-in ones and files.
    progress : callable, optional
        Called repeatedly with the finished fraction.

    Raises
    ------
    InputError
        Values are out of range.
    ModelError
        The vehicle has no equilibrium on straight track.

    Examples
    --------
    >>> import railsim
    >>> found = railsim.curving(railsim.load_vehicle("coach_manchester"), radius=[300.0, 600.0],
    ...                         cant_deficiency=[0.0])
    >>> found.converged.tolist()
    [[[1]], [[1]]]
    """
    track = track or load_track("straight")
    check_types([vehicle], track, settings=settings)
    both = track.friction_at(0.0)
    radii, deficiencies = _several(radius), _several(cant_deficiency)
    mus = _several(friction) if friction is not None else [float(np.mean(both))]
    check_grid(radii, cant, deficiencies, () if friction is None else mus)
    search = _Search(vehicle, track, cant, settings or Settings(), profiles)
    if friction is None and mus[0] > 0.0:
        search.shares = both / mus[0]
    found = search.empty(radii, deficiencies, mus)
    # from wide to narrow, each point from its neighbour
    order = sorted(range(len(radii)), key=lambda k: -abs(radii[k]))
    for m, mu in enumerate(mus):
        for i, deficiency in enumerate(deficiencies):
            for k, r in enumerate(order):
                search.fill(found, (r, i, m), search.point(radii[r], deficiency, mu))
                if progress is not None:
                    done = (m * len(deficiencies) + i) * len(radii) + k + 1
                    progress(done / found.converged.size)
    return found


def _several(values: float | Sequence[float]) -> list[float]:
    return [float(value) for value in np.atleast_1d(values)]


def check_grid(
    radius: Sequence[float], cant: float, deficiency: Sequence[float], friction: Sequence[float]
) -> None:
    """Raise InputError with all faults of the values of a grid."""
    faults = Faults()
    least = f"{SMALLEST_RADIUS:g} m at least, negative to the left"
    for value in radius:
        right = math.isfinite(value) and abs(value) >= SMALLEST_RADIUS
        faults.require(right, "radius", f"found {value:.12g} m", least)
    faults.require(
        0.0 <= cant <= LARGEST_CANT, "cant", f"found {cant:.12g} m", f"0 to {LARGEST_CANT:g} m"
    )
    for value in friction:
        faults.require(0.0 < value <= 2.0, "friction", f"found {value:.12g}", "above 0, at most 2")
    low, high = SPEED_RANGE
    for value in deficiency:
        speeds = [_speed(r, cant, value) for r in radius] if not faults else []
        fine = math.isfinite(value) and all(low <= v <= high for v in speeds)
        found = f"found {value:.12g} m with a cant of {cant:.12g} m"
        allowed = f"a sum that gives speeds of {low:g} to {high:g} m/s"
        if value > LARGEST_DEFICIENCY:
            fine, allowed = False, f"{LARGEST_DEFICIENCY:g} m at most: 0.1 is 100 mm"
        faults.require(fine, "cant_deficiency", found, allowed)
    for name, values in (("radius", radius), ("cant_deficiency", deficiency)):
        faults.require(len(values), name, "no value", "one at least")
    faults.check()


def _speed(radius: float, cant: float, deficiency: float) -> float:
    return curve_speed(radius, cant + deficiency) or math.nan


Point = tuple[SteadyRolling, list[Floats], int]  # solver, states to be averaged, how found


class _Search:
    """Steady states from the nearest known one; `shares`: friction of the rails over the given."""

    def __init__(
        self,
        vehicle: Vehicle,
        track: Track,
        cant: float,
        settings: Settings,
        profiles: Mapping[str, Profile] | None,
    ) -> None:
        self.track, self.cant, self.vehicle = track, cant, vehicle.name_with_load
        assembled = assemble(vehicle, circle(track), settings.in_steady_rolling(), profiles)
        check_fixed(assembled.flat, circle(track, curvature=1e-3, cant=cant))
        balance = equilibrium(assembled, WALKING_PACE)
        self.model = balance.model
        self.Q0 = balance.Q0
        self.remarks = (*balance.remarks, *profile_remarks(assembled, profiles))
        self.pads = int(np.count_nonzero(self.model.system.internal.kind == PAD))
        if self.pads:
            self.remarks += (
                f"{self.pads} friction elements hold what a transition of {TIMES[0]:g} s leaves in "
                "them",
            )
        self.remarks += left_out(vehicle, track, settings, assembled)
        self.parts = parts_of(self.model, coordinates(self.model))
        self.shares = np.ones(2)
        values = np.array([0.0, 0.0, WALKING_PACE**2, np.mean(track.friction_at(0.0))])
        self._rest = self._last = values, at_middle(balance.state)

    def _system(self, curvature: float, cant: float, friction: float) -> System:
        left, right = (friction * self.shares).tolist()
        there = circle(self.track, curvature=curvature, cant=cant, friction=(left, right))
        given = without_loads(self.model.system)  # at constant speed, as Newton's method has it
        return given._replace(track=track_tables(there), drive=CONSTANT_SPEED)

    def point(self, radius: float, deficiency: float, friction: float) -> Point:
        """Steady state at one point of the grid."""
        speed = _speed(radius, self.cant, deficiency)
        goal = np.array([1.0 / radius, math.copysign(self.cant, radius), speed**2, friction])
        for values, start in () if self.pads else (self._last, self._rest):
            if values[0] * radius < 0.0:
                continue

            def along(share: float, values: Floats = values) -> tuple[System, float]:
                curvature, cant, square, mu = values + share * (goal - values)
                return self._system(curvature, cant, mu), math.sqrt(square)

            with suppress(NotConverged):
                found, solver = follow(self.model, along, start, smallest=1.0 / 16.0)
                self._last = goal, found
                return self._stable_or_in_time(solver, found, goal)
        return self._in_time(goal, speed)

    def _stable_or_in_time(self, solver: SteadyRolling, state: Floats, goal: Floats) -> Point:
        """A steady state of Newton's method; where it is unstable, what a run comes to instead."""
        free = FreeVehicle(self.model, solver.system, state)
        if eigenmodes(free.linearisation(free.tangent())).eigenvalues.real.max() < GROWS:
            return solver, [state], NEWTON
        timed = self._in_time(goal, float(state[SPEED]))
        at = free.coordinates.indices[free.coordinates.positions]
        if timed[2] == TIME and np.allclose(timed[1][0][at], state[at], rtol=0.0, atol=SAME):
            return solver, [state], NEWTON
        return timed

    def _in_time(self, goal: Floats, speed: float) -> Point:
        """Run into the circle and on until nothing changes, else for means over time."""
        curvature, cant, _, friction = goal.tolist()
        solver = SteadyRolling(self.model, self._system(curvature, cant, friction))
        straight = self._system(0.0, 0.0, friction)
        try:
            rolling = SteadyRolling(self.model, straight).rolling_guess(self._rest[1], speed)
            stable = Stability(self.model, straight, rolling, "fast", lambda _: ())
            step = 0.5 * stable.choose(INTERVAL)  # half of it in flange contact
            state = self._into(goal, speed, straight, rolling, step)
            before = np.zeros_like(self.Q0)
            for _ in range(int(SETTLING)):
                state[ARC_LENGTH] = POSITION
                self._advance(solver.system, state, step, 1.0)
                solver.evaluate(state)
                now = solver.work.wheel[:, :, W_Y].copy()
                if np.max(np.abs(now - before)) < STILL * np.max(self.Q0):
                    return solver, [state], TIME
                before = now
            states = []
            for _ in range(SAMPLES):
                state[ARC_LENGTH] = POSITION
                self._advance(solver.system, state, step, SAMPLED / SAMPLES)
                states.append(state.copy())
            return solver, states, MEAN
        except ModelError:  # no stable step, or it leaves the track
            return solver, [], FAILED

    def _advance(self, system: System, state: Floats, step: float, time: float) -> None:
        """Advance a state; raises ModelError: the vehicle leaves the track."""
        if advance(self.model, system, state, step, round(time / step), FAST):
            raise ModelError("the vehicle leaves the track")

    def _into(
        self, goal: Floats, speed: float, straight: System, rolling: Floats, step: float
    ) -> Floats:
        """State of the vehicle that has come into the curve from straight track.

        Raises ModelError: it leaves the track.
        """
        left, right = (goal[-1] * self.shares).tolist()
        curvature, cant = goal[:2].tolist()
        to = curvature, cant, (left, right), TIMES
        way = curve_to_settle_in(self.model, self.track, speed, *to)
        state = rolling.copy()
        state[-3:] = 0.0, 0.0, speed
        system = straight._replace(track=track_tables(way))
        self._advance(system, state, step, way.length / speed - step)
        return state

    def empty(
        self, radius: Sequence[float], deficiency: Sequence[float], friction: Sequence[float]
    ) -> Curving:
        """The result of a grid without any value yet."""
        shape = len(radius), len(deficiency), len(friction)
        index, bodies = self.model.index, self.model.system.bodies
        frames = self.parts.frames
        sizes = {"wheelset": len(index.wheelsets), "side": 2, "bogie": len(frames)}
        arrays: dict[str, Any] = {
            name: np.full((*shape, *(sizes[dim] for dim in dims)), np.nan)
            for name, dims in Curving.VALUES.items()
        }
        positions = self.model.system.frame_offset[bodies.frame[list(self.parts.wheelsets)]]
        return Curving(
            np.array(radius, dtype=float),
            np.array(deficiency, dtype=float),
            np.array(friction, dtype=float),
            self.cant,
            np.array([[_speed(r, self.cant, i) for i in deficiency] for r in radius]),
            np.zeros(shape, dtype=np.int64),
            wheelsets=index.wheelsets,
            bogies=tuple(index.bodies[b] for b in frames),
            wheelset_position=tuple(positions.tolist()),
            vehicle=self.vehicle,
            place=f"rails {self.track.support.preset}",
            remarks=self.remarks,
            **arrays,
        )

    def fill(self, result: Curving, index: tuple[int, int, int], point: Point) -> None:
        """Put the values of a point into the result; none where it failed."""
        solver, states, how = point
        result.converged[index] = how
        if how != FAILED:
            values = [self._values(solver, state) for state in states]
            for name in values[0]:
                getattr(result, name)[index] = np.mean([each[name] for each in values], axis=0)

    def _values(self, solver: SteadyRolling, state: Floats) -> dict[str, Any]:
        """The values of `Curving` in one state."""
        solver.evaluate(state)
        wheelsets, frames = np.array(self.parts.wheelsets), list(self.parts.frames)
        wheel = solver.work.wheel.copy()
        Q, Y = wheel[:, :, W_Q], wheel[:, :, W_Y]
        with np.errstate(divide="ignore", invalid="ignore"):
            quotient = Y / Q * np.array([-1.0, 1.0])
        patch = solver.work.patch[:, : solver.patches]
        order = np.argsort(patch[NORMAL], kind="stable")  # of a wheel the most loaded one last
        contact_y = np.full(Q.shape, np.nan)
        contact_y[tuple(solver.work.patch_index[order, :2].T)] = patch[C_Y, order]
        return {
            "Q": Q,
            "Y": Y,
            "Y_over_Q": quotient,
            "dQ_over_Q0": (Q - self.Q0) / self.Q0,
            "T_gamma": wheel[:, :, W_T_GAMMA],
            "contact_y": contact_y,
            "lateral": against_rails(self.model.system, state[None])[0, :, 0],
            "attack": state[6 * wheelsets + YAW],
            "sum_Y": Y.sum(axis=1),
            "steering": state[[6 * b + YAW for b in frames]],
            "car_roll": state[6 * self.parts.cars[0] + ROLL] if self.parts.cars else np.nan,
        }
