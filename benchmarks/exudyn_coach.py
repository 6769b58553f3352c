"""The Manchester coach in Exudyn: seven rigid bodies, the same suspension and contact.

What differs from railsim's coach, which is given the same simplification for the comparison: no
series stiffnesses (Exudyn's spring-dampers have no internal state).  Bodies are Exudyn's rigid
bodies in absolute coordinates, springs and dampers its compiled connectors (`RigidBodySpringDamper`
for bushings, shear springs at mid-height with their bending, roll bars; `SpringDamper` for dampers
and rods); contact, bump stops and the drive that keeps the car body at V t come from one compiled
user function, called once an evaluation.  The car body is held by a spring of 10 MN/m instead of
exactly.
"""

import time
from typing import Any, NamedTuple

import exudyn
import exudyn.itemInterface as items
import numpy as np
from exudyn_contact import OUTPUT, forces_of

from railsim.definitions.loading import load_vehicle
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.vehicle.definition import Vehicle
from railsim.definitions.vehicle.flatten import flatten
from railsim.kernels.status import RUNNING
from railsim.model.work import work_arrays
from railsim.simulation import prepare

GRAVITY = 9.81
TO_EXUDYN = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
NO_SERIES = (
    "assemblies.bogie.elements.secondary_lateral_damper.series_stiffness=0.0",
    "assemblies.bogie.elements.secondary_vertical_damper.series_stiffness=0.0",
    "assemblies.bogie.elements.traction_rod.series_stiffness=0.0",
    "assemblies.bogie.assemblies.axle.elements.primary.series_stiffness=[0.0, 0.0, 0.0]",
    "assemblies.bogie.assemblies.axle.elements.primary_vertical_damper.series_stiffness=0.0",
)


def simplified_coach() -> Vehicle:
    """The Manchester coach without series stiffnesses."""
    return load_vehicle("coach_manchester", NO_SERIES)


class Stops(NamedTuple):
    """Bump stops: bodies int64[k, 2], points float64[k, 2, 3] in Exudyn's axes, force table."""

    body: np.ndarray
    point: np.ndarray
    table: np.ndarray


class Records(NamedTuple):
    """Output: number of rows, Q and Y, yaw."""

    count: np.ndarray
    wheel: np.ndarray
    yaw: np.ndarray


class ExudynCoach:
    """The coach on a track, ready to be solved once."""

    def __init__(self, track: Track, speed: float, until: float) -> None:
        vehicle = simplified_coach()
        prepared = prepare(vehicle, track, Settings(), speed, until=until)
        self.duration = until / speed
        self.speed = speed
        self.Q0 = prepared.balance.Q0
        self.names = list(prepared.model.index.bodies)
        system = prepared.model.system
        self._model = system, work_arrays(system)
        self._flat = flatten(vehicle)
        rows = round(self.duration / OUTPUT) + 1
        wheelsets = len(prepared.model.index.wheelsets)
        self.records = Records(
            np.zeros(1), np.zeros((rows, wheelsets, 2, 2)), np.zeros((rows, wheelsets))
        )
        self._container = exudyn.SystemContainer()
        self.mbs = self._container.AddSystem()
        self._add_bodies(prepared.balance.state)
        elements = self._flat.elements
        stops = [element for element in elements if element.definition.kind == "bump_stop"]
        for element in elements:
            if element.definition.kind != "bump_stop":
                self._add_element(element)
        self._add_user_forces(stops, system)
        self.mbs.Assemble()

    def _add_bodies(self, state: np.ndarray) -> None:
        n = len(self.names)
        self._nodes, self._bodies, reference = [], [], []
        for b, name in enumerate(self.names):
            body = self._flat.body(name)
            i_x, i_y, i_z = body.inertia
            position = TO_EXUDYN @ np.array(body.position)
            displacement = TO_EXUDYN @ state[6 * b : 6 * b + 3]
            roll, pitch, yaw = state[6 * b + 3 : 6 * b + 6]
            if body.kind == "wheelset":
                pitch = 0.0
            rates = state[6 * (n + b) : 6 * (n + b) + 6]
            velocity = TO_EXUDYN @ (rates[:3] + np.array([self.speed, 0.0, 0.0]))
            turning = TO_EXUDYN @ rates[3:]
            node = self.mbs.AddNode(
                items.NodeRigidBodyRxyz(
                    referenceCoordinates=[*position, 0.0, 0.0, 0.0],
                    initialCoordinates=[*displacement, roll, -yaw, pitch],
                    initialVelocities=[*velocity, *turning],
                )
            )
            self._nodes.append(node)
            reference += [*position, 0.0, 0.0, 0.0]
            self._bodies.append(
                self.mbs.AddObject(
                    items.ObjectRigidBody(
                        mass=body.mass, inertia=[i_x, i_z, i_y, 0.0, 0.0, 0.0], nodeNumber=node
                    )
                )
            )
            mass_marker = self.mbs.AddMarker(items.MarkerBodyMass(bodyNumber=self._bodies[-1]))
            self.mbs.AddLoad(
                items.LoadMassProportional(
                    markerNumber=mass_marker, loadVector=[0.0, -GRAVITY, 0.0]
                )
            )
        self._reference = np.array(reference)

    def _marker(self, name: str, point: np.ndarray) -> int:
        b = self.names.index(name)
        local = TO_EXUDYN @ (point - np.array(self._flat.body(name).position))
        return int(
            self.mbs.AddMarker(
                items.MarkerBodyRigid(bodyNumber=self._bodies[b], localPosition=list(local))
            )
        )

    def _add_element(self, element: Any) -> None:
        definition = element.definition
        first, second = np.array(element.point1), np.array(element.point2)
        if definition.kind == "spring_damper":
            self.mbs.AddObject(
                items.SpringDamper(
                    markerNumbers=[
                        self._marker(element.body1, first),
                        self._marker(element.body2, second),
                    ],
                    referenceLength=float(np.linalg.norm(second - first)),
                    stiffness=definition.stiffness,
                    damping=definition.damping,
                )
            )
            return
        middle = 0.5 * (first + second)
        stiffness, damping, offset = np.zeros(6), np.zeros(6), np.zeros(6)
        if definition.kind == "roll_bar":
            stiffness[3] = definition.stiffness
        else:
            k_x, k_y, k_z = definition.stiffness
            stiffness[:3] = k_x, k_z, k_y
            d_x, d_y, d_z = definition.damping
            damping[:3] = d_x, d_z, d_y
            offset[1] = self._static_load(element) / k_z
        if definition.kind == "shear_spring":
            stiffness[3], stiffness[5] = definition.bending_stiffness
        self.mbs.AddObject(
            items.RigidBodySpringDamper(
                markerNumbers=[
                    self._marker(element.body1, middle),
                    self._marker(element.body2, middle),
                ],
                stiffness=np.diag(stiffness),
                damping=np.diag(damping),
                offset=list(offset),
                # action and reaction on one line; not for axes that would spin with a wheelset
                useIntrinsicFormulation=definition.kind == "shear_spring",
            )
        )

    def _static_load(self, element: Any) -> float:
        """Load that the second body puts on the first one, negative for a wheelset's reaction."""
        car = self._flat.body("carbody").mass
        if element.body2 == "carbody":
            return GRAVITY * car / 4.0
        frame = self._flat.body(element.body1).mass
        return -GRAVITY * (car / 8.0 + frame / 4.0)

    def _add_user_forces(self, elements: list[Any], system: Any) -> None:
        bodies = np.array(
            [[self.names.index(e.body1), self.names.index(e.body2)] for e in elements]
        )
        points = np.array(
            [
                [
                    TO_EXUDYN @ (np.array(point) - np.array(self._flat.body(name).position))
                    for name, point in ((e.body1, e.point1), (e.body2, e.point2))
                ]
                for e in elements
            ]
        )
        stops = Stops(bodies, points, np.array(elements[0].definition.table, dtype=float))
        n = len(self.names)
        state = np.zeros(12 * n + len(system.internal.kind) + 3)
        state[-1] = self.speed
        scratch = (state, np.zeros((n, 3, 3)), np.zeros((n, 3, 3)), np.zeros((3, 3)))
        forces = np.zeros(6 * n)
        model, reference, records = self._model, self._reference, self.records
        self.evaluations = 0

        def user_forces(mbs, t, number, q, q_t):
            self.evaluations += 1
            status = forces_of(
                model, stops, reference, t, np.asarray(q), np.asarray(q_t), forces, scratch, records
            )
            if status != RUNNING:
                raise ValueError(f"status {status} at t = {t}")
            return forces

        # compile before the clock runs
        forces_of(
            model, stops, reference, 0.0, np.zeros(6 * n), np.zeros(6 * n), forces, scratch, records
        )
        records.count[0] = 0
        zero = np.zeros((6 * n, 6 * n))
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=self._nodes, massMatrix=zero, forceUserFunction=user_forces
            )
        )

    def solve(self, method: str, step: float, spectral_radius: float = 0.8) -> dict[str, Any]:
        """Integrate with one of Exudyn's solvers at a constant step [s]."""
        settings = exudyn.SimulationSettings()
        settings.timeIntegration.numberOfSteps = round(self.duration / step)
        settings.timeIntegration.endTime = self.duration
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.automaticStepSize = False
        settings.timeIntegration.adaptiveStep = False
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsStoreAndWriteFiles = False
        settings.parallel.numberOfThreads = 1
        settings.linearSolverType = exudyn.LinearSolverType.EXUdense
        settings.timeIntegration.explicitIntegration.useLieGroupIntegration = False
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.newton.relativeTolerance = 1e-6
        settings.timeIntegration.newton.absoluteTolerance = 1e-6
        settings.timeIntegration.newton.maxIterations = 30
        settings.timeIntegration.generalizedAlpha.spectralRadius = spectral_radius
        begin = time.process_time()
        try:
            self.mbs.SolveDynamic(
                settings,
                solverType=getattr(exudyn.DynamicSolverType, method),
                updateInitialValues=False,
            )
            complete = bool(self.records.count[0] >= len(self.records.yaw) - 1)
        except (SystemError, ValueError, RuntimeError) as error:
            print(error)
            complete = False
        cpu = time.process_time() - begin
        rows = int(self.records.count[0])
        Q, Y = self.records.wheel[:rows, ..., 0], self.records.wheel[:rows, ..., 1]
        return {
            "method": method,
            "step": step,
            "cpu": cpu,
            "evaluations": self.evaluations,
            "real_time": self.duration / cpu,
            "success": complete and bool(np.all(np.isfinite(Q))),
            "outputs": {
                "time": OUTPUT * np.arange(rows),
                "distance": self.speed * OUTPUT * np.arange(rows),
                "Q": Q,
                "Y": Y,
                "dQ_over_Q0": (Q - self.Q0) / self.Q0,
                "wheelset_yaw": self.records.yaw[:rows],
            },
        }
