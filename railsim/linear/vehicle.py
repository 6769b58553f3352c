"""A vehicle prepared for linear analysis: definitions to a linearisation at any speed."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.creep_law import CREEP_LAWS
from railsim.definitions.loading import check_types
from railsim.errors import Faults, ModelError, argument_error
from railsim.kernels.internal import PAD
from railsim.kernels.system import FIXED, RIGID, System
from railsim.linear.circle import at_middle, circle, left_out
from railsim.linear.coordinates import Coordinates, FreeVehicle, coordinates
from railsim.linear.harmonic import ContactPath
from railsim.linear.steady import SteadyRolling, follow
from railsim.linear.system import Linearisation
from railsim.model.assembly import Model, assemble, check_fixed
from railsim.model.equilibrium import equilibrium
from railsim.model.plausibility import profile_remarks
from railsim.model.work import without_loads
from railsim.profiles import Profile
from railsim.profiles.builtin import cone
from railsim.track.tables import track_tables

WALKING_PACE = 1.0  # m/s
AMPLITUDE = 3e-3  # m, of the wheelsets where the linearisation is harmonic (EN 14363 practice)
LINEARISATIONS = ("tangent", "harmonic")
CONICITIES = (0.005, 0.6)  # of straight cones with the flange of S1002
# what a remark says of friction elements
STICKING = (
    "they are linearised with their elasticity in sticking, and what they damp in sliding is left "
    "out"
)
# what a remark says of a law that has no derivative at zero creepage
DIRECTED = (
    "Polach's creep force has no tangent at zero creepage: its slope goes from c11 to c22 with the "
    "direction of the creepage, so that small oscillations of a run have another damping"
)
CELLS = 100  # along and across a patch, from which on the slopes of the creep force have no steps


def smooth_law(settings: Settings | None) -> Settings:
    """Return settings whose creep law has smooth slopes: cells as fine as makes no difference.

    The cells of a coarse grid change from sticking to sliding one after the other.  What that does
    to a force is small, its slope jumps: the tangent critical speed of a coach on 10 x 10 cells by
    2 m/s from friction 0.44 to 0.48, on 100 x 100 by 0.2 m/s.
    """
    check_types([], settings=settings)
    settings = settings or Settings()
    if not CREEP_LAWS[settings.creep_law].grid:
        return settings
    along, across = (max(CELLS, number) for number in settings.fastsim_grid)
    return settings.replace(fastsim_grid=(along, across))


def conditions(track: Track, settings: Settings) -> dict[str, str]:
    """Return in words on what rails, with which creep law and friction."""
    words = {}
    for key, one in (("law", settings), ("linear_law", smooth_law(settings))):
        law = CREEP_LAWS[one.creep_law]
        words[key] = law.label + (" {} x {} cells".format(*one.fastsim_grid) if law.grid else "")
    return {"rails": track.support.preset, **words, "friction": track.friction_words}


def laws_in_words(where: Mapping[str, str]) -> str:
    """Return the creep law of the runs, and that of the linearisation where it is another."""
    law, linear = where["law"], where["linear_law"]
    return f"creep law {law}" if law == linear else f"creep law {law} (linear: {linear})"


@dataclass(frozen=True)
class Contact:
    """How the contact of wheel and rail is linearised."""

    linearisation: str = "tangent"  # ``tangent`` in the steady state, or ``harmonic``
    amplitude: float = AMPLITUDE  # of the harmonic linearisation [m]
    conicity: float | None = None  # of straight cones instead of the wheels [1]

    def faults(self) -> Faults:
        """Return what is wrong with it."""
        faults, (low, high), size = Faults(), CONICITIES, self.amplitude
        known, found = self.linearisation in LINEARISATIONS, f"found '{self.linearisation}'"
        faults.require(known, "linearisation", found, " or ".join(LINEARISATIONS))
        positive = isinstance(size, Real) and 0.0 < size < math.inf
        found = f"found {size} m"
        faults.require(positive, "amplitude", found, "a positive number of m")
        used = self.linearisation == "harmonic" or size == AMPLITUDE
        faults.require(used, "amplitude", found, "only with linearisation harmonic")
        given = self.conicity
        inside = given is None or (isinstance(given, Real) and low <= given <= high)
        faults.require(inside, "conicity", f"found {self.conicity}", f"{low:g} to {high:g}")
        return faults

    def record(self) -> dict[str, Any]:
        """Return it as plain data; an amplitude where it counts."""
        return {
            "linearisation": self.linearisation,
            "amplitude": self.amplitude if self.linearisation == "harmonic" else None,
            "conicity": self.conicity,
        }

    def words(self) -> str:
        """Return it in words."""
        words = self.linearisation
        if self.linearisation == "harmonic":
            words += f" {1e3 * self.amplitude:g} mm"
        return words if self.conicity is None else f"{words}, cones of {self.conicity:g}"


class LinearVehicle:
    """A vehicle on straight or circular track, to be linearised at any speed.

    - `vehicle`, `track`: definitions; of the track rails, gauge, friction and support count,
      those at the arc length `at`, by default at its beginning [m]
    - `contact`: how wheel and rail are linearised
    - `radius`, `cant`: of the track on which the vehicle rolls [m]
    - `held`: hold the wheelsets
    - `hold`: bodies that are fixed to the moving track frame where they are in steady rolling
    - `profiles`: profiles that take precedence over built-in ones and files
    - `name`: of the vehicle
    - `remarks`: remarks for the reader of the results
    - `sticking`: number of friction elements, which a linearisation takes as sticking

    Raises InputError: something is out of range. ModelError: the vehicle has no equilibrium.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        track: Track,
        *,
        contact: Contact | None = None,
        radius: float = math.inf,
        cant: float = 0.0,
        held: bool = False,
        hold: Sequence[str] = (),
        settings: Settings | None = None,
        profiles: Mapping[str, Profile] | None = None,
        at: float = 0.0,
    ) -> None:
        self.at = at
        self.contact = contact or Contact()
        faults = self.contact.faults()
        faults.require(abs(radius) >= 5.0, "radius", f"found {radius:.12g} m", "5 m at least")
        faults.require(abs(cant) <= 0.5, "cant", f"found {cant:.12g} m", "0.5 m at most")
        faults.check()
        check_types([vehicle], track)
        self.held, self.name = held, vehicle.name_with_load
        self.curvature, self.cant = 1.0 / radius if math.isfinite(radius) else 0.0, cant
        known = dict(profiles or {})
        if self.contact.conicity is not None:
            vehicle, profile = on_cones(vehicle, self.contact.conicity)
            known[profile.name] = profile
        self.track = track
        self._path = None
        if self.contact.linearisation == "harmonic" and not held:
            self._path = ContactPath(self.contact.amplitude)
        rolling = (settings or Settings()).in_steady_rolling()
        assembled = assemble(vehicle, circle(track, at=at), rolling, known)
        balance = equilibrium(assembled, WALKING_PACE)
        self.model: Model = balance.model
        self.Q0: Floats = balance.Q0
        omitted = left_out(vehicle, track, settings or Settings(), assembled)
        self.remarks = (*balance.remarks, *profile_remarks(assembled, known), *omitted)
        if self.curvature * cant < 0.0:
            self.remarks += (
                "cant on the wrong side, the outer rail is the lower one: cant is positive in "
                "right-hand curves, negative in left-hand ones",
            )
        self.sticking = int(np.count_nonzero(self.model.system.internal.kind == PAD))
        if self.sticking:
            self.remarks += (f"{self.sticking} friction elements stick: {STICKING}",)
        if rolling.creep_law == "polach":
            self.remarks += (DIRECTED,)
        kinds = zip(self.model.index.bodies, self.model.system.bodies.kind, strict=True)
        rigid = [name for name, kind in kinds if kind in (RIGID, FIXED)]
        if wrong := [name for name in hold if name not in rigid]:
            found = "no such body; `held` holds the wheelsets"
            raise argument_error("hold", found, ", ".join(rigid), key=wrong[0])
        self.hold = tuple(hold)
        self.coordinates: Coordinates = coordinates(self.model, held=held, hold=hold)
        if not self.coordinates.n_velocities:
            raise argument_error("held", "nothing is left that moves", "hold fewer bodies")
        self._known: dict[float, Floats] = {}
        self._tangents: dict[float, tuple[FreeVehicle, Floats]] = {}
        self._rest = at_middle(balance.state)
        there = circle(track, curvature=self.curvature, cant=cant, at=at)
        check_fixed(assembled.flat, there)
        self.system = without_loads(self.model.system)._replace(track=track_tables(there))

    @property
    def place(self) -> str:
        """The track that it rolls on, in words."""
        shape = "straight track"
        if self.curvature or self.cant:
            shape = f"R {1.0 / self.curvature:.6g} m" if self.curvature else shape
            shape += f", cant {1e3 * self.cant:g} mm (positive: left rail higher)"
        where = conditions(self.track, Settings())
        return f"{shape}, rails {where['rails']}, friction {where['friction']}"

    @property
    def path_remarks(self) -> tuple[str, ...]:
        """Where the linearisation about an amplitude is not about hunting, in words."""
        return self._path.remarks if self._path else ()

    def steady(self, speed: float) -> Floats:
        """Return the state of steady rolling at a speed [m/s]; raises ModelError: there is none."""
        straight = not self.curvature and not self.cant
        if speed not in self._known and self.held and straight:  # as at rest, whatever rolls
            solver = SteadyRolling(self.model, self.system, held=True)
            self._known[speed] = solver.solve(self._rest, speed)
        if speed not in self._known and self._known:
            near = min(self._known, key=lambda v: abs(v - speed))
            solver = SteadyRolling(self.model, self.system)
            with suppress(ModelError):  # too far from the known one: led there from straight track
                self._known[speed] = solver.solve(self._known[near], speed)
        if speed not in self._known:
            self._known[speed] = self._led(speed)
        return self._known[speed]

    def _led(self, speed: float) -> Floats:
        """The same, led there from rolling at walking pace on straight track."""

        def along(share: float) -> tuple[System, float]:
            bend, cant = share * self.curvature, share * self.cant
            part = circle(self.track, curvature=bend, cant=cant, at=self.at)
            system = self.system._replace(track=track_tables(part))
            return system, WALKING_PACE + math.sqrt(share) * (speed - WALKING_PACE)

        return follow(self.model, along, self._rest)[0]

    def free(self, speed: float) -> FreeVehicle:
        """Return the vehicle about its steady rolling at a speed [m/s]."""
        return FreeVehicle(
            self.model, self.system, self.steady(speed), held=self.held, hold=self.hold
        )

    def linearised(self, speed: float, path: ContactPath | None = None) -> Linearisation:
        """Return the linearisation at a speed [m/s], with a `path` for its amplitude."""
        if speed not in self._tangents:
            vehicle = self.free(speed)
            self._tangents[speed] = vehicle, vehicle.tangent()
        vehicle, tangent = self._tangents[speed]
        return vehicle.linearisation(self.for_amplitude(vehicle, tangent, path))

    def for_amplitude(
        self, vehicle: FreeVehicle, tangent: Floats, path: ContactPath | None = None
    ) -> Floats:
        """Return a tangent, or where `contact` or `path` have an amplitude the matrix for it."""
        path = path or self._path
        return path.matrix(vehicle, tangent) if path else tangent


def on_cones(vehicle: Vehicle, conicity: float) -> tuple[Vehicle, Profile]:
    """Return a vehicle with all its wheels replaced by straight cones, and their profile."""
    profile = cone(conicity)
    data = vehicle.model_dump(exclude_none=True)

    def replace(group: dict[str, Any]) -> None:
        for wheelset in group.get("wheelsets", {}).values():
            wheelset["profile"] = profile.name
        for assembly in group.get("assemblies", {}).values():
            replace(assembly)

    replace(data)
    return Vehicle.model_validate(data), profile
