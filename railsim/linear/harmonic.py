"""First harmonic of the wheel-rail forces: a linearisation for a finite lateral amplitude.

Every wheelset is moved as in hunting, with theta = omega t

    y = Re(Y e^(i theta))     yaw = Re(P e^(i theta))

and the velocities of this motion, along the contact path: with z, roll and spin rate such that the
vertical force, the roll moment and the torque about the axle of its contacts stay as they are.
(The mean of both rolling radii changes with y.  The spin follows in less than 1 ms; held, the
wheels would creep along by what at low friction uses up most of it.)  With F any derivative of the
state, its first harmonic over 16 angles

    H[F] = 1/pi integral F e^(-i theta) d theta

is what a linear system has to give for this motion (describing function, Krylov and Bogoliubov
1937; for wheelsets equivalent conicity with the real contact).  The tangent's columns of z, roll
and spin stay.  Those of yaw, yaw rate and lateral velocity, the slopes of the creep forces, are
their means along the path: the slopes at rest, where the patch of worn or conforming profiles is
larger than beside it, would meet the rolling radii of the path.  What is left of H[F] is in phase
with y the column of y, and a quarter beside it is added to that of the lateral velocity: a motion
along the path has just these forces, and the tangent is the limit of small amplitudes.

omega and P/Y of every wheelset are those of a hunting mode of the linearisation itself, found by
iteration (harmonic balance): on the yaw rate, and on the lateral creepage of trailing wheelsets
above all, depends how near to saturation the creep forces are.  The larger one of |Y| and
V |P|/omega is the amplitude, for every wheelset: axles of one frame yaw alike, and the one that
creeps across moves less.  On the path y' is 0 and the yaw P - i omega Y/V, with the same lateral
creepage: flanges are not pressed by a velocity that z and roll do not follow.  P is i omega Y/V for
wheelsets that take no part.  Where no such motion is found, and in curves where a wheel runs on its
flange, the torque about whose axle has no balance nearby, wheelsets are moved across as slowly as
if at rest, without yaw and with their spin held, and a remark says so.

The contact feels the motion against the rails: what changes in the columns of y and its velocity
changes in those of elastic rails by half of the opposite each.
"""

from contextlib import suppress

import numpy as np

from railsim.arrays import Complexes, Floats, Integers
from railsim.errors import ModelError, argument_error
from railsim.kernels.contact_columns import ANGLE_SIN, NORMAL
from railsim.kernels.state import SPEED
from railsim.kernels.support import RAIL_DOF
from railsim.linear.coordinates import FreeVehicle
from railsim.linear.eigenmodes import SEARCHED, SLOWEST
from railsim.notation import PITCH, ROLL, YAW, Y, Z

ANGLES = 16
FEWER = 2  # every second one is enough for the means of slopes
BALANCED = 1e-2  # N and N m, of a wheelset's vertical force, roll moment and axle torque
MOST_ITERATIONS = 100
SLOW = 0.3  # ratio of two residuals from which on slopes are formed again
STEPS = np.array([1e-8, 1e-8, 1e-5])  # m, rad and rad/s
LONGEST = np.array([2e-4, 4e-4, 4e-3])  # first step: m, rad, parts of the spin rate
SHORTER = 0.95  # ratio of the longest steps of two iterations: those across a kink end
CREEP = 1e-6  # m/s, rad/s and rad, for slopes of the creep forces
SAME = 1e-2  # change of a motion in parts of the amplitude, below which it is that of the mode
FLANGE = 0.25  # sine of the contact angle from which a wheel runs on its flange
AT_REST = 1.0  # rad/s, of wheelsets that move across and do nothing else
MOST_MOTIONS = 30
OVERSHOOTS = 3  # motions after which only a part of a change follows
ALIKE = 0.7  # ratio of two modes' marks of hunting above which their damping decides
LEAST_MARK = 0.02  # of a mode that is hunting
NO_PART = 1e-6  # of the largest motion across in a mode
LEAST = 0.3  # part of the amplitude by which a wheelset moves across at least


class ContactPath:
    """Wheelsets moved along their contact path by one amplitude [m]."""

    def __init__(self, amplitude: float) -> None:
        self.amplitude = amplitude
        self.aside: list[float] = []  # speeds at which no hunting was found [m/s]
        # where the path was found last, and the slopes there: the next motion's are near
        self._known: dict[tuple[int, int], Floats] = {}
        self._slopes: dict[tuple[int, int], Floats] = {}

    def matrix(self, vehicle: FreeVehicle, tangent: Floats) -> Floats:
        """Return the matrix of a linearisation with the columns of y and of creepage replaced.

        `tangent`: its tangent matrix. Raises InputError: the contact table is narrower than the
        amplitude.
        """
        with suppress(ModelError):
            found = None if _on_flange(vehicle) else self._balanced(vehicle, tangent)
            if found is not None:
                return found
        turning = np.full(len(vehicle.system.contact.body), 1j * AT_REST)
        try:
            found = self._about(vehicle, tangent, AT_REST, turning, follow=2)
            self.aside.append(float(vehicle.state[SPEED]))
            return found
        except ModelError as error:
            words = f"found {1e3 * self.amplitude:.12g} mm, but {error}"
            raise argument_error("amplitude", words, "a smaller amplitude") from None

    @property
    def remarks(self) -> tuple[str, ...]:
        """At which speeds no hunting was found, in words."""
        if not self.aside:
            return ()
        return (
            f"no hunting of {1e3 * self.amplitude:.4g} mm was found to linearise about at "
            f"{min(self.aside):.4g} to {max(self.aside):.4g} m/s; there wheelsets are moved across "
            "without yaw, which at friction 0.2 and less is up to 24 % off in a critical speed",
        )

    def _balanced(self, vehicle: FreeVehicle, tangent: Floats) -> Floats | None:
        """The matrix in whose hunting mode wheelsets move as in what it is about, if found."""
        motion, shape = _hunting(vehicle, tangent, None)
        for number in range(1, MOST_MOTIONS + 1):
            found = self._about(vehicle, tangent, float(motion[0].real), motion[1:])
            after, shape = _hunting(vehicle, found, shape)
            change = np.abs(after - motion)
            change[1:] *= np.abs(shape[1]) / np.max(np.abs(shape[1]))
            if np.max(change) < SAME * after[0].real:
                return found
            motion = motion + (after - motion) * min(1.0, OVERSHOOTS / number)
        return None

    def _about(
        self,
        vehicle: FreeVehicle,
        tangent: Floats,
        omega: float,
        turning: Complexes,
        follow: int = 3,
    ) -> Floats:
        """The matrix for a motion of the wheelsets; of z, roll, spin rate so many follow."""
        c, speed = vehicle.coordinates, float(vehicle.state[SPEED])
        place, velocity = c.position_of, c.velocity_of
        bodies = vehicle.system.contact.body
        moving = np.array([[place[b, Y], place[b, YAW], velocity[b, YAW]] for b in bodies])
        led = np.array([[place[b, Z], place[b, ROLL], velocity[b, PITCH]] for b in bodies])
        led = led[:, :follow]
        turns = np.exp(2j * np.pi * (np.arange(ANGLES) + 0.5) / ANGLES)
        y = self.amplitude / np.maximum(1.0, np.abs(turning) / omega)
        yaw = y * np.stack([turning - 1j * omega, 1j * omega * turning]) / speed
        moves = np.stack([y, *yaw], axis=1)
        given = (turns[:, None, None] * moves).real
        poses = self._path(vehicle, moving, led, given)
        moved = np.tile(vehicle.x, (ANGLES, len(bodies), 1))
        for w, (columns, others) in enumerate(zip(moving, led, strict=True)):  # each alone
            moved[:, w, columns] += given[:, w]
            moved[:, w, others] += poses[:, w]
        share = 2.0 / ANGLES * turns.conj()
        force, path = (np.tensordot(share, v, 1) for v in (_rates(vehicle, moved), poses))
        found = tangent.copy()
        sideways = np.array([velocity[b, Y] for b in bodies])
        for columns in (sideways, *moving.T[1:]):
            found[:, columns] = _slopes(vehicle, moved[::FEWER], columns).mean(axis=0).T
        for w, (columns, others) in enumerate(zip(moving, led, strict=True)):
            left = force[w] - tangent[:, others] @ path[w] - found[:, columns[1:]] @ moves[w, 1:]
            left /= moves[w, 0]
            found[:, columns[0]] = left.real
            found[:, sideways[w]] += left.imag / omega
            rails = np.flatnonzero((c.wheelsets == w) & (c.bodies < 0))
            for own, felt in zip((columns[0], sideways[w]), np.split(rails, 2), strict=True):
                change = found[:, own] - tangent[:, own]
                found[:, felt[:RAIL_DOF:2]] -= 0.5 * change[:, None]
        return found

    def _path(self, vehicle: FreeVehicle, moving: Integers, led: Integers, given: Floats) -> Floats:
        """Return what is `led` of the wheelsets on their paths, float64[angle, wheelset, led].

        All move at once: none feels another's rails.
        """
        goal, found = _forces(vehicle, vehicle.x), np.zeros((len(given), *led.shape))
        across, near = given[:, 0, 0], {True: (1.0, found[0]), False: (1.0, found[0])}
        # from the middle outwards: far from its path a wheelset stands on one rail
        for i in np.argsort(np.abs(across), kind="stable").tolist():
            x, (y, pose) = vehicle.x, near[across[i] > 0.0]
            x[moving] += given[i]
            guess = self._known.get((i, led.shape[1]), pose * (across[i] / y))
            found[i] = self._known[i, led.shape[1]] = self._on_path(vehicle, x, led, i, guess, goal)
            near[across[i] > 0.0] = across[i], found[i]
        return found

    def _on_path(
        self, vehicle: FreeVehicle, x: Floats, led: Integers, angle: int, pose: Floats, goal: Floats
    ) -> Floats:
        """Return the same at one angle."""
        n, size = led.shape
        longest = LONGEST[:size] * np.ones((n, size))
        longest[:, 2:] *= np.abs(x[led[:, 2:]])

        def missing(pose: Floats) -> Floats:
            trial = x.copy()
            trial[led] += pose
            return (_forces(vehicle, trial) - goal)[:, :size]

        before, place = np.inf, (angle, size)
        for number in range(MOST_ITERATIONS):
            value = missing(pose)
            left = float(np.max(np.abs(value)))
            if left < BALANCED:
                return pose
            if place not in self._slopes or left > SLOW * before:
                ends = [[missing(pose + d * e) for d in (1.0, -1.0)] for e in np.diag(STEPS[:size])]
                slopes = np.stack([a - b for a, b in ends], axis=2) / (2.0 * STEPS[:size])
                # without friction no torque, off its rails a wheelset has no slopes at all
                self._slopes[place] = np.asarray(np.linalg.pinv(slopes, rcond=1e-12), float)
            step = (self._slopes[place] @ value[..., None])[..., 0]
            excess = np.abs(step) / (longest * SHORTER**number)
            excess[:, :2] = excess[:, :2].max(axis=1, keepdims=True)
            pose = pose - step / np.maximum(1.0, excess)
            before = left
        raise ModelError("no height and roll of a wheelset so far aside balance its forces")


def _hunting(
    vehicle: FreeVehicle, matrix: Floats, before: Complexes | None
) -> tuple[Complexes, Complexes]:
    """Return omega and, of each wheelset, V P/Y in hunting, by a matrix [1/s], and its shape.

    Of all modes that have most of what marks it, wheelsets that move across most of all bodies and
    roll as they do so, with a yaw angle of y'/V, it is the least damped one, or the most like the
    shape `before`.  |V P/Y| is omega / `LEAST` at most.  Where nothing hunts, such as without
    friction, wheelsets roll by 1 rad/m.
    """
    place, linear = vehicle.coordinates.position_of, vehicle.linearisation(matrix)
    bodies, speed = vehicle.system.contact.body, linear.parameter
    values, shapes = np.linalg.eig(linear.matrix)
    hertz = values.imag / (2.0 * np.pi)
    inside = np.flatnonzero((hertz > SLOWEST) & (np.abs(values) < 2.0 * np.pi * SEARCHED[1]))
    values, shapes = values[inside], shapes.T[inside]
    y, yaw = (shapes[:, [place[b, k] for b in bodies]] for k in (Y, YAW))
    rolling, turned = 1j * values.imag[:, None] * y, speed * yaw
    most = np.abs(shapes[:, vehicle.coordinates.positions]).max(axis=1)
    creeps, both = np.linalg.norm([rolling - turned, np.abs(rolling) + np.abs(turned)], axis=2)
    marks = (1.0 - creeps / np.maximum(both, np.finfo(float).tiny)) * np.abs(y).max(axis=1) / most
    highest = np.max(marks, initial=0.0)
    if highest < LEAST_MARK:
        n = len(bodies)
        return np.array([speed, *[1j * speed] * n]), np.ones((2, n), complex)
    inside = np.flatnonzero(marks >= ALIKE * highest)
    omega, y, turned = values.imag[inside, None], y[inside], turned[inside]
    # by rounding, wheelsets of another bogie under a held car
    still = np.abs(y) < NO_PART * np.abs(y).max(axis=1, keepdims=True)
    turning = np.where(still, 1j * omega, turned / np.where(still, 1.0, y))
    turning /= np.maximum(1.0, LEAST / omega * np.abs(turning))
    motions = np.hstack([omega, turning])
    rank = -values.real[inside] / np.abs(values[inside])
    forms = np.stack([turned, 1j * omega * y], axis=1)
    if before is not None:
        rank = -_likeness(forms, before)
    k = np.argmin(rank)
    return motions[k], forms[k]


def _likeness(shapes: Complexes, other: Complexes) -> Floats:
    """Modal assurance criterion of shapes, complex[..., 2, wheelset], 1 at most."""
    size = np.sum(np.abs(shapes) ** 2, axis=(-2, -1)) * np.sum(np.abs(other) ** 2)
    return np.asarray(np.abs(np.tensordot(shapes, other.conj(), 2)) ** 2 / size)


def _on_flange(vehicle: FreeVehicle) -> bool:
    """Whether a wheel runs on its flange in steady rolling."""
    patch = vehicle.work.patch
    patch[NORMAL] = 0.0  # of patches that are no longer there
    vehicle.evaluate(vehicle.state)
    return bool(np.any((patch[NORMAL] > 0.0) & (np.abs(patch[ANGLE_SIN]) > FLANGE)))


def _rates(vehicle: FreeVehicle, moved: Floats) -> Floats:
    return vehicle.rates(moved.reshape(-1, len(vehicle.x))).reshape(moved.shape)


def _slopes(vehicle: FreeVehicle, moved: Floats, of: Integers) -> Floats:
    """Derivatives of the rates with respect to a coordinate of each wheelset, as `moved`."""
    step = np.zeros(moved.shape[1:])
    step[np.arange(len(of)), of] = CREEP
    return (_rates(vehicle, moved + step) - _rates(vehicle, moved - step)) / (2.0 * CREEP)


def _forces(vehicle: FreeVehicle, x: Floats) -> Floats:
    """Vertical force, roll moment, axle torque from the rails, float64[wheelset, 3]."""
    vehicle.rate(x)
    return np.asarray(vehicle.work.rail_force[vehicle.system.contact.body, 2:5])
