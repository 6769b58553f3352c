"""Surfaces of wheels that are not round, as the time loop looks them up.

Flats and sections are rolled out: a wheel whose radius over angle and lateral position is r(psi, u)
stands on its rail z_r(y) with its centre at the height

    R(phi, y) = max over psi, u of (r(psi, u) - z_r(y + u)) cos(psi - phi),

and touches r sin(psi - phi) = dR/dphi ahead of the axle.  For a fresh flat of the length l that is
r cos(phi_0 - |phi|), phi_0 = l/(2 r): the centre falls freely at V^2/r, up to the middle, where it
jumps.  Waves and tables, shallow over their length, and worn flats are taken as the path of the
centre itself (Newton, Clark 1979, Journal Mechanical Engineering Science 21; Wu, Thompson 2002,
Journal of Sound and Vibration 251).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from railsim.arrays import Floats
from railsim.contact.curves import RailCurve
from railsim.definitions.vehicle.out_of_round import Flat, Harmonics, RadiusTable, Sections, Uneven
from railsim.kernels.wheel_surface import SURFACE_ROW

TURN = 2.0 * np.pi
NODES = 64  # over a flat or wave
FEWEST, MOST = 1024, 65_536  # nodes over a turn
ROLLED, CONTOUR = 2.5e-4, 2.5e-4  # m, distance of the points that may touch, along and across
ACROSS = np.linspace(-0.020, 0.020, 41)  # m, lateral positions of a wheel with sections
BEYOND, LEAST_WINDOW = 5e-3, 15e-3  # m ahead of and behind half a flat that is searched; at least
SMOOTHING_AROUND = 5e-9  # m3
AROUND = 0.9 * TURN  # angle over which sections go all around
DEEP = 2e-5  # m, change of the radius that makes a flat of a section
SMALL_WAVE = 0.02  # share of the largest amplitude of a table's waves that is not resolved


@dataclass(frozen=True, eq=False)
class Surface:
    """One wheel's height over its angle, see `railsim.kernels.wheel_surface`."""

    values: Floats  # e [m], e_phi [m], e_y [1], e_phi_y [1], shape (n_phi, n_y, 4)
    y: Floats  # lateral positions, shape (n_y,) [m]
    ahead: Floats  # angle to the next flat, shape (n_phi,) [rad]
    flat: float  # length of the shortest flat [m], infinite without
    wave: float  # and of the shortest wave all around


def wheel_surface(parts: Iterable[Uneven], radius: float, rail: RailCurve, tape: float) -> Surface:
    """Return the surface of a wheel with some deviations, which add up.

    `parts`: definitions; `radius`: nominal rolling radius [m]; `rail`: its rail; only sections look
    at it; `tape`: position of the nominal rolling circle from the wheelset's centre [m].
    """
    parts = tuple(parts)
    resolved = [_lengths(part, radius) for part in parts]
    shortest = min(min(lengths) for lengths in resolved)
    n = int(np.clip(np.ceil(NODES * TURN * radius / shortest), FEWEST, MOST))
    phi = np.linspace(0.0, TURN, n, endpoint=False)
    measured = any(isinstance(part, Sections) for part in parts)
    y = ACROSS if measured else np.array([-1.0, 1.0])
    values = np.zeros((n, y.size, 4))
    ahead = np.full(n, TURN)
    for part in parts:
        own = _wrapped(phi - part.angle)
        if isinstance(part, Sections):
            heights, level, (begin, end) = rolled_out(part, radius, rail, tape, n, y)
            values += _with_slopes(heights - level, y)
        else:
            height, slope = _height(part, radius, own)
            values[:, :, 0] += height[:, None]
            values[:, :, 1] += slope[:, None]
            if not isinstance(part, Flat):
                continue
            begin = part.angle - 0.5 * part.length / radius
            end = begin + part.length / radius
        margin = 2.0 * TURN / n
        there = (phi - begin + margin) % TURN
        ahead = np.minimum(ahead, np.where(there < end - begin + 2.0 * margin, 0.0, TURN - there))
    flats, waves = (min(lengths) for lengths in zip(*resolved, strict=True))
    return Surface(values, y, ahead, flats, waves)


def surface_arrays(surfaces: Iterable[Surface]) -> tuple[Floats, Floats, Floats]:
    """Return rows, values and angles to the next flat of several surfaces, see the kernel."""
    rows, values, aheads = [np.zeros((0, SURFACE_ROW))], [np.zeros((0, 4))], [np.zeros(0)]
    first = first_ahead = 0
    for one in surfaces:
        n, n_y = one.values.shape[:2]
        dy = one.y[1] - one.y[0]
        rows.append(np.array([[first, first_ahead, n, n_y, one.y[0], dy, one.flat, one.wave]]))
        values.append(one.values.reshape(-1, 4))
        aheads.append(one.ahead)
        first, first_ahead = first + n * n_y, first_ahead + n
    return np.concatenate(rows), np.concatenate(values), np.concatenate(aheads)


def _wrapped(angle: Floats) -> Floats:
    return np.asarray((angle + np.pi) % TURN - np.pi)


def _lengths(part: Uneven, radius: float) -> tuple[float, float]:
    """Length of a flat, and of the shortest wave all around, that steps resolve [m]."""
    if isinstance(part, Harmonics):
        return np.inf, TURN * radius / max(order for order, _, _ in part.waves)
    if isinstance(part, Flat):
        return part.length, np.inf
    if isinstance(part, RadiusTable):
        phi = np.linspace(0.0, TURN, 4096, endpoint=False)
        waves = np.abs(np.fft.rfft(_height(part, radius, phi)[0]))[1:]
        order = 1 + np.flatnonzero(waves >= SMALL_WAVE * max(waves.max(), 1e-30))[-1]
        return np.inf, TURN * radius / float(order)
    assert isinstance(part, Sections)
    _, begin, end = _deviation(part)
    return max(radius * (end - begin), 0.01), np.inf


def _height(part: Uneven, radius: float, phi: Floats) -> tuple[Floats, Floats]:
    """Height e [m] and e_phi [m] of a part that does not look at the rail."""
    if isinstance(part, Harmonics):
        order, amplitude, phase = np.array(part.waves).T[..., None]
        argument = order * phi + phase
        return (amplitude * np.cos(argument)).sum(axis=0), -(
            order * amplitude * np.sin(argument)
        ).sum(axis=0)
    if isinstance(part, RadiusTable):
        from scipy.interpolate import CubicSpline

        angles, change = np.array(part.rows).T
        closed = np.append(angles, angles[0] + TURN), np.append(change, change[0])
        spline = CubicSpline(*closed, bc_type="periodic")
        return spline(phi), spline(phi, 1)
    assert isinstance(part, Flat)
    half = 0.5 * part.length / radius
    inside = np.abs(phi) < half
    if part.shape == "worn":
        depth, order = part.length**2 / (16.0 * radius), np.pi / half
        height = -0.5 * depth * (1.0 + np.cos(order * phi))
        return np.where(inside, height, 0.0), np.where(
            inside, 0.5 * depth * order * np.sin(order * phi), 0.0
        )
    left = half - np.abs(phi)
    lead = np.sign(phi) * radius * np.sin(left)
    return np.where(inside, radius * (np.cos(left) - 1.0), 0.0), np.where(inside, lead, 0.0)


def _deviation(part: Sections) -> tuple[Floats, float, float]:
    """Heights of the sections less the round wheel's [m], and the angles of its flat.

    The round wheel is the median of all sections, or, of sections that do not go all around, the
    mean of the first and the last.
    """
    assert part.angles is not None
    assert part.heights is not None
    heights, angles = np.array(part.heights), np.array(part.angles)
    around = angles[-1] - angles[0] > AROUND
    round_wheel = np.median(heights, axis=0) if around else 0.5 * (heights[0] + heights[-1])
    change = heights - round_wheel
    deep = np.flatnonzero(np.abs(change).max(axis=1) > DEEP)
    if deep.size == 0:
        return change, float(angles[0]), float(angles[-1])
    widest = max(float(b - a) for a, b in pairwise(angles))
    begin, end = float(angles[deep[0]]), float(angles[deep[-1]])
    lowest = float(angles[np.unravel_index(np.argmin(change), change.shape)[0]])
    if end - begin > 1.0:  # scatter all around: what lies deeper than a tenth of the deepest
        deep = np.flatnonzero(change.min(axis=1) < 0.1 * change.min())
        deep = deep[np.abs(angles[deep] - lowest) < 0.5]
        begin, end = float(angles[deep[0]]), float(angles[deep[-1]])
    return change, begin - widest, end + widest


def rolled_out(
    part: Sections, radius: float, rail: RailCurve, tape: float, n: int, y: Floats
) -> tuple[Floats, Floats, tuple[float, float]]:
    """Height of the centre of a wheel with sections above its rail's top, and of the round one.

    Around the wheel the sections are smoothed as across (`SMOOTHING_AROUND`).

    Returns `heights`, shape (n, y.size): over the angle, from 0 on, and the lateral position [m];
    `level`, shape (y.size,): the same of the round wheel [m]; `extent`: angles of the flat [rad].
    """
    from scipy.interpolate import CubicSpline, make_smoothing_spline

    assert part.angles is not None
    assert part.positions is not None
    assert part.heights is not None
    change, begin, end = _deviation(part)
    angles, places = np.array(part.angles), np.array(part.positions)
    round_wheel = CubicSpline(places, np.array(part.heights)[0] - change[0])
    around = angles[-1] - angles[0] > AROUND
    spline = make_smoothing_spline(1e3 * radius * angles, 1e3 * change, lam=1e9 * SMOOTHING_AROUND)
    fine = np.arange(places[0], places[-1], CONTOUR)
    step = ROLLED / radius
    window = max(0.5 * radius * (end - begin) + BEYOND, LEAST_WINDOW) / radius
    reach = int(np.ceil(window / step))
    middle = 0.5 * (begin + end)
    # all around, or twice the window beside the flat: its contact is within one of the angle
    half = int(np.ceil((np.pi if around else 0.5 * (end - begin) + window) / step)) + reach + 1
    psi = middle + step * np.arange(-half, half + 1)
    own = angles[0] + (psi - angles[0]) % TURN if around else psi
    last = np.clip(own, angles[0], angles[-1])
    deviation = 1e-3 * spline(1e3 * radius * last)
    # between the last section and the first one, a turn later
    share = np.clip((own - last) / max(angles[0] + TURN - angles[-1], 1e-9), 0.0, 1.0)[:, None]
    if around:
        deviation += share * (1e-3 * spline(1e3 * radius * angles[0]) - deviation)
    else:
        deviation[own != last] = 0.0
    surface = CubicSpline(places, deviation, axis=1)(fine)
    base = radius + round_wheel(fine)
    reduced, level = np.empty((psi.size, y.size)), np.empty(y.size)
    for j, aside in enumerate(y):
        clear = base - np.interp(tape + aside + fine, rail.Y, rail.z, left=1.0, right=1.0)
        reduced[:, j] = (surface + clear).max(axis=1)
        level[j] = clear.max()
    inner = slice(reach, psi.size - reach)
    best = reduced[inner].copy()
    for k in range(1, reach + 1):
        fall = np.cos(k * step)
        for shifted in (k, -k):
            at = slice(reach + shifted, psi.size - reach + shifted)
            np.maximum(best, fall * reduced[at], out=best)
    rolled = CubicSpline(psi[inner], best)
    phi = (TURN / n * np.arange(n) - part.angle - middle + np.pi) % TURN - np.pi + middle
    known = (phi >= psi[inner][0]) & (phi <= psi[inner][-1])
    heights = np.where(known[:, None], rolled(np.clip(phi, psi[inner][0], psi[inner][-1])), level)
    reached = window - 0.5 * (end - begin)
    return heights, level, (part.angle + begin - reached, part.angle + end + reached)


def _with_slopes(heights: Floats, y: Floats) -> Floats:
    """Heights over angle and y with e_phi, e_y and e_phi_y."""
    from scipy.interpolate import CubicSpline

    n = heights.shape[0]
    phi = TURN / n * np.arange(n + 1)
    over_phi = CubicSpline(phi, np.concatenate([heights, heights[:1]]), bc_type="periodic")
    over_y = CubicSpline(y, heights, axis=1)(y, 1)
    both = CubicSpline(phi, np.concatenate([over_y, over_y[:1]]), bc_type="periodic")
    return np.stack((heights, over_phi(phi[:-1], 1), over_y, both(phi[:-1], 1)), axis=-1)


def parts_by_wheel(uneven: Mapping[str, Uneven]) -> tuple[tuple[Uneven, ...], tuple[Uneven, ...]]:
    """Return the deviations of the left and of the right wheel."""
    left, right = (
        tuple(part for part in uneven.values() if part.wheel in (side, "both"))
        for side in ("left", "right")
    )
    return left, right
