"""First harmonic of the wheel-rail forces: a linearisation for a finite lateral amplitude.

A wheelset is moved by y = a sin(theta) along the contact path, that is with z and roll such that
the vertical force and the roll moment of its contacts stay as they are.  With F any derivative of
the state, its first harmonic over 24 angles

    H[F] = 1/(pi a) integral F sin(theta) d theta

is what a linear system has to give for a motion of this amplitude (describing function, Krylov and
Bogoliubov 1937; for wheelsets equivalent conicity with the real contact).  As the tangent's columns
of z and roll stay, the column of y becomes

    A_y = H[F] - A_z H[z] - A_roll H[roll],

so that a motion along the path has just these forces, and the tangent is the limit of small a.
"""

import numpy as np

from railsim.arrays import Floats
from railsim.errors import ModelError, argument_error
from railsim.linear.coordinates import FreeVehicle
from railsim.notation import ROLL, Y, Z

ANGLES = 24
BALANCED = 1e-2  # N and N m, of a wheelset's vertical force and roll moment
MOST_ITERATIONS = 15
SLOW = 0.1  # ratio of two residuals from which on slopes are formed again
STEP = 1e-8  # m and rad


class ContactPath:
    """Wheelsets moved along their contact path by one amplitude [m]."""

    def __init__(self, amplitude: float) -> None:
        self.amplitude = amplitude
        # where the path was found last, and the slopes there: the next speed's are near
        self._known: dict[tuple[int, float], Floats] = {}
        self._slopes: dict[tuple[int, float], Floats] = {}

    def matrix(self, vehicle: FreeVehicle, tangent: Floats) -> Floats:
        """Return the matrix of a linearisation with the columns of y replaced.

        `tangent`: its tangent matrix. Raises InputError: the contact table is narrower than the
        amplitude.
        """
        found = tangent.copy()
        vehicle.rate(vehicle.x)
        goals = vehicle.work.rail_force[:, [2, 3]].copy()
        for body in vehicle.system.contact.body:
            y, z, roll = (vehicle.coordinates.position_of[int(body), k] for k in (Y, Z, ROLL))
            force, height, angle = self._harmonics(vehicle, int(body), goals[body])
            found[:, y] = force - tangent[:, z] * height - tangent[:, roll] * angle
        return found

    def _harmonics(
        self, vehicle: FreeVehicle, body: int, goal: Floats
    ) -> tuple[Floats, float, float]:
        """H of the derivative, of z and of roll; `goal`: force and moment that the rails give."""
        total = np.zeros(len(vehicle.x))
        moved = np.zeros(2)
        for side in (1.0, -1.0):
            pose = np.zeros(2)
            before = 0.0
            # sin(theta) has the same value at two angles of a quadrant's pair
            for sine in np.sin(2.0 * np.pi * (np.arange(ANGLES // 4) + 0.5) / ANGLES):
                y = side * self.amplitude * sine
                # from the middle outwards: far from its path a wheelset stands on one rail
                guess = self._known.get((body, y), pose * (y / before if before else 0.0))
                try:
                    rate, pose = self._on_path(vehicle, body, y, guess, goal)
                except ModelError as error:
                    words = f"found {1e3 * self.amplitude:g} mm, but {error}"
                    raise argument_error("amplitude", words, "a smaller amplitude") from None
                self._known[body, y] = pose
                before = y
                share = 4.0 * side * sine / (ANGLES * self.amplitude)
                total += share * rate
                moved += share * pose
        return total, float(moved[0]), float(moved[1])

    def _on_path(
        self, vehicle: FreeVehicle, body: int, y: float, pose: Floats, goal: Floats
    ) -> tuple[Floats, Floats]:
        """Derivative with a wheelset moved by y along its path, and its dz and droll."""
        indices = [vehicle.coordinates.position_of[body, k] for k in (Y, Z, ROLL)]
        base = vehicle.x

        def tried(pose: Floats) -> tuple[Floats, Floats]:
            x = base.copy()
            x[indices] += (y, *pose)
            return vehicle.rate(x), np.asarray(vehicle.work.rail_force[body, [2, 3]] - goal)

        before = np.inf
        for _ in range(MOST_ITERATIONS):
            rate, value = tried(pose)
            size = np.max(np.abs(value))
            if size < BALANCED:
                break
            if (body, y) not in self._slopes or size > SLOW * before:
                ends = [[tried(pose + d * STEP * e)[1] for d in (1.0, -1.0)] for e in np.eye(2)]
                self._slopes[body, y] = np.transpose([a - b for a, b in ends]) / (2.0 * STEP)
            try:
                pose, before = pose - np.linalg.solve(self._slopes[body, y], value), size
            except np.linalg.LinAlgError:  # a wheelset off its rails has no slopes
                raise ModelError("no contact path") from None
        else:
            raise ModelError("no contact path")
        return rate, pose
