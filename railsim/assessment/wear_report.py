"""Wear and fatigue of wheels and rails over a run, wheel by wheel, read part by part."""

from dataclasses import dataclass

import numpy as np

from railsim.arrays import Floats
from railsim.assessment import wear
from railsim.assessment.record import START, Record
from railsim.definitions.vehicle.flatten import flatten
from railsim.notation import SIDES
from railsim.result.filters import StreamingPercentiles

CELL = 0.5  # N, initial bin width for the percentiles of the wear number
PATCHES = ("patch_N", "patch_a", "patch_b", "patch_T_x", "patch_T_y")


@dataclass(frozen=True)
class WheelWear:
    """Wear and fatigue at one wheel.

    `worn_area`: Worn area of the wheel profile per distance by each law, by its name or file, sum
    over the contact patches [m2/m].  Of a result without them that of Pearce and Sherratt is the
    one of `T_gamma`, as if all forces acted in one patch, and the others are None. `rail_damage`:
    Whole Life Rail Model, mean over the distance; by default only forces on the rail against the
    direction of travel count.  With contact patches that of tread, flange root or flange, whichever
    has the largest magnitude: what one part of the rail suffers, another does not repair [1].
    `utilised_friction`, `pressure_ratio`: T/N and p0/k of that patch, its coordinates in the
    shakedown map [1]; None likewise.
    """

    place: str  # wheelset, from 1, and side
    T_gamma: float  # mean wear number over the distance [N]
    percentiles: dict[str, float]  # of the wear number over time [N], by per cent
    bound: float  # largest deviation of a percentile from that of the whole record [N]
    worn_area: dict[str, float | None]
    rail_damage: float
    model: wear.WholeLifeRailModel  # of `rail_damage`
    fatigue_index: float | None  # largest FI_surf [1]; None without contact patches
    utilised_friction: float | None
    pressure_ratio: float | None

    def record(self) -> dict[str, object]:
        """Return it as plain numbers and strings, SI."""
        nested = "worn_area", "model"
        plain = {name: value for name, value in self.__dict__.items() if name not in nested}
        return plain | self.worn_area


def wear_report(record: Record, law: str | None = None) -> list[WheelWear]:
    """Wear and fatigue at all wheels.

    `record`: Run with `T_gamma`, `xi_x`; with `contact_patches` also USFD and the fatigue index.
    `law`: Only this law of `LAWS`, or that of a file, which needs `contact_patches`; by default
    all.
    """
    record.need_quantities("wear")
    laws, model = wear.laws_and_rail_model(law)
    flat = flatten(record.result.vehicle())
    radii = np.array([w.wheelset.radius for w in flat.of_kind("wheelset") if w.wheelset])
    shape = radii.shape
    streams = {wheel: StreamingPercentiles(CELL) for wheel in np.ndindex(shape)}
    mean = np.zeros(shape)
    damage: Floats = np.zeros((*shape, 1))
    # largest index of each wheel, with the coordinates of its patch in the shakedown map
    worst, length = np.full((3, *shape), -np.inf), 0.0
    needed = (*PATCHES, "patch_T_gamma")
    from_file = any(entry.constants for entry in laws.values())
    if from_file:
        record.need((*needed, "patch_friction"), "settings.outputs.contact_patches=true")
    patches = all(name in record.result for name in needed)
    worn = {n: np.zeros(shape) for n in laws if patches or laws[n] is wear.LAWS[wear.DEFAULT_LAW]}
    distances = np.gradient(record.distance)
    for rows, counted in record.pieces(0.0):
        rows = slice(rows.start + counted.start, rows.start + counted.stop)
        T_gamma = record.part("T_gamma", rows)
        ways = distances[rows, None, None]
        mean += np.sum(T_gamma * ways, axis=0)
        length += float(np.sum(ways))
        for (w, k), stream in streams.items():
            stream.add(T_gamma[:, w, k])
        # the force on the rail has the sign of the creepage
        area = np.zeros_like(T_gamma)[..., None]
        load = mu = np.full_like(area, np.nan)
        each, along = T_gamma[..., None], record.part("xi_x", rows)[..., None]
        if patches:
            each, along = (record.result.part(f"patch_{name}", rows) for name in ("T_gamma", "T_x"))
            area, fatigue = _patches(record, rows)
            load = record.result.part("patch_N", rows)
            mu = record.result.part("patch_friction", rows) if from_file else mu
            worst = np.where(fatigue[0] > worst[0], fatigue, worst)
        passes = model.patch_damage(each, along) * ways[..., None]
        damage = damage + np.sum(passes, axis=0)
        speed = (distances / np.gradient(record.time))[rows, None, None, None]
        contacts = wear.Patches(each, area, 2.0 * radii[..., None], load, mu, speed)
        for name in worn:
            lost = laws[name].worn_area(contacts)
            worn[name] += np.sum(lost.sum(axis=-1) * ways, axis=0)
    if not length > 0.0:
        found = f"{record.time[-1] - record.time[0]:.3g} s"
        raise record.too_short(found, f"more than the first {START:g} s, which do not count")
    wheels = []
    for w, k in np.ndindex(shape):
        stream, worst_damage = streams[w, k], np.argmax(np.abs(damage[w, k]))
        wheels.append(
            WheelWear(
                f"wheelset {w + 1} {SIDES[k]}", float(mean[w, k] / length),
                {f"{p:g}": stream.percentile(p) for p in (50.0, 95.0, 99.85)}, stream.width,
                {n: float(worn[n][w, k] / length) if n in worn else None for n in laws},
                float(damage[w, k, worst_damage] / length), model,
                *(worst[:, w, k].tolist() if patches else [None] * 3),
            )
        )  # fmt: skip
    return wheels


def _patches(record: Record, rows: slice) -> tuple[Floats, Floats]:
    """Area of each patch [m2]; largest fatigue index of each wheel, with T/N and p0/k."""
    N, a, b, T_x, T_y = (record.result.part(name, rows) for name in PATCHES)
    loaded = N > 0.0
    safe = np.where(loaded, N, 1.0)
    index = wear.surface_fatigue_index(np.hypot(T_x, T_y), safe, a, b)
    ratio = np.hypot(T_x, T_y) / safe
    # k/p0 is T/N less the index
    pressure = 1.0 / np.where(loaded & (ratio > index), ratio - index, np.inf)
    index = np.where(loaded, index, -np.inf)
    stacked = np.stack([index, ratio, pressure]).transpose(0, 2, 3, 1, 4)
    stacked = stacked.reshape(*stacked.shape[:3], -1)
    largest = np.argmax(stacked[0], axis=-1)[None, ..., None]
    worst = np.take_along_axis(stacked, largest, axis=-1)[..., 0]
    return np.where(loaded, np.pi * a * b, 0.0), worst
