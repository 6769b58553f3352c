"""Preloads of the suspension, with which a vehicle stands in its nominal position."""

import hashlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from railsim.arrays import Flags, Floats
from railsim.definitions.vehicle.flatten import FlatElement
from railsim.errors import ModelError
from railsim.kernels.alignment import aligned_copy
from railsim.kernels.element_columns import FRICTION, ONE_SIDED
from railsim.kernels.system import AXLEBOX, RIGID, Links, Mounts, System
from railsim.model.assembly import Model
from railsim.notation import COMPONENTS

UNBALANCED = 1e-6  # share of the weight that may stay unbalanced by preloads (round-off)
# condition (1-norm) up to which a matrix is inverted, in a third of the time of least squares
WELL_CONDITIONED = 1e10
MOST_KEPT = 100  # vehicles
# preloads of links and mounts that this process has solved, by all that they follow from: neither
# speed, friction nor track are part of it, so that the runs of a study share them
_KEPT: dict[bytes, tuple[Floats, Floats]] = {}


def with_preloads(model: Model) -> Model:
    """Return the model with every `auto` preload solved.

    Unknowns are the vertical force of each mount and the force of each link so marked; conditions
    the vertical force, roll and pitch moment of each rigid body and the pitch moment of each
    axlebox, with the preloads given by the user and gravity as loads.  What only presses, and would
    have to pull, carries nothing.

    A load case takes the preloads of the design load: its bodies find their heights, rolls and
    pitches themselves.  So does a vehicle with springs of known free length: their preloads are
    given, and what they leave unbalanced moves the bodies.

    Raises ModelError: the springs cannot carry the vehicle.
    """
    key = _key(model)
    if key not in _KEPT:
        system = _solve_preloads(model).system
        if len(_KEPT) >= MOST_KEPT:
            _KEPT.clear()
        _KEPT[key] = system.links.spring[:, 2].copy(), system.mounts.preload.copy()
    return with_these_preloads(model, *_KEPT[key])


def _key(model: Model) -> bytes:
    """Hash of all that the preloads of a model follow from."""
    system, index = model.system, model.index
    bodies, links, mounts = system.bodies, system.links, system.mounts
    facts = []
    for e in model.flat.elements:
        law = e.definition
        preload = law.given_preload, law.vertical_stiffness, law.has_free_length
        facts.append((e.name, e.body1, e.body2, *preload, law.has_levelling))
    names = index.bodies, index.links, index.mounts
    digest = hashlib.sha256(repr((names, facts, system.gravity)).encode())
    arrays = *bodies, system.frame_offset, links.body, links.row, mounts.body, mounts.row
    for array in map(np.asarray, arrays):
        digest.update(repr(array.shape).encode())
        digest.update(array.tobytes())
    if model.design is not None:
        digest.update(_key(model.design))
    return digest.digest()


def _solve_preloads(model: Model) -> Model:
    """Solve every `auto` preload, see `with_preloads`."""
    if model.design is not None:
        design = with_preloads(model.design).system
        preloads = design.links.spring[:, 2], design.mounts.preload
        return _levelled_model(with_these_preloads(model, *preloads))
    free_lengths = any(e.definition.has_free_length for e in model.flat.elements)
    filled, unbalanced = _balance(model, _auto_preloads(model), given=free_lengths)
    if not unbalanced:
        return _with_pressing_wedges(filled)
    raise ModelError(
        f"no static equilibrium of '{model.flat.name}': the springs with preload cannot carry the "
        "vehicle in its nominal position; unbalanced: " + "; ".join(unbalanced)
    )


def _balance(
    model: Model, support: dict[int, float], *, given: bool = False
) -> tuple[Model, list[str]]:
    """Return the model with the preloads of `support`, and what they leave unbalanced.

    Springs carry the weight of a fixed body where they can.  `given`: others follow from their
    lengths, and what they leave moves the bodies.
    """
    conditions = _conditions(model.system)
    weights = [(int(body), 2) for body in model.system.bodies.fixed]
    for equations in [[*conditions, *weights], conditions] if weights else [conditions]:
        filled, rest = _with_solved_preloads(model, support, equations)
        unbalanced = [] if given else _unbalanced_forces(model, equations, rest)
        if not unbalanced:
            break
    return filled, unbalanced


def _with_pressing_wedges(model: Model) -> Model:
    """Return the model; raises ModelError: wedges would have to pull, the wrong way round."""
    force = dict(zip(model.index.mounts, model.system.mounts.preload[:, 2], strict=True))
    wedges = [e for e in model.flat.elements if e.definition.MUST_PRESS]
    least = {e.name: 1.0 if e.definition.preload_is_free else 0.0 for e in wedges}
    if wrong := [name for name, needed in least.items() if force[name] < needed]:
        raise ModelError(
            f"no static equilibrium of '{model.flat.name}': wedges press and never pull, these "
            f"would have to pull in the nominal position: {', '.join(wrong)}; body 1 of a wedge is "
            "the side frame, body 2 the bolster that rests on it"
        )
    return model


def static_shares(model: Model, *, solved: bool = False) -> dict[str, float]:
    """Compression of all springs that carry weight at rest in the nominal position, by name [N].

    As `with_preloads`, of a load case with its own weights (what given preloads leave of them moves
    the bodies), and of springs with known lengths as if their preloads were to be found; a given
    preload counts as it is.  Positive where the spring pushes its bodies apart.  With `solved` the
    model's preloads are taken as they are.

    Raises ModelError: the springs cannot carry the vehicle, or wedges would have to pull.
    """
    support = _auto_preloads(model, known_lengths=True)
    filled = model
    if not solved:
        filled, unbalanced = _balance(model, support, given=model.design is not None)
        if unbalanced and not len(model.system.bodies.fixed):
            raise ModelError(
                "the springs cannot carry the vehicle in its nominal position; unbalanced: "
                + "; ".join(unbalanced)
            )
        _with_pressing_wedges(filled)
    flat = {element.name: element for element in model.flat.elements}
    names, forces = _names(model), _forces(filled.system)
    shares = {}
    for k in support:
        # a link pulls; the body below a mount is pushed down by what stands on it
        below = k >= len(model.index.links) and _is_below(model, flat[names[k]])
        shares[names[k]] = float(forces[k]) if below else -float(forces[k])
    return shares


def _is_below(model: Model, element: FlatElement) -> bool:
    """Whether body 1 of an element carries body 2."""
    if element.point1[2] != element.point2[2]:
        return element.point1[2] > element.point2[2]
    one, two = model.flat.body(element.body1), model.flat.body(element.body2)
    # a frame may have its centre of gravity below the axles on which it stands
    if (one.kind == "body") != (two.kind == "body"):
        return two.kind == "body"
    return one.position[2] >= two.position[2]


def _levelled_model(model: Model) -> Model:
    """Fill the air springs of a load case so that what stands on them alone keeps its height.

    A levelling valve feeds or drains a bellows until it has its nominal height over the body below.
    """
    carried = _carried_by_levelled_springs(model)
    if not carried:
        return model
    levelled = {e.name for e in model.flat.elements if e.definition.has_levelling}
    names = _names(model)
    support = {k: stiff for k, stiff in _auto_preloads(model).items() if names[k] in levelled}
    conditions = [pair for pair in _conditions(model.system) if pair[0] in carried]
    return _with_solved_preloads(model, support, conditions)[0]


def _carried_by_levelled_springs(model: Model) -> set[int]:
    """Bodies that stand on springs with levelling valves and on nothing else."""
    on: dict[str, list[bool]] = {}
    for element in model.flat.elements:
        law = element.definition
        if law.vertical_stiffness > 0.0 and law.given_preload != 0.0:
            for body in (element.body1, element.body2):
                on.setdefault(body, []).append(law.has_levelling)
    return {model.index.bodies.index(name) for name, kinds in on.items() if all(kinds)}


def _with_solved_preloads(
    model: Model, support: dict[int, float], conditions: list[tuple[int, int]]
) -> tuple[Model, Floats]:
    """Solve the preloads of `support` for `conditions`; the model with them, and what is left.

    What only presses does not pull: it carries nothing, and the others are solved without it.
    """
    system, support = model.system, dict(support)
    weights = system.bodies.mass * system.gravity
    loads = np.array([weights[body] if axis == 2 else 0.0 for body, axis in conditions])
    unit_links, unit_mounts = _copies(system)
    unit_links.spring[:, 2] = 1.0
    unit_mounts.preload[:] = 0.0, 0.0, 1.0
    unit = system._replace(links=unit_links, mounts=unit_mounts)
    columns = {k: _preload_forces(unit, [k], conditions) for k in support}
    forces = _forces(system)
    presses = np.concatenate([np.zeros(len(unit_links.body), bool), _presses(unit_mounts)])
    while True:
        unknowns = list(support)
        forces[unknowns] = 0.0
        fixed = _preload_forces(_with_forces(system, forces), range(len(forces)), conditions)
        matrix = np.array([columns[k] for k in unknowns]).T.reshape(len(conditions), len(unknowns))
        # equal deflection where the conditions leave a choice: unknowns scaled by sqrt(stiffness)
        scale = np.sqrt(np.array([support[k] for k in unknowns]))
        right_side = -(loads + fixed)
        values = least_squares(matrix * scale, right_side, 1e-10) * scale
        forces[unknowns] = values
        pulling = [k for k in unknowns if presses[k] and forces[k] < 0.0]
        if not pulling:
            return replace(model, system=_with_forces(system, forces)), matrix @ values - right_side
        for k in pulling:
            forces[k] = 0.0
            del support[k]


def _presses(mounts: Mounts) -> Flags:
    """Which mounts are pads or wedges, whose spring and damper never pull."""
    return np.asarray(mounts.flags[:, FRICTION] == ONE_SIDED)


def nominal_forces(mounts: Mounts) -> Floats:
    """Preloads of mounts as they act: of a pad with clearance none, shape (mount, 3) [N]."""
    forces = np.array(mounts.preload)
    presses = _presses(mounts)
    forces[presses, 2] = np.maximum(forces[presses, 2], 0.0)
    return forces


def _names(model: Model) -> tuple[str, ...]:
    """Elements that may have a preload: links, then mounts; in this order they are numbered."""
    return model.index.links + model.index.mounts


def _forces(system: System) -> Floats:
    """Tensions of links, then vertical forces of mounts on their first bodies [N]."""
    return np.concatenate([system.links.spring[:, 2], system.mounts.preload[:, 2]])


def _with_forces(system: System, forces: Floats) -> System:
    """Return the system with these forces."""
    links, mounts = _copies(system)
    links.spring[:, 2], mounts.preload[:, 2] = np.split(forces, [len(links.body)])
    return system._replace(links=links, mounts=mounts)


def _copies(system: System) -> tuple[Links, Mounts]:
    """Links and mounts whose preloads may be changed."""
    links = system.links._replace(row=aligned_copy(system.links.row))
    return links, system.mounts._replace(row=aligned_copy(system.mounts.row))


def with_these_preloads(model: Model, tension: Floats, preload: Floats) -> Model:
    """Return the model with these preloads of its links and mounts."""
    links, mounts = _copies(model.system)
    links.spring[:, 2] = tension
    mounts.preload[:] = np.reshape(preload, mounts.preload.shape)  # there may be none
    return replace(model, system=model.system._replace(links=links, mounts=mounts))


def least_squares(matrix: Floats, right_side: Floats, rcond: float) -> Floats:
    """Return the least-squares solution of least size."""
    if not (np.isfinite(matrix).all() and np.isfinite(right_side).all()):
        raise ModelError("no static equilibrium: masses, forces or stiffnesses are implausible")
    if len(matrix) == matrix.shape[1]:
        with suppress(np.linalg.LinAlgError):
            inverse = np.linalg.inv(matrix)
            if np.linalg.norm(matrix, 1) * np.linalg.norm(inverse, 1) < WELL_CONDITIONED:
                return np.asarray(inverse @ right_side)
    solution, *_ = np.linalg.lstsq(matrix, right_side, rcond=rcond)
    return np.asarray(solution, dtype=float)


def _auto_preloads(model: Model, *, known_lengths: bool = False) -> dict[int, float]:
    """Elements whose preload is to be found, with the stiffness by which they share the weight.

    With `known_lengths` also those whose preload follows from their lengths.
    """
    laws = {element.name: element.definition for element in model.flat.elements}
    auto = {
        name: law.vertical_stiffness
        for name, law in laws.items()
        if law.preload_is_free or (known_lengths and law.has_free_length)
    }
    return {k: auto[name] for k, name in enumerate(_names(model)) if auto.get(name, 0.0) > 0.0}


def _conditions(system: System) -> list[tuple[int, int]]:
    """(body, component) of every equation: z, roll, pitch of rigid bodies, pitch of axleboxes."""
    components = {RIGID: (2, 3, 4), AXLEBOX: (4,)}
    kinds = enumerate(system.bodies.kind.tolist())
    return [(body, axis) for body, kind in kinds for axis in components.get(kind, ())]


def _preload_forces(
    system: System, elements: Iterable[int], conditions: list[tuple[int, int]]
) -> Floats:
    """Forces and moments of the preloads of some elements in the nominal position."""
    links, mounts, forces = system.links, system.mounts, nominal_forces(system.mounts)
    totals = np.zeros((len(system.bodies.kind), 6))
    for k in elements:
        e = k - len(links.body)
        if e < 0:
            (i, j), (one, two) = links.body[k], links.point[k]
            direction = _nominal(system, j, two) - _nominal(system, i, one)
            force = links.spring[k, 2] * direction / np.linalg.norm(direction)
        else:
            (i, j), (one, two), force = mounts.body[e], mounts.point[e], forces[e]
        _add(totals, i, one, force)
        _add(totals, j, two, -force)
    return np.array([totals[body, component] for body, component in conditions])


def _nominal(system: System, body: int, lever: Floats) -> Floats:
    frame = system.frame_offset[system.bodies.frame[body]]
    centre = body if system.bodies.kind[body] != AXLEBOX else system.bodies.parent[body]
    y, z = system.bodies.nominal[centre]
    return np.array([frame, y, z]) + lever


def _add(totals: Floats, body: int, lever: Floats, force: Floats) -> None:
    (x, y, z), (fx, fy, fz) = lever.tolist(), force.tolist()
    # written out: numpy's cross product of three numbers each takes 60 us
    totals[body] += fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx


def _unbalanced_forces(model: Model, conditions: list[tuple[int, int]], rest: Floats) -> list[str]:
    """What the preloads leave of forces and moments, in words."""
    weight = float(np.sum(model.system.bodies.mass)) * model.system.gravity
    return [
        f"{model.index.bodies[body]}: {COMPONENTS[k]} {value:.6g} {'N' if k < 3 else 'N m'}"
        for (body, k), value in zip(conditions, rest, strict=True)
        if abs(value) > UNBALANCED * weight
    ]
