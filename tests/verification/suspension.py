"""A vehicle file's suspension, written anew from `docs/theory/elements.md`: its modes at rest.

Parts are placed and mirrored from the file itself; elements are their energies, differentiated by
complex steps; friction sticks on its springs.  Wheelsets are held, so that of an axlebox its pitch
is left; or, without axleboxes, they roll along the track and follow the level of the rails.
"""

import numpy as np

GRAVITY = 9.81
STEP = 1e-30  # of the complex step, m and rad
DIFFERENCE = 1e-5  # m and rad
STANDING = ("shear_spring", "airspring")  # in the middle between both bodies, in the axes of both
COMPONENTS = ("x", "y", "z", "roll", "pitch", "yaw")


def placed(group, origin=(0.0, 0.0, 0.0), along=1.0, prefix="", scopes=()):
    """Yield kind, name, table and scopes of all parts, points in the vehicle's axes."""
    scopes = (prefix, *scopes)
    for kind in ("bodies", "wheelsets", "axleboxes", "elements"):
        for name, table in group.get(kind, {}).items():
            both = table.get("sides") == "both"
            if table.get("kind") == "centre_plate":
                yield from placed(
                    {"elements": pads(name, table)}, origin, along, prefix, scopes[1:]
                )
                continue
            for side, sign in ((".right", 1.0), (".left", -1.0)) if both else (("", 1.0),):
                one = table.get("point", table.get("position", (0.0, 0.0, 0.0)))
                points = np.array(table.get("points", [one])) * [along, sign, 1.0]
                yield kind, prefix + name + side, {**table, "at": points + origin}, scopes
    for assembly in group.get("assemblies", {}).values():
        for place in assembly["placements"]:
            moved = np.array(place["position"]) * [along, 1.0, 1.0] + origin
            turned = along * (-1.0 if place["mirror"] else 1.0)
            yield from placed(assembly, moved, turned, prefix + place["name"] + ".", scopes)


def pads(name, plate):
    """Pads of a centre plate: Gauss's rule of two radii with the weight r dr, four at each."""
    inner, outer = plate.get("inner_radius", 0.0), plate["radius"]
    m0, m1, m2, m3 = ((outer**k - inner**k) / k for k in (2, 3, 4, 5))
    linear, constant = np.linalg.solve([[m1, m0], [m2, m1]], [-m2, -m3])
    radii = np.roots([1.0, linear, constant])
    shares = np.linalg.solve([[1.0, 1.0], radii], [m0, m1]) / m0 / 4.0
    found = {}
    for i, (radius, share) in enumerate(zip(radii, shares, strict=True)):
        for j, angle in enumerate(0.25 * np.pi * (i + np.arange(0, 8, 2))):
            place = radius * np.array([np.cos(angle), np.sin(angle), 0.0]) + plate["point"]
            scaled = {k: share * plate[k] for k in ("stiffness", "damping", "stick_stiffness")}
            found[f"{name}{i}{j}"] = {**plate, "kind": "side_bearer", "point": place, **scaled}
    return found


def slope(table):
    """Slope at rest of a table from 0 on; without a table 0."""
    return table[1][1] / table[1][0] if table else 0.0


def turn(axis, angle):
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.zeros((*np.shape(angle), 3, 3), complex)
    matrix[..., axis, axis] = 1.0
    matrix[..., i, i] = matrix[..., j, j] = np.cos(angle)
    matrix[..., j, i] = np.sin(angle)
    matrix[..., i, j] = -np.sin(angle)
    return matrix


class Element:
    """Springs and dampers between two bodies, with the coordinates of both as one vector."""

    def __init__(self, table, ends):
        self.table, self.kind, self.ends = table, table["kind"], ends
        given = table.get("preload")
        self.load = given if isinstance(given, float) else 0.0  # vertical preload [N]
        points = table["at"]
        if self.kind in STANDING:
            points = np.mean(points, axis=0, keepdims=True)
        self.points = points if self.kind == "spring_damper" else points[[-1, -1]]

    def poses(self, q):
        for k, (_, table) in enumerate(self.ends):
            x = q[..., 6 * k : 6 * k + 6]
            R = turn(2, x[..., 5]) @ turn(0, x[..., 3]) @ turn(1, x[..., 4])
            centre = table["at"][0]
            yield centre + x[..., :3] + R @ (self.points[k] - centre), R

    def deflections(self, q):
        """Deflections of its springs and dampers; of a roll bar the angles alone."""
        (P1, R1), (P2, R2) = self.poses(q)
        gap, R = P2 - P1, R1.swapaxes(-1, -2) @ R2
        if self.kind == "spring_damper":
            nominal = np.linalg.norm(self.points[1] - self.points[0])
            return [np.sqrt(np.sum(gap**2, axis=-1))[..., None] - nominal], R
        axes = (R1, R2) if self.kind in STANDING else (R1,)
        return [np.einsum("...ji,...j", frame, gap) for frame in axes], R

    def stiffnesses(self):
        """Along and about the axes."""
        t = self.table
        if self.kind == "roll_bar":
            return np.zeros(3), np.array([t["stiffness"], 0.0, 0.0])
        if self.kind == "airspring":
            along = np.array([*t["horizontal_stiffness"], t["area_stiffness"]])
            return along, np.array([0.0, 0.0, t["torsional_stiffness"]])
        about = t.get("rotational_stiffness", np.zeros(3))
        if self.kind == "shear_spring":
            about = [*t["bending_stiffness"], t["torsional_stiffness"]]
        return self.spring() + self.sticking(), np.asarray(about)

    def spring(self):
        """Stiffness along the axes without friction."""
        upright = [0.0, 0.0, 1.0] if self.kind == "side_bearer" else 1.0
        along = np.atleast_1d(self.table["stiffness"]) * upright
        return along + slope(self.table.get("spring_table"))

    def sticking(self):
        """Stiffness of its friction along the axes."""
        k = self.table.get("stick_stiffness", 0.0)
        return np.array({"side_bearer": [k, k, 0.0], "wedge": np.append(0.0, k)}.get(self.kind, k))

    def vertical_stiffness(self):
        t, along = self.table, self.stiffnesses()[0][-1] - np.atleast_1d(self.sticking())[-1]
        if self.kind == "airspring":
            k1, k2 = t["bellows_stiffness"], t["reservoir_stiffness"]
            return along + k1 * k2 / (k1 + k2)
        return along

    def energy(self, q):
        frames, R = self.deflections(q)
        along, about = self.stiffnesses()
        total = sum(
            0.5 * np.sum(along * d**2, axis=-1) + self.load * d[..., -1] for d in frames
        ) / len(frames)
        spread = 0.5 * np.sum(about) - about
        return total + np.sum(spread) - np.einsum("i,...ii", spread, R)

    def pull(self, q):
        """Its forces on the coordinates at rest in `q`, of stops too."""
        varied = q + 1j * STEP * np.eye(12)
        if self.kind != "bump_stop":
            return -self.energy(varied).imag / STEP
        d = self.deflections(varied)[0][0][:, "xyz".index(self.table["axis"])]
        rows = np.array(self.table["table"])
        force = np.sign(d[0].real) * np.interp(np.abs(d[0].real), *rows.T)
        return -force * d.imag / STEP

    def hessian(self):
        q = np.zeros((2, 12, 12, 12), complex)
        steps = np.arange(12)
        q[0, steps, :, steps] += DIFFERENCE
        q[1, steps, :, steps] -= DIFFERENCE
        q[:, :, steps, steps] += 1j * STEP
        slope = self.energy(q).imag / STEP
        return (slope[0] - slope[1]) / (2.0 * DIFFERENCE)

    def rates(self):
        """How all deflections and angles change with the coordinates."""
        frames, R = self.deflections(1j * STEP * np.eye(12))
        angles = np.stack([R[:, 2, 1], R[:, 0, 2], R[:, 1, 0]], axis=-1)
        return np.mean(frames, axis=0).imag.T / STEP, angles.imag.T / STEP

    def dampers(self):
        """Rows over the coordinates, damping, stiffness in series (0: none)."""
        t = self.table
        along, about = self.rates()
        if self.kind == "roll_bar":
            return [(about[0], t["damping"], 0.0)]
        if self.kind == "airspring":
            return [(along[k], t["horizontal_damping"][k], 0.0) for k in (0, 1)]
        damping = np.atleast_1d(t["damping"]) + slope(t.get("damper_table"))
        if self.kind == "side_bearer":
            along = along[2:]
        series = np.atleast_1d(t.get("series_stiffness", 0.0))
        rows = list(zip(along, damping, np.broadcast_to(series, damping.shape), strict=True))
        turned = zip(about, t.get("rotational_damping", np.zeros(3)), strict=True)
        return rows + [(row, c, 0.0) for row, c in turned]


class Suspension:
    """All bodies and elements of a file; `matrix` is that of its state."""

    def __init__(self, file, *, rolling=False):
        parts = list(placed(file))
        bodies = {name: (kind, table) for kind, name, table, _ in parts if kind != "elements"}
        self.free, self.mass, weight, upright = [], [], [], []
        entries = {
            "bodies": COMPONENTS,
            "axleboxes": ("pitch",),
            "wheelsets": ("x", "z") if rolling else (),
        }
        for name, (kind, t) in bodies.items():
            for c in entries[kind]:
                self.free.append((name, c))
                inertia = t.get("inertia", [0.0, t.get("pitch_inertia"), 0.0])
                mass = (*[t.get("mass")] * 3, *inertia)[COMPONENTS.index(c)]
                if kind == "wheelsets" and c == "x":  # it turns as it rolls
                    mass += inertia[1] / t["radius"][0] ** 2
                self.mass.append(mass)
                weight.append(GRAVITY * t["mass"] if c == "z" else 0.0)
                upright.append(c in ("z", "roll", "pitch") and kind != "wheelsets")
        self.at = {name: table["at"][0] for name, (_, table) in bodies.items()}
        self.wheelsets = sorted(
            (name for name, (kind, _) in bodies.items() if kind == "wheelsets"),
            key=lambda name: -self.at[name][0],
        )
        self.elements, self.stops = [], []  # those that modes find within their clearances
        for kind, name, table, scopes in parts:
            if kind == "elements":
                side = name[name.rfind(".") :]
                ends = [
                    next(s + n + e for s in scopes for e in (side, "") if s + n + e in bodies)
                    for n in table["bodies"]
                ]
                group = self.stops if table["kind"] == "bump_stop" else self.elements
                group.append(Element(table, [(n, bodies[n][1]) for n in ends]))
        self.bodies = {name: table for name, (_, table) in bodies.items()}
        self._carry(np.array(weight), np.array(upright))

    def spread(self, element):
        """Matrix from the vehicle's coordinates to those of an element."""
        found = np.zeros((12, len(self.free)))
        for k, (name, _) in enumerate(element.ends):
            for c, coordinate in enumerate(COMPONENTS):
                if (name, coordinate) in self.free:
                    found[6 * k + c, self.free.index((name, coordinate))] = 1.0
        return found

    def _carry(self, weight, upright):
        """Preloads that balance the weights with the least sum of F^2/k, beside those given."""
        for e in self.elements:
            weight = weight - e.load * (e.rates()[0][-1] @ self.spread(e)) * upright
        carrying = [e for e in self.elements if e.table.get("preload") == "auto"]
        carrying = [e for e in carrying if e.vertical_stiffness() > 0.0]
        lift = np.array([e.rates()[0][-1] @ self.spread(e) for e in carrying]).T[upright]
        root = np.sqrt([e.vertical_stiffness() for e in carrying])
        loads = root * np.linalg.lstsq(lift * root, weight[upright], rcond=1e-12)[0]
        assert np.allclose(lift @ loads, weight[upright], atol=1e-6)
        for element, load in zip(carrying, loads, strict=True):
            element.load = load

    def matrix(self):
        n = len(self.free)
        stiffness, damping, inner = np.zeros((n, n)), np.zeros((n, n)), []
        for e in self.elements:
            wide = self.spread(e)
            stiffness += wide.T @ e.hessian() @ wide
            for row, c, series in e.dampers():
                row = row @ wide
                if series > 0.0 and c > 0.0:  # F' = k (v - F/c)
                    inner.append((row, np.zeros(n), series * row, -series / c))
                else:
                    damping += c * np.outer(row, row)
            if e.kind == "airspring":  # c w' = k1 (z - w) - k2 w, force k1 (z - w)
                k1, k2 = e.table["bellows_stiffness"], e.table["reservoir_stiffness"]
                c, z = e.table["orifice_damping"], e.rates()[0][2] @ wide
                stiffness += k1 * np.outer(z, z)
                inner.append((-k1 * z, k1 / c * z, np.zeros(n), -(k1 + k2) / c))
        mass, m = np.array(self.mass)[:, None], len(inner)
        A = np.zeros((2 * n + m, 2 * n + m))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -stiffness / mass, -damping / mass
        for k, (force, of_position, of_rate, decay) in enumerate(inner, start=2 * n):
            A[n : 2 * n, k] = -force / mass[:, 0]
            A[k, :n], A[k, n : 2 * n], A[k, k] = of_position, of_rate, decay
        return A

    def over_level(self, wave_number, speed):
        """Coordinates and changes of Q over the level's wave, exp(i k x), under the origin.

        All wheelsets carry the same load, whose part along the inclined rails moves them.
        """
        n, omega = len(self.free), wave_number * speed
        A, mass = self.matrix(), np.array(self.mass)
        inner = np.linalg.solve(
            1j * omega * np.eye(len(A) - 2 * n) - A[2 * n :, 2 * n :],
            A[2 * n :, :n] + 1j * omega * A[2 * n :, n : 2 * n],
        )
        rates = A[n : 2 * n, :n] + 1j * omega * A[n : 2 * n, n : 2 * n]
        D = -mass[:, None] * (rates + A[n : 2 * n, 2 * n :] @ inner) - np.diag(omega**2 * mass)
        z = np.array([self.free.index((name, "z")) for name in self.wheelsets])
        x = np.array([self.free.index((name, "x")) for name in self.wheelsets])
        load = GRAVITY * sum(m for m, (_, c) in zip(mass, self.free, strict=True) if c == "z")
        q, force = np.zeros(n, complex), np.zeros(n, complex)
        q[z] = np.exp(1j * wave_number * np.array([self.at[w][0] for w in self.wheelsets]))
        force[x] = load / len(x) * 1j * wave_number * q[z]
        rest = np.setdiff1d(np.arange(n), z)
        q[rest] = np.linalg.solve(D[np.ix_(rest, rest)], force[rest] - D[np.ix_(rest, z)] @ q[z])
        return dict(zip(self.free, q, strict=True)), -0.5 * (D @ q)[z]
