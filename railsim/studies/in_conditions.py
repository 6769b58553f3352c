"""What a test campaign does to vehicle and track: conditions, independent seeds, track quality."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from pydantic import ValidationError

from railsim.assessment.conditions import SHARE
from railsim.assessment.record import START
from railsim.assessment.sections import TestSection, track_sections
from railsim.assessment.track_quality import TrackQuality
from railsim.cant import curve_speed
from railsim.definitions import Track, Vehicle
from railsim.definitions.excitations.random import Random
from railsim.definitions.limits import RunningLimits
from railsim.definitions.study.scenario import Speed, TestCondition
from railsim.definitions.track.elements import Circle
from railsim.definitions.vehicle.flatten import flatten
from railsim.definitions.vehicle.tables import Service
from railsim.errors import Fault, InputError, input_error
from railsim.result.sensors import sensors
from railsim.studies.case import Case

MOST = 20  # seeds of a part
SEEDS = 100  # between those of two conditions
LATERAL, VERTICAL = ("lateral", "gauge"), ("vertical", "cross_level")


def in_condition(vehicle: Vehicle, name: str, condition: TestCondition) -> Vehicle | None:
    """Return the vehicle in a condition; None where its file has nothing of the kind.

    Load and assignments have been made when it was loaded.

    Raises InputError: what is removed does not exist; a wrong vehicle without it.
    """
    data = vehicle.model_dump(mode="json", exclude_none=True)
    if condition.wheels and not _exchange(data, condition.wheels):
        return None
    for key in condition.remove:
        *path, last = key.split(".")
        table = data
        for part in path:
            table = table.get(part, {})
        if last not in table:
            allowed = "a key of the vehicle's file"
            raise input_error(f"conditions.{name}", key, allowed, key="remove")
        del table[last]
    data.setdefault("service", {}).update(condition=name.replace("_", " "), fault=condition.fault)
    try:
        return Vehicle.model_validate(data)
    except ValidationError as error:
        faults = [Fault(f"conditions.{name}", ".".join(map(str, e["loc"])), e["msg"], "")
                  for e in error.errors()]  # fmt: skip
        raise InputError(faults) from None


def _exchange(node: Any, wheels: dict[str, str]) -> bool:
    """Exchange wheel profiles in a vehicle's tables; tell whether there was one."""
    if not isinstance(node, dict):
        return False
    found = False
    for name, table in node.items():
        if name != "wheelsets":
            found = _exchange(table, wheels) or found
            continue
        for wheelset in table.values():
            pair = wheelset["profile"]
            names = [pair] if isinstance(pair, str) else list(pair)
            found = found or any(profile in wheels for profile in names)
            wheelset["profile"] = [wheels.get(profile, profile) for profile in names]
    return found


def scaled_radii(track: Track, speed: Speed, service: Service) -> Track:
    """Track whose radii give the cant deficiency asked for at the speed asked for."""
    if speed.admissible is None or speed.cant_deficiency is None:
        return track
    deficiency = speed.cant_deficiency * service.cant_deficiency
    as_drawn = curve_speed(speed.radius or 0.0, speed.cant + deficiency)
    factor = (speed.admissible * service.admissible_speed / as_drawn) ** 2
    plan = [
        element.model_copy(update={"radius": factor * element.radius})
        if isinstance(element, Circle)
        else element
        for element in track.plan
    ]
    return track.model_copy(update={"plan": tuple(plan)})


def repeated(case: Case, limits: RunningLimits, service: Service, condition: int) -> list[Case]:
    """Return a run with as many seeds as its zone needs sections, each to the target quality.

    `case`: run on track with one random irregularity; others are returned as they are; `condition`:
    number of the condition, which has its own seeds.
    """
    parts = case.track.irregularities
    if len(parts) != 1 or not isinstance(parts[0], Random):
        return [case]
    found: list[Case] = []
    counted = 0
    for number in range(MOST):
        seed = parts[0].seed + SEEDS * condition + 10 * number
        part = parts[0].model_copy(update={"seed": seed})
        track = case.track.model_copy(update={"irregularities": (part,)})
        sections = counting_sections(track, case, limits, service)
        label = f"{case.name}_seed{seed}"
        scaled = to_target(track, part, sections, limits, service)
        labels = {**case.labels, "seed": seed}
        found.append(replace(case, name=label, track=scaled, labels=labels))
        counted += len(sections)
        if not sections or counted >= limits.zones[sections[0].zone].sections:
            break
    return found


def counting_sections(
    track: Track, case: Case, limits: RunningLimits, service: Service
) -> list[TestSection]:
    """Sections that count, of the zone with most of them, at constant speed."""
    vehicle = case.vehicle
    x = [b.position[0] for b in flatten(vehicle).of_kind("wheelset")]
    x += [sensor.offset + sensor.arm[0] for sensor in sensors(vehicle).values()]
    ahead, behind = max(0.0, *x), min(0.0, *x)
    begin = case.start + max(START * case.speed, ahead - behind) + ahead
    end = (case.until or track.length) + behind - 1.0
    constant: Callable[[float], float] = partial(_constant, case.speed)
    sections = track_sections(track, limits, service, (begin, end), constant)
    counting = [section for section in sections if section.zone and not section.reason]
    by_zone = [[s for s in counting if s.zone == zone] for zone in limits.zones]
    return max(by_zone, key=len)


def _constant(speed: float, _: float) -> float:
    return speed


def to_target(
    track: Track,
    part: Random,
    sections: Sequence[TestSection],
    limits: RunningLimits,
    service: Service,
) -> Track:
    """Track whose 90 % values of alignment and level are in the middle of the target."""
    target = limits.track_quality
    if not sections or target is None:
        return track
    quality = TrackQuality(track, sections[0].begin, sections[-1].end)
    found = np.percentile([quality.deviations(s.begin, s.end) for s in sections], SHARE, axis=0)
    wanted = np.array(target.middle(min(sections[0].speed, service.admissible_speed)))
    scales = part.scale * wanted / found
    parts = tuple(
        part.model_copy(update={"channels": channels, "scale": round(float(scale), 4)})
        for channels, scale in zip((LATERAL, VERTICAL), scales, strict=True)
    )
    return track.model_copy(update={"irregularities": parts})
