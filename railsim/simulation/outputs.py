"""From raw records of the time loop to the quantities of a result (see `railsim.notation`)."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.settings import Outputs, Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.kernels import contact_columns as contact
from railsim.kernels import element_outputs as element
from railsim.kernels import extremes as seen
from railsim.kernels.actuators import ACTION, AXLE
from railsim.kernels.controllers import ACTUATOR
from railsim.kernels.driving import write_axle_torques
from railsim.kernels.recording import Recorder
from railsim.model.assembly import Model
from railsim.model.time_step import empty_recorder
from railsim.model.work import against_rails, parts_of_wheel
from railsim.notation import COMPONENTS, PATCHES, QUANTITIES, REQUESTED, Quantity
from railsim.result.sensors import READINGS, all_sensors, motions, readings
from railsim.result.sinks import matches
from railsim.simulation.own_outputs import OwnOutputs
from railsim.track.alignment import alignment_of
from railsim.track.irregularity import displacement

ROLL, YAW, LATERAL = 3, 5, 1
NEEDED = ("time", "distance", "mileage", "curvature", "cant", "Q0")


def quantities(model: Model, recorder: Recorder, rows: int, Q0: Floats) -> Mapping[str, Floats]:
    """Quantities of the first `rows` records.

    `Q0`: static wheel loads, float64[wheelset, side] [N]. Returns arrays by the names of
    `railsim.notation.QUANTITIES`, time first [SI]; those that are worked out when asked for are not
    among them.
    """
    n = model.index.n_bodies
    state = recorder.state[:rows]
    position = state[:, : 6 * n].reshape(rows, n, 6)
    wheel = recorder.wheel[:rows]
    axles = model.system.contact.body
    Q, Y = wheel[..., contact.W_Q], wheel[..., contact.W_Y]
    outwards = np.array([-1.0, 1.0])
    loaded = np.where(Q > 0.0, Q, np.nan)  # a wheel that carries nothing has no Y/Q
    offsets = model.system.frame_offset[model.system.bodies.frame[axles]]
    on_rails = against_rails(model.system, state, recorder.rail[:rows])
    has_check = len(model.check.check) > 0
    of_check = {"force": contact.W_CHECK, "T_gamma": contact.W_CHECK_GAMMA} if has_check else {}
    return {
        "time": state[:, -3],
        "distance": state[:, -2],
        "Q": Q,
        "Y": Y,
        "Y_over_Q": outwards * Y / loaded,
        "dQ_over_Q0": (Q - Q0) / Q0,
        "sum_Y": _of_both(Y),
        "sum_abs_Y": _of_both(np.abs(Y)),
        "wheelset_lateral": on_rails[..., 0],
        "wheelset_roll": on_rails[..., 1],
        "wheelset_yaw": position[:, axles, YAW],
        "wheelset_distance": state[:, -2, None] + offsets + position[:, axles, 0],
        "xi_x": wheel[..., contact.W_XI_X],
        "xi_y": wheel[..., contact.W_XI_Y],
        "phi": wheel[..., contact.W_PHI],
        "T_gamma": wheel[..., contact.W_T_GAMMA],
        "T_gamma_spin": wheel[..., contact.W_T_GAMMA_SPIN],
        **{f"check_rail_{name}": wheel[..., column] for name, column in of_check.items()},
        "body_position": position,
        "body_velocity": recorder.rates[:rows].reshape(rows, n, 6),
        "body_acceleration": recorder.acceleration[:rows],
    }


def _of_wheels_there(wheel: Floats, column: int) -> Floats:
    """Column of the records of wheels, NaN where a wheel carries nothing: no point of contact."""
    return np.where(wheel[..., contact.W_NORMAL] > 0.0, wheel[..., column], np.nan)


def _of_both(values: Floats) -> Floats:
    """Sum over the last axis, the sides; numpy's own takes far longer over an axis of two."""
    total: Floats = 0.0 + values[..., 0] + values[..., 1]  # from zero, so that there is no -0.0
    return total


def run_extremes(extremes: Floats, Q0: Floats) -> dict[str, Floats]:
    """Largest and smallest values over all steps of a run, each with its time and position.

    `extremes`: float64[6, wheelset, EXTREMES], see `railsim.kernels.extremes`; `Q0`: static wheel
    loads, float64[wheelset, side] [N]. Returns for each quantity ``Q`` its values (extreme,
    wheelset, side), extremes in the order of `railsim.notation.EXTREMES`; ``Q_time`` [s] and
    ``Q_distance`` [m]: when, and where the reference body was.
    """
    columns: dict[str, int | slice] = {
        name: slice(first, first + 2)
        for name, first in (
            ("Q", seen.X_Q),
            ("Y", seen.X_Y),
            ("Y_over_Q", seen.X_Y_OVER_Q),
            ("T_gamma", seen.X_T_GAMMA),
        )
    }
    columns |= {
        "sum_Y": seen.X_SUM_Y,
        "sum_abs_Y": seen.X_SUM_ABS_Y,
        "wheelset_lateral": seen.X_LATERAL,
        "wheelset_roll": seen.X_ROLL,
        "wheelset_yaw": seen.X_YAW,
    }
    found: dict[str, Floats] = {}
    for name, column in columns.items():
        for row, ending in enumerate(("", "_time", "_distance")):
            found[name + ending] = extremes[[seen.MAX + row, seen.MIN + row]][..., column]
        found[name][~np.isfinite(found[name])] = np.nan  # a quotient of a wheel never loaded
    for ending in ("_time", "_distance"):
        found["dQ_over_Q0" + ending] = found["Q" + ending]
    found["dQ_over_Q0"] = (found["Q"] - Q0) / Q0
    return found


class Chunk(Mapping[str, Floats]):
    """Quantities by name, some of them worked out when asked for: summaries need few of them.

    `wrong`: which law of one's own has given no number, see `OwnOutputs`; or empty.
    """

    def __init__(
        self, values: dict[str, Floats], later: Mapping[str, Callable[[], Floats]], own: OwnOutputs
    ) -> None:
        self._values, self._later = values, later
        found, self.wrong = own.values(self)
        values |= found

    def __getitem__(self, name: str) -> Floats:
        if name not in self._values:
            self._values[name] = self._later[name]()
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._values, *self._later)))

    def __len__(self) -> int:
        return len(self._values.keys() | self._later.keys())


def extra_quantities(outputs: Outputs, track: Track) -> list[Quantity]:
    """Quantities beyond the usual ones of a run; `element_command` is there of actuators alone."""
    requests = {**dict(outputs), "check_rail": track.check_rail}
    quantities = [q for q in REQUESTED.values() if requests[q.request]]
    if outputs.sensors == "readings":
        quantities = [q for q in quantities if q.request != "sensors" or q.name in READINGS]
    return quantities


class OutputPlan:
    """What a run outputs: which elements, patches and track quantities beyond the usual ones.

    `irregularity`: displacements of the rails over s, see `railsim.track.irregularity`.
    """

    def __init__(self, model: Model, settings: Settings, track: Track, vehicle: Vehicle) -> None:
        self._model = model
        self._sensors = all_sensors(vehicle) if settings.outputs.sensors else {}
        self._outputs = settings.outputs
        self._readings_only = settings.outputs.sensors == "readings"
        self._alignment = alignment_of(track)
        self._track_file = track
        self.irregularity = displacement(track)
        known = {
            name: (group, index)
            for group, names in (
                (element.LINK, model.index.links),
                (element.MOUNT, model.index.mounts),
                (ACTUATOR, model.index.actuators),
            )
            for index, name in enumerate(names)
        }
        self.elements = tuple(name for name in known if matches(name, self._outputs.elements))
        # torques of actuators about axles are recorded beyond the elements that are asked for
        on_axles = np.flatnonzero(model.system.actuators.codes[:, ACTION] == AXLE)
        self._on_axles = on_axles if self._outputs.drives else on_axles[:0]
        chosen = [known[name] for name in self.elements]
        self._chosen = np.array([*chosen, *((ACTUATOR, i) for i in self._on_axles)], dtype=np.int64)
        self._own = OwnOutputs(settings, self._all_quantities(), self.coordinates)
        self.quantities = (*self._stored_quantities(), *self._own.quantities)

    def _stored_quantities(self) -> tuple[Quantity, ...]:
        """All quantities of the result: of the usual ones those that are asked for."""
        every, patterns = self._all_quantities(), self._outputs.quantities
        if not patterns:
            return every
        asked = (*NEEDED, *patterns)
        return tuple(q for q in every if matches(q.name, asked) or q.name not in QUANTITIES)

    def _all_quantities(self) -> tuple[Quantity, ...]:
        more = extra_quantities(self._outputs, self._track_file)
        if not set(self.elements) & set(self._model.index.actuators):
            more = [q for q in more if q.name != "element_command"]
        return (*QUANTITIES.values(), *more)

    @property
    def coordinates(self) -> dict[str, Sequence[str]]:
        """Names along the dimensions of the result."""
        names: dict[str, Sequence[str]] = {
            "wheelset": self._model.index.wheelsets,
            "body": self._model.index.bodies,
        }
        if self.elements:
            names["element"] = self.elements
        if self._outputs.contact_patches:
            count = parts_of_wheel(self._model.rails.arrays)
            names["patch"] = PATCHES + tuple(
                f"{name}, rail {k + 1}" for k in range(1, count) for name in PATCHES
            )
        if self._sensors:
            names |= {"sensor": tuple(self._sensors), "axis": COMPONENTS[:3]}
        return names

    def recorder(self, rows: int) -> Recorder:
        """Recorder with room for `rows` outputs."""
        chosen = self._chosen.reshape(-1, 2)
        return empty_recorder(self._model, rows, chosen, self._outputs.contact_patches)

    def _axle_torques(self, recorder: Recorder, rows: int) -> Floats:
        """Torques of drives, brakes and actuators on each wheelset, forwards positive [N m]."""
        system = self._model.system
        every = np.empty((rows, self._model.index.n_bodies))
        write_axle_torques(
            system.drives, system.frame_offset, system.bodies, recorder.state[:rows], every
        )
        torque = every[:, system.contact.body]
        wheelset = {int(body): w for w, body in enumerate(system.contact.body)}
        moment = recorder.element[:rows, len(self.elements) :, element.MOMENT + 1]
        for k, i in enumerate(self._on_axles):
            torque[:, wheelset[system.actuators.body[i, 1]]] += moment[:, k]
        return torque

    def chunk(self, recorder: Recorder, rows: int, Q0: Floats) -> Chunk:
        """Quantities of the first `rows` records by name."""
        values = dict(quantities(self._model, recorder, rows, Q0))
        if self.elements:
            values |= _elements(recorder.element[:rows, : len(self.elements)])
        if self._sensors:
            track = self._alignment, recorder.state[:rows, -1]
            of_bodies = values, self._model.index.bodies
            values |= zip(READINGS, readings(self._sensors, *of_bodies, *track), strict=True)
            if not self._readings_only:
                values |= motions(self._sensors, *of_bodies, *track)
        if self._outputs.contact_patches:
            values |= _patches(recorder.patch[:rows], recorder.state[:rows, -1])
        if self._outputs.drives:
            values["axle_torque"] = self._axle_torques(recorder, rows)
            values["running_speed"] = recorder.state[:rows, -1]
        if self._outputs.track:
            values |= self._track(values["wheelset_distance"])
            deflection = recorder.rail[:rows]
            axles = self._model.system.contact.body
            values |= {
                "rail_deflection_lateral": deflection[..., 0],
                "rail_deflection_vertical": deflection[..., 1],
                "wheelset_lateral_on_track": values["body_position"][:, axles, LATERAL],
                "wheelset_roll_on_track": values["body_position"][:, axles, ROLL],
            }
        known = {**values, "speed": recorder.state[:rows, -1]}
        values |= {q.name: q.formula(known) for q in self.quantities if q.formula is not None}
        distance, wheel = values["distance"], recorder.wheel[:rows]
        later = {
            "contact_y": lambda: _of_wheels_there(wheel, contact.W_C_Y),
            "contact_z": lambda: _of_wheels_there(wheel, contact.W_C_Z),
            "mileage": lambda: self._track_file.mileage_at(distance),
            "curvature": lambda: self._alignment.curvature(distance),
            "cant": lambda: self._alignment.cant(distance),
        }
        return Chunk(values, later, self._own)

    def _track(self, distance: Floats) -> dict[str, Floats]:
        rails = np.zeros((4, *distance.shape))
        if self.irregularity is not None:
            rails = self.irregularity(distance.ravel())[0].reshape(4, *distance.shape)
        return {
            "track_curvature": self._alignment.curvature(distance),
            "track_cant": self._alignment.cant(distance),
            "track_gradient": self._alignment.gradient(distance),
            "rail_lateral": np.stack((rails[0], rails[2]), axis=-1),
            "rail_vertical": np.stack((rails[1], rails[3]), axis=-1),
        }


def _elements(raw: Floats) -> dict[str, Floats]:
    def triples(first: int, second: int) -> Floats:
        return np.concatenate((raw[..., first : first + 3], raw[..., second : second + 3]), axis=-1)

    return {
        "element_deflection": triples(element.DEFLECTION, element.ANGLE),
        "element_force": triples(element.FORCE, element.MOMENT),
        "element_power": raw[..., element.POWER],
        "element_command": raw[..., element.COMMAND],
    }


def _patches(raw: Floats, speed: Floats) -> dict[str, Floats]:
    a, b, N = raw[..., contact.A], raw[..., contact.B], raw[..., contact.NORMAL]
    area = np.where(N > 0.0, np.pi * a * b, 1.0)
    # written over the speed of travel, as T_gamma of the wheel
    scale = raw[..., contact.PATCH_SPEED] / speed[:, None, None, None]
    work = (
        raw[..., contact.T_X] * raw[..., contact.XI_X]
        + raw[..., contact.T_Y] * raw[..., contact.XI_Y]
    )
    return {
        "patch_N": N,
        "patch_pressure": 1.5 * N / area,
        "patch_a": a,
        "patch_b": b,
        "patch_angle": np.arctan2(raw[..., contact.ANGLE_SIN], raw[..., contact.ANGLE_COS])
        * (N > 0.0),
        "patch_x": raw[..., contact.C_X],
        "patch_y": raw[..., contact.C_Y],
        "patch_z": raw[..., contact.C_Z],
        "patch_T_x": raw[..., contact.T_X],
        "patch_T_y": raw[..., contact.T_Y],
        "patch_T_gamma": scale * work,
        "patch_friction": raw[..., contact.MU_N] / np.where(N > 0.0, N, 1.0),
    }
