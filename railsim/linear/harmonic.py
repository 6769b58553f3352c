"""First harmonic of the wheel-rail forces: a linearisation for a finite lateral amplitude.

A wheelset is moved by y = a sin(theta) along the contact path, that is with z and roll such that
the vertical force and the roll moment of its contacts stay as they are.  With F any derivative of
the state, its first harmonic over 24 angles

    H[F] = 1/(pi a) integral F sin(theta) d theta

is what a linear system has to give for a motion of this amplitude (describing function, Krylov and
Bogoliubov 1937; for wheelsets equivalent conicity with the real contact).  As the tangent's columns
of z and roll stay, the column of y becomes

    A_y = H[F] - A_z H[z] - A_roll H[roll],

so that a motion along the path has just these forces, and the tangent is the limit of small a.  In
hunting the yaw rate is in phase with y, the yaw angle and the lateral velocity a quarter ahead or
behind: their columns, the slopes of the creep forces, are the means of 2 sin^2 and 2 cos^2 times
those along the path.  Else the slopes at rest, where the patch of worn or conforming profiles is
larger than beside it, would meet the rolling radii of the path.  The contact feels the motion
against the rails: what changes in the columns of y and its velocity changes in those of elastic
rails by half of the opposite each.
"""

from collections.abc import Sequence

import numpy as np

from railsim.arrays import Floats, Integers
from railsim.errors import ModelError, argument_error
from railsim.kernels.support import RAIL_DOF
from railsim.linear.coordinates import FreeVehicle
from railsim.notation import ROLL, YAW, Y, Z

ANGLES = 24
BALANCED = 1e-2  # N and N m, of a wheelset's vertical force and roll moment
MOST_ITERATIONS = 15
SLOW = 0.1  # ratio of two residuals from which on slopes are formed again
STEP = 1e-8  # m and rad
CREEP = 1e-6  # m/s, rad/s and rad, for slopes of the creep forces


class ContactPath:
    """Wheelsets moved along their contact path by one amplitude [m]."""

    def __init__(self, amplitude: float) -> None:
        self.amplitude = amplitude
        # where the path was found last, and the slopes there: the next speed's are near
        self._known: dict[float, Floats] = {}
        self._slopes: dict[float, Floats] = {}

    def matrix(self, vehicle: FreeVehicle, tangent: Floats) -> Floats:
        """Return the matrix of a linearisation with the columns of y and of creepage replaced.

        `tangent`: its tangent matrix. Raises InputError: the contact table is narrower than the
        amplitude.
        """
        c = vehicle.coordinates
        place, velocity = c.position_of, c.velocity_of
        bodies = vehicle.system.contact.body
        columns = np.array([[place[b, k] for k in (Y, Z, ROLL)] for b in bodies])
        creeping = [
            [of[b, k] for b in bodies] for of, k in ((velocity, YAW), (velocity, Y), (place, YAW))
        ]
        # sin(theta) has the same value at two angles of a quadrant's pair
        sines = np.sin(2.0 * np.pi * (np.arange(ANGLES // 4) + 0.5) / ANGLES)
        sines = np.concatenate([sines, -sines])
        try:
            poses = self._path(vehicle, columns, sines)
            moved = np.tile(vehicle.x, (*poses.shape[:2], 1))
            for w, column in enumerate(columns):  # each alone
                moved[:, w, column] += poses[:, w]
            rates = _rates(vehicle, moved)
            slopes = [_slopes(vehicle, moved, of) for of in creeping]
        except ModelError as error:
            words = f"found {1e3 * self.amplitude:.12g} mm, but {error}"
            raise argument_error("amplitude", words, "a smaller amplitude") from None
        shares = 4.0 * sines / (ANGLES * self.amplitude)
        force, path = (np.tensordot(shares, values, 1) for values in (rates, poses))
        found = tangent.copy()
        for (y, z, roll), rate, (_, height, angle) in zip(columns, force, path, strict=True):
            found[:, y] = rate - tangent[:, z] * height - tangent[:, roll] * angle
        with_y, beside = 4.0 * sines**2 / ANGLES, 4.0 * (1.0 - sines**2) / ANGLES
        for of, share, slope in zip(creeping, (with_y, beside, beside), slopes, strict=True):
            found[:, of] = np.tensordot(share, slope, 1).T
        for w, body in enumerate(bodies):
            rails = np.flatnonzero((c.wheelsets == w) & (c.bodies < 0))
            for own, felt in zip((place, velocity), np.split(rails, 2), strict=True):
                change = found[:, own[body, Y]] - tangent[:, own[body, Y]]
                found[:, felt[:RAIL_DOF:2]] -= 0.5 * change[:, None]
        return found

    def _path(self, vehicle: FreeVehicle, columns: Integers, sines: Floats) -> Floats:
        """Return y, z, roll of the wheelsets on their paths, float64[sine, wheelset, 3]."""
        goal, found = _forces(vehicle, vehicle.x), np.zeros((len(sines), *columns.shape))
        for i, y in enumerate(self.amplitude * sines):
            # from the middle outwards: far from its path a wheelset stands on one rail
            outwards = i % (len(sines) // 2) > 0
            guess = found[i - 1, :, 1:] * (y / found[i - 1, 0, 0]) if outwards else 0.0
            self._known[y] = self._on_path(vehicle, columns, y, self._known.get(y, guess), goal)
            found[i, :, 0], found[i, :, 1:] = y, self._known[y]
        return found

    def _on_path(
        self, vehicle: FreeVehicle, columns: Integers, y: float, guess: Floats | float, goal: Floats
    ) -> Floats:
        """Return z and roll of all wheelsets, moved by y at once: none feels another's rails."""

        def missing(pose: Floats) -> Floats:
            x = vehicle.x
            x[columns] += np.insert(pose, 0, y, axis=1)
            return _forces(vehicle, x) - goal

        pose, before = np.zeros((len(columns), 2)) + guess, np.inf
        for _ in range(MOST_ITERATIONS):
            value = missing(pose)
            size = float(np.max(np.abs(value)))
            if size < BALANCED:
                return pose
            if y not in self._slopes or size > SLOW * before:
                ends = [[missing(pose + d * STEP * e) for d in (1.0, -1.0)] for e in np.eye(2)]
                self._slopes[y] = np.stack([a - b for a, b in ends], axis=2) / (2.0 * STEP)
            try:
                pose = pose - np.linalg.solve(self._slopes[y], value[..., None])[..., 0]
            except np.linalg.LinAlgError:  # a wheelset off its rails has no slopes
                break
            before = size
        raise ModelError("no contact path")


def _rates(vehicle: FreeVehicle, moved: Floats) -> Floats:
    return vehicle.rates(moved.reshape(-1, len(vehicle.x))).reshape(moved.shape)


def _slopes(vehicle: FreeVehicle, moved: Floats, of: Sequence[int]) -> Floats:
    """Derivatives of the rates with respect to a coordinate of each wheelset, as `moved`."""
    step = np.zeros(moved.shape[1:])
    step[np.arange(len(of)), of] = CREEP
    return (_rates(vehicle, moved + step) - _rates(vehicle, moved - step)) / (2.0 * CREEP)


def _forces(vehicle: FreeVehicle, x: Floats) -> Floats:
    """Vertical force and roll moment that the rails give each wheelset, float64[wheelset, 2]."""
    vehicle.rate(x)
    return np.asarray(vehicle.work.rail_force[vehicle.system.contact.body, 2:4])
