"""A track judged by vehicles: `assess_track`.

The recording is divided into pieces that overlap by a run-in; each piece is one run of each vehicle
at each speed, carried out as a study: over all cores, with journal, to be resumed.  Of the signals,
filtered and sum Y as mean over 2 m, as in EN 14363, the largest shares of their limits are kept per
cell of 25 m; places are where a share exceeds the one asked for.

Beside it stands what the geometry alone says after EN 13848-5: standard deviations of level and
alignment in D1 over 200 m, and isolated defects.  A section of 200 m that only the vehicles
complain of is a miss of the geometry, one that only the geometry complains of a false alarm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from railsim.arrays import Floats, Integers
from railsim.assessment.criteria import RIDE_BAND
from railsim.assessment.signals import in_band
from railsim.definitions import Settings, Track, Vehicle
from railsim.definitions.excitations.measured import Measured
from railsim.definitions.excitations.measured_file import embed_measured
from railsim.definitions.limits import Situation
from railsim.definitions.loading import load_running_limits, load_track, load_vehicle
from railsim.definitions.track.layout import even_line, is_uniform
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, Faults, argument_error, input_error
from railsim.files.access import check_folder, write_folder
from railsim.notation import SIDES
from railsim.result import Result, open_result
from railsim.result.filters import low_passed, outward_quotient
from railsim.result.sensors import sensors
from railsim.simulation.conditions import SPEED_RANGE
from railsim.studies.carry_out import carry_out_cases
from railsim.studies.case import Case, short_name
from railsim.studies.geometry_limits import CELL, SECTION, RecordedGeometry
from railsim.studies.outcome import Outcome
from railsim.studies.spec import StudySpec
from railsim.table import Amount, Column, Table
from railsim.track.irregularity import measured_remarks

PIECE, RUN_IN, BEYOND = 2000.0, 200.0, 60.0  # m
RUN_OUT = 3.0  # s, behind which the band pass from 0.4 Hz has forgotten the end of a record
APART = 25.0  # m
POINTS = "floor_front", "floor_rear"
# 1/s; Hz, low pass of EN 14363; Hz, up to which runs store what that needs; m
RATE, LOW_PASS, STORED, SLIDING = 100.0, 20.0, 40.0, 2.0
QUANTITIES = {
    "Q": Column("Q", unit="kN", format=".1f"),
    "Y_over_Q": Column("Y/Q", format=".3f"),
    "sum_Y": Column("sum Y", unit="kN", format=".1f"),
    "body_y": Column("lateral acceleration of the floor", unit="m/s2", format=".2f"),
    "body_z": Column("vertical acceleration of the floor", unit="m/s2", format=".2f"),
}
UNCHECKED = "The limits of EN 13848-5 are from memory, not compared with the printed standard."


@dataclass(frozen=True)
class Place:
    """A place at which a vehicle exceeds the share of a limit."""

    vehicle: str
    speed: float  # [m/s]
    quantity: str  # of `QUANTITIES`
    where: str  # wheel, wheelset or point
    s: float  # of that wheelset or point [m]
    value: float  # [SI]
    limit: float  # [SI]
    shape: str  # the defect there in words
    mileage: float | None = None  # of the track there, if it has one [m]


class _Run(NamedTuple):
    """A run over the piece from a to b of a track; by how much its own track begins later [m]."""

    case: Case
    a: float
    b: float
    moved: float


@dataclass(frozen=True, eq=False)
class TrackAssessment:
    """A track judged by vehicles, and by its geometry.

    - `share`: of the limits, from which on a place is listed [1]
    - `places`: by falling share of the limit
    - `cells`: begins of the cells [m]
    - `shares`: largest share of the limit per cell, by vehicle, speed and quantity; NaN where no
      run came
    - `sections`: what vehicles and geometry say of each section of 200 m
    - `flagged`: number of sections that both, only vehicles (misses), only the geometry (false
      alarms) and none complain of, and of those that some vehicle did not run over
    - `computed`: runs that were computed by this call
    """

    folder: Path
    share: float
    places: tuple[Place, ...]
    cells: Floats
    shares: dict[tuple[str, float, str], Floats]
    sections: Table
    flagged: Integers
    computed: int
    remarks: tuple[str, ...]

    def table(self) -> Table:
        """Return the places."""
        columns: list[Column | str] = ["vehicle", Column("speed", unit="km/h", format=".0f"),
                   Column("s", "at s", "m", ".0f"), "quantity", "location",
                   Column("value", format=".2f"),
                   Column("share", "of the limit", "", ".2f"),
                   "shape"]  # fmt: skip
        with_mileage = any(p.mileage is not None for p in self.places)
        columns += [Column("mileage", unit="km", format=".3f")] * with_mileage
        rows = []
        for p in self.places:
            shown = QUANTITIES[p.quantity]
            value = Amount(p.value, shown, with_unit=True)
            rows.append([p.vehicle, p.speed, p.s, shown.name, p.where, value, p.value / p.limit,
                         p.shape, *[p.mileage] * with_mileage])  # fmt: skip
        return Table(columns, rows)

    def _with_units(self) -> Table:
        """Return the places with the SI unit of each value beside it."""
        shown = self.table()
        k = [column.name for column in shown.columns].index("value") + 1
        units = [QUANTITIES[place.quantity].si_unit or "1" for place in self.places]
        rows = [[*row[:k], unit, *row[k:]] for row, unit in zip(shown.rows, units, strict=True)]
        return Table([*shown.columns[:k], "unit", *shown.columns[k:]], rows)

    @property
    def notes(self) -> tuple[str, ...]:
        """Misses and false alarms in words."""
        both, missed, false, _, left = self.flagged.tolist()
        not_run = f"; not run over by all vehicles: {left}" if left else ""
        return (
            f"Sections of {SECTION:g} m: {sum(self.flagged)}; flagged by vehicles and geometry: "
            f"{both}; only by vehicles (missed by geometry limits): {missed}; only by geometry "
            f"(false alarms): {false}{not_run}.",
            UNCHECKED,
            *self.remarks,
        )

    def record(self) -> dict[str, Any]:
        """Return the assessment as plain data, SI."""
        names = ("both", "missed", "false_alarms", "none", "not_run")
        return {
            "share": self.share, "places": self._with_units().records(),
            "sections": self.sections.records(),
            "flagged": dict(zip(names, self.flagged.tolist(), strict=True)),
            "remarks": [UNCHECKED, *self.remarks],
        }  # fmt: skip

    def write(self) -> list[Path]:
        """Write places and sections as CSV into the folder of the runs."""
        tables = {"places.csv": self._with_units(), "sections.csv": self.sections}
        content = {name: table.csv().encode() for name, table in tables.items()}
        return write_folder(self.folder, content, overwrite=True)


def assess_track(
    recording: str | Path,
    vehicles: Sequence[str | Path],
    speeds: Sequence[float],
    *,
    out: str | Path,
    share: float = 0.8,
    **how: Any,
) -> TrackAssessment:
    """Run vehicles over a recorded track and list where they exceed a share of a limit.

    `recording`: track file with a measured irregularity, or the CSV of one: then straight track;
    `vehicles`: files or names; each needs a service table; `speeds`: [m/s]; `out`: folder of the
    runs; `share`: of the limits of EN 14363; `how`: fields of `railsim.studies.spec.Execution`.
    Raises InputError: all faults of the inputs; no recording in the track.
    """
    if not 0.0 < share <= 10.0:
        raise argument_error("share", f"found {share:.12g}", "above 0, up to 10")
    folder = Path(out)
    check_folder(folder)
    track = load_recorded_track(recording)
    tested = {short_name(name): load_vehicle(name) for name in vehicles}
    if len(tested) < len(vehicles):
        found = f"found {', '.join(map(short_name, vehicles))}"
        raise argument_error("vehicles", found, "each vehicle once; files of different names")
    low, high = SPEED_RANGE
    if wrong := [speed for speed in speeds if not low <= speed <= high]:
        raise argument_error("speeds", f"found {wrong[0]:.12g} m/s", f"{low:g} to {high:g} m/s")
    missing = [n for n, v in tested.items() if v.service is None]
    allowed = "add [service] with admissible_speed and cant_deficiency"
    Faults(Fault(name, "service", "missing", allowed) for name in missing).check()
    bare = [n for n, v in tested.items() if POINTS[0] not in sensors(v)]
    found, allowed = "a vehicle of wheelsets alone", "one with a body, whose floor is judged"
    Faults(Fault(name, "bodies", found, allowed) for name in bare).check()
    begin, end = _extent(track)
    count = max(1, round((end - begin) / PIECE))
    edges = np.linspace(begin, end, count + 1)
    quantities = ["Q", "Y", "Y_over_Q", "wheelset_distance"]
    outputs: Any = {"low_pass": {"frequency": STORED}, "sensors": "readings"}
    outputs["quantities"] = quantities
    settings = Settings(output_rate=RATE, outputs=outputs)
    runs: list[_Run] = []
    behind = {name: _length_behind(vehicle) for name, vehicle in tested.items()}
    for number, (a, b) in enumerate(pairwise(edges.tolist())):
        part, moved = _part(track, a, b + max(behind.values()) + RUN_OUT * max(speeds))
        for name, vehicle in tested.items():
            for speed in speeds:
                label = f"{name}_{speed:g}_{number:04d}"
                case = Case(
                    label, vehicle, part, settings, float(speed), max(0.0, a - moved - RUN_IN),
                    until=min(b + behind[name] + RUN_OUT * speed - moved, part.length),
                    labels={"vehicle": name, "track": part.name, "speed": float(speed)},
                )  # fmt: skip
                runs.append(_Run(case, a, b, moved))
    spec = StudySpec(
        vehicles=[str(v) for v in vehicles], tracks=[str(recording)], speeds=list(speeds),
        single=True, keep=",".join([*quantities, "sensor_acceleration"]),
    )  # fmt: skip
    outcome = carry_out_cases([case for case, *_ in runs], spec, folder, **how)
    ended = outcome.records.of_status(lambda status: status != "complete")
    remarks = [f"{one['name']}: {one['status']}, {one['status_reason']}" for one in ended]
    remarks += _omissions(track) + _hunting_remarks(outcome.records) + measured_remarks(track)
    return _assessment(track, runs, share, outcome, remarks)


def _hunting_remarks(records: Sequence[Mapping[str, Any]]) -> list[str]:
    """Remark on vehicles that hunt: what they exceed is not the track's."""
    runs: dict[tuple[str, float], list[bool]] = {}
    for record in records:
        labels = record["labels"]
        runs.setdefault((labels["vehicle"], labels["speed"]), []).append(record.get("hunts", False))
    return [
        f"{vehicle} hunts at {3.6 * speed:.0f} km/h in {sum(hunts)} of {len(hunts)} pieces: what "
        "it exceeds there is due to the vehicle, and where a piece begins it need not hunt yet."
        for (vehicle, speed), hunts in runs.items()
        if any(hunts)
    ]


def load_recorded_track(recording: str | Path) -> Track:
    """Return a track with a recording, straight for a CSV; raises InputError: it has none."""
    if str(recording).lower().endswith(".csv"):
        irregular = [{"type": "measured", "file": str(Path(recording).resolve())}]
        data: dict[str, Any] = {"irregularities": irregular}
        Faults(embed_measured(data)).check()
        length = float(data["irregularities"][0]["rows"][-1][0])
        return load_track("straight").replace(
            name=Path(recording).stem, **even_line(length), irregularities=data["irregularities"]
        )
    track = load_track(recording)
    if not any(isinstance(part, Measured) for part in track.irregularities):
        allowed = "an irregularity of the type 'measured'"
        raise input_error(recording, "no recording", allowed, key="irregularities")
    return track


def _length_behind(vehicle: Vehicle) -> float:
    """Distance of the last wheelset or floor point behind the reference body [m]."""
    flat, placed = flatten(vehicle), sensors(vehicle)
    wheelsets = flat.along(flat.of_kind("wheelset"))
    return -min(0.0, *wheelsets, *(placed[point].along for point in POINTS))


def _recorded_extent(track: Track) -> tuple[float, float]:
    """Where the recordings begin and end, on the track or beyond it [m]."""
    found = [p.extent(track.length) for p in track.irregularities if isinstance(p, Measured)]
    return min(a for a, _ in found), max(b for _, b in found)


def _omissions(track: Track) -> list[str]:
    """Remark on what of a recording lies beyond the track and is not judged."""
    (low, high), (begin, end) = _recorded_extent(track), _extent(track)
    if low > begin - 1.0 and high < end + 1.0:
        return []
    return [
        f"The recording goes from s = {low:.0f} to {high:.0f} m, the track from 0 to "
        f"{track.length:.0f} m: what lies beyond it is not judged ('shift' of the irregularity?)."
    ]


def _extent(track: Track) -> tuple[float, float]:
    """Where a recording begins and ends on its track [m]."""
    low, high = _recorded_extent(track)
    begin, end = max(0.0, low), min(track.length, high)
    if end - begin < 2.0 * SECTION:
        found_words, allowed = f"{end - begin:.0f} m", f"{2.0 * SECTION:g} m at least"
        raise input_error(track.name, found_words, allowed, key="irregularities")
    return begin, end


def _part(track: Track, a: float, b: float) -> tuple[Track, float]:
    """Track with the rows between a and b and around them; by how much it begins later [m].

    Of a track that is the same everywhere the part alone, of others the whole plan.
    """
    low, high = a - RUN_IN - BEYOND, b + BEYOND
    uniform = is_uniform(track) and all(isinstance(p, Measured) for p in track.irregularities)
    moved = max(0.0, low) if uniform else 0.0
    parts: list[Any] = []
    for part in track.irregularities:
        if isinstance(part, Measured):
            placed = ((s + part.shift, *values) for s, *values in part.rows or ())
            rows = [(s - moved, *values) for s, *values in placed if low <= s <= high]
            if len(rows) >= 4:
                cut: Any = {"rows": tuple(rows), "shift": 0.0, "mileage": None}
                parts.append(part.model_copy(update=cut))
        else:
            parts.append(part)
    changes: dict[str, Any] = {"irregularities": [p.model_dump(exclude_none=True) for p in parts]}
    changes["mileage"] = float(track.mileage_at(moved))
    if uniform:
        changes |= even_line(high - moved)  # beyond the end of the track too, for the filters
    return track.replace(**changes), moved


# what the runs say --------------------------------------------------------------------------------


def _assessment(
    track: Track, runs: Sequence[_Run], share: float, outcome: Outcome, remarks: Sequence[str]
) -> TrackAssessment:
    begin, end = _extent(track)
    cells, has_mileage = np.arange(begin, end, CELL), bool(track.mileage or track.falling_mileage)
    geometry = RecordedGeometry(track, begin, end)
    shares: dict[tuple[str, float, str], Floats] = {}
    places: list[Place] = []
    unloaded: dict[tuple[str, float], list[float]] = {}
    lifted = np.zeros(len(cells), dtype=np.bool_)
    for case, a, b, moved in runs:
        path = outcome.folder / case.file_name
        if not path.is_file():
            continue
        name = str(case.labels["vehicle"])
        for quantity, location, s, value, limit in _signals(case, open_result(path)):
            s = s + moved
            inside = (s >= a) & (s < b)
            if not inside.any():
                continue
            s, part = s[inside], value[inside] / limit
            row = shares.setdefault((name, case.speed, quantity), np.full(len(cells), np.nan))
            cell = np.minimum(((s - begin) / CELL).astype(int), len(cells) - 1)
            np.fmax.at(row, cell, part)
            if (gaps := np.isnan(part)).any():
                lifted[cell[gaps]] = True
                unloaded.setdefault((name, case.speed), []).append(float(s[gaps][0]))
            for k in _peaks(s, part, share):
                place, magnitude = float(s[k]), float(part[k] * limit)
                km = float(track.mileage_at(place)) if has_mileage else None
                shape = geometry.shape(place)
                places.append(
                    Place(name, case.speed, quantity, location, place, magnitude, limit, shape, km)
                )
    expected = len({(case.labels["vehicle"], case.speed) for case, *_ in runs}) * len(QUANTITIES)
    rows = np.array([*shares.values()]).reshape(-1, len(cells))
    exceeded = np.any(rows > share, axis=0) | lifted
    unknown = ~lifted & (np.isnan(rows).any(axis=0) | (len(shares) < expected))
    lifting = (
        f"{vehicle} lifts a wheel at {3.6 * speed:.0f} km/h, first at s = {min(s):.0f} m: Y/Q has "
        "no value there, and its sections are flagged."
        for (vehicle, speed), s in unloaded.items()
    )
    sections, flagged = geometry.sections(exceeded, unknown, max(case.speed for case, *_ in runs))
    return TrackAssessment(
        outcome.folder, share, tuple(_strongest(places)), cells, shares, sections, flagged,
        outcome.computed, (*remarks, *lifting),
    )  # fmt: skip


def _signals(case: Case, result: Result) -> list[tuple[str, str, Floats, Floats, float]]:
    """Quantity, location, arc length, magnitude and limit of everything that is judged."""
    laws = load_running_limits("en14363").limits
    service = case.vehicle.service
    assert isinstance(service, Service)  # checked before

    def limit(name: str, wheelset: int | None = None, Q0: float = 0.0) -> float:
        situation = Situation(case.vehicle, service, "1", np.inf, wheelset, Q0, laws)
        return float(laws[name].at(situation))

    signals: list[tuple[str, str, Floats, Floats, float]] = []
    load, s = result["Q0"].mean(axis=1), result["wheelset_distance"]
    rate = len(s) / float(result["time"][-1] - result["time"][0])
    window = max(1, round(SLIDING / case.speed * rate))
    Q, Y = (low_passed(result[name], rate, LOW_PASS) for name in "QY")
    quotient = np.where(np.isnan(result["Y_over_Q"]), np.nan, outward_quotient(Y, Q))

    def mean(x: Floats) -> Floats:
        """Sliding mean; nan where a window holds an instant without value."""
        unknown = np.isnan(x)
        known = uniform_filter1d(np.where(unknown, 0.0, x), window)
        return np.where(maximum_filter1d(unknown, window), np.nan, known)

    for w in range(s.shape[1]):
        number = f"wheelset {w + 1}"
        values = []
        for side, word in enumerate(SIDES):
            place = f"{number} {word}"
            values.append(("Q", place, Q[:, w, side]))
            values.append(("Y_over_Q", place, mean(quotient[:, w, side])))
        values.append(("sum_Y", number, np.abs(mean(Y[:, w].sum(axis=-1)))))
        signals += [(n, place, s[:, w], x, limit(n, w, float(load[w]))) for n, place, x in values]
    placed = sensors(case.vehicle)
    for point, axis in product(POINTS, "yz"):
        x = result.series("sensor_acceleration", sensor=point, axis=axis)
        x = in_band(x, rate, RIDE_BAND)  # what is steady in curves has a limit of its own
        name, s = f"body_{axis}", result["distance"] + placed[point].along
        signals.append((name, point, s, np.abs(x), limit(name)))
    return signals


def _peaks(s: Floats, part: Floats, share: float) -> list[int]:
    """Index of the largest value of each stretch beyond the share."""
    beyond = np.flatnonzero(part > share)
    if not len(beyond):
        return []
    groups = np.split(beyond, np.flatnonzero(np.diff(s[beyond]) > APART) + 1)
    return [int(group[np.argmax(part[group])]) for group in groups]


def _strongest(places: Sequence[Place]) -> list[Place]:
    """Of places of one vehicle, speed and quantity that lie together, the one furthest beyond."""
    strongest: list[Place] = []
    by_quantity: dict[tuple[str, float, str], list[float]] = {}
    for place in sorted(places, key=lambda p: -p.value / p.limit):
        others = by_quantity.setdefault((place.vehicle, place.speed, place.quantity), [])
        if all(abs(place.s - s) > APART for s in others):
            others.append(place.s)
            strongest.append(place)
    return strongest
