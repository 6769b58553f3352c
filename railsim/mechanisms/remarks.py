"""What is allowed but unusual in the results of a mechanism: rules of thumb, narrow margins."""

from collections.abc import Iterator

import numpy as np

from railsim.definitions.mechanism import parts
from railsim.definitions.mechanism.faults import bounds_remarks
from railsim.definitions.mechanism.values import body_name
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import checks, rod_drop, runs_ahead
from railsim.mechanisms.kinematics import driver_words, solve
from railsim.mechanisms.quantities import force_unit

GAS_PRESSURES = (20e5, 250e5)
"""Usual pressures of gas springs over the outside [Pa] (makers' catalogues; Merci, 2017)."""
NEAR = 0.05
"""Difference of a rod and its crank, as a share of the crank, below which they are nearly equal."""


def remarks(result: Analysis) -> list[str]:
    """Remarks of the file, and on what its results are."""
    kinds = _zone, _forces, _rods, _gas_springs, _lid, _torsion_springs
    own = [remark for kind in kinds for remark in kind(result)]
    bounds = [f"{r.key}: {r.text}" for r in bounds_remarks(result.definition)]
    return [*result.definition.remarks, *own, *bounds]


def _zone(result: Analysis) -> Iterator[str]:
    """Heights that the output reaches more than once."""
    along = "x" if result.model.axis == 0 else "height"
    for name, values in result.zone.items():
        if np.count_nonzero(np.diff(result.output[along] > values[along])) > 1:
            at = driver_words(result.model, values["travel"])
            yield f"the output reaches zone.{name} again; results are those at {at}"


def _forces(result: Analysis) -> Iterator[str]:
    """A hand that has to hold back."""
    definition = result.definition
    hands = parts.HandForce | parts.HandTorque
    if definition.solve is not None and isinstance(definition.held_by, hands):
        hand, least = definition.unknown, runs_ahead(result)
        if least < 0.0:
            held = f"{-least:.2f} {force_unit(hand, definition)}"
            yield f"'{hand}' holds back with up to {held}: the load runs ahead"


def _rods(result: Analysis) -> Iterator[str]:
    """A rod hardly longer than its crank: close to a dead point when they lie on each other."""
    model, joints = result.model, result.definition.joints
    pairs = [joint.revolute for joint in joints.values() if isinstance(joint, parts.Revolute)]
    fixed = [pair for pair in pairs if "ground" in map(body_name, pair)]
    pivots = {body_name(p): p for pair in fixed for p in pair if body_name(p) != "ground"}
    guides = [joint.prismatic for joint in joints.values() if isinstance(joint, parts.Prismatic)]
    slides = {body_name(point) for pair in guides for point in pair}
    for name, joint in joints.items():
        if not isinstance(joint, parts.Link):
            continue
        for end, other in (joint.link, joint.link[::-1]):
            if body_name(end) not in pivots or body_name(other) not in slides:
                continue
            motion = solve(model, [model.start])
            d = motion.point(end)[0] - motion.point(pivots[body_name(end)])[0]
            crank, rod = float(np.hypot(*d[0])), float(model.number(joint.length))
            if abs(rod - crank) < NEAR * crank:
                longer = f"{abs(rod - crank) * 1e3:.3f} mm {'longer' if rod > crank else 'shorter'}"
                yield (
                    f"rod '{name}' is only {longer} than its crank of {crank * 1e3:.3f} mm: close "
                    "to a dead point, sensitive to every tolerance"
                )


def _gas_springs(result: Analysis) -> Iterator[str]:
    low, high = GAS_PRESSURES
    for name, part in result.definition.elements.items():
        if not isinstance(part, parts.GasSpring):
            continue
        if f"{name}_pressure" in result.output:
            pressure = result.extremes(f"{name}_pressure")
            if pressure.least < low or pressure.most > high:
                yield (
                    f"gas pressure of '{name}' {pressure.least / 1e5:.1f} to "
                    f"{pressure.most / 1e5:.1f} bar, usual {low / 1e5:g} to {high / 1e5:g} bar"
                )
        if part.rod_end is None and (drop := rod_drop(result, name)):
            lower = part.gas_spring[0] if drop > 0.0 else part.gas_spring[1]
            yield f"'{name}' belongs with its rod at {lower}, the lower end when compressed"


def _torsion_springs(result: Analysis) -> Iterator[str]:
    """Torsion springs wound by more than half a turn, maybe by a turn too many in [start]."""
    motion = result.motion
    for name, part in result.definition.elements.items():
        if isinstance(part, parts.TorsionSpring) and part.free_angle is not None:
            first, second = (motion.q[:, result.model.bodies[b], 2] for b in part.torsion_spring)
            most = float(np.max(np.abs(first - second - result.model.number(part.free_angle))))
            if most > np.pi:
                turned = f"torsion spring '{name}' is wound by up to {np.degrees(most):.1f} deg"
                yield f"{turned}: angles are counted from those in [start] and [driver]"


def _lid(result: Analysis) -> Iterator[str]:
    """The makers' rule of thumb for lids."""
    for check in checks(result):
        if check.sense == "about":
            yield (
                f"makers' rule of thumb for lids, G D/(b n) 9.8 alpha: F1 of "
                f"'{check.name.removeprefix('lid_')}' {check.limit:.1f} N; here {check.value:.1f} N"
            )
