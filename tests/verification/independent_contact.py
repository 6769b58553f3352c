"""Contact computed a second time, by other means and in plain numpy, for the tests."""

import numpy as np


def spline_basis(t):
    """Uniform cubic B-spline's four weights and their derivatives at t in [0, 1)."""
    weights = np.array([(1 - t) ** 3, 4 - 6 * t**2 + 3 * t**3, 1 + 3 * (t + t**2 - t**3), t**3])
    slopes = np.array([-((1 - t) ** 2), 3 * t**2 - 4 * t, 1 + 2 * t - 3 * t**2, t**2])
    return weights / 6, slopes / 2


def evaluate(table, y, roll, w=0.0):
    """Fields (3, 12) of a contact table and their derivatives by y, roll and w."""
    a = (y - table.shear * roll - table.y0) / table.dy
    # the roll's coordinate, roll/(1 + (roll/4 mrad)^2)^(1/4), and its slope
    x = roll / 4e-3
    slope = (1 + x**2) ** -0.25 - 0.5 * x**2 * (1 + x**2) ** -1.25
    b = (roll * (1 + x**2) ** -0.25 - table.roll0) / table.droll
    i, j = int(a), int(b)
    k = min(int(np.searchsorted(table.w, w, side="right")), len(table.w) - 1) - 1
    step = table.w[k + 1] - table.w[k]
    c = (w - table.w[k]) / step
    in_s, by_s = spline_basis(a - i)
    in_roll, by_roll = spline_basis(b - j)
    in_w, by_w = np.array([1 - c, c]), np.array([-1.0, 1.0]) / step
    nodes = table.values[:, k : k + 2, j - 1 : j + 3, i - 1 : i + 3]

    def total(along_w, along_roll, along_s):
        return np.einsum("pwrsf,w,r,s->pf", nodes, along_w, along_roll, along_s)

    d_s = total(in_w, in_roll, by_s) / table.dy
    return (
        total(in_w, in_roll, in_s),
        d_s,
        total(in_w, by_roll, in_s) * slope / table.droll - table.shear * d_s,
        total(by_w, in_roll, in_s),
    )


def under_load(fields, load):
    """c_y, c_z, b1 and tan(gamma) of every patch under a load, shape (3, 4)."""
    return fields[:, 4:8] + fields[:, 8:12] * load / (load + 35e3)


def potential(table, y, z, roll, w=0.0):
    """Energy of the elastic contacts, sum of 2/5 K e^(5/2) + K2/3 e^3."""
    fields = evaluate(table, y, roll, w)[0]
    e = np.maximum(z - fields[:, 0], 0.0)
    return np.sum(0.4 * fields[:, 1] * e**2.5 + fields[:, 2] * e**3 / 3.0)


def forces(table, y, z, roll, w=0.0):
    """Gradient of `potential` by y, z, roll, w from the splines' own derivatives."""
    fields, d_y, d_roll, d_w = evaluate(table, y, roll, w)
    e = np.maximum(z - fields[:, 0], 0.0)
    normal = fields[:, 1] * e**1.5 + fields[:, 2] * e**2

    def along(d):
        return np.sum(0.4 * d[:, 1] * e**2.5 + d[:, 2] * e**3 / 3.0 - normal * d[:, 0])

    return np.array([along(d_y), np.sum(normal), along(d_roll), along(d_w)])


def lowest_gap(
    wheel_y, wheel_z, rail_y, rail_z, y, roll, yaw, radius, tape_circle=0.75, approach=0.0
):
    """Height at which a wheel touches, from its whole surface instead of its trace line.

    With an `approach` along the normal, the point is sought where h + approach/cos(gamma) is
    least, and h at that point is returned.

    Every circle of the wheel is a set of points over the turn angle theta; the rail is a polyline
    over the lateral position.  `wheel_y, wheel_z` as `Profile`; `rail_y, rail_z` placed in the
    track, rail_y increasing.  Returns height, lateral position on the wheel and on the rail.
    """
    rotation = np.array(
        [[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    ) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, np.cos(roll), -np.sin(roll)], [0.0, np.sin(roll), np.cos(roll)]]
    )

    def gaps(profile_y, profile_z, theta):
        u, r = (tape_circle + profile_y)[:, None], (radius + profile_z)[:, None]
        body = np.stack((r * np.sin(theta), u + 0 * theta, r * np.cos(theta)))
        points = np.einsum("ij,jkl->ikl", rotation, body)
        lateral = y + points[1]
        height = np.interp(lateral, rail_y, rail_z, left=1.0, right=1.0)
        lift = approach * np.interp(lateral, rail_y, stretch) if approach else 0.0
        return height + radius - points[2] + lift, lateral, lift

    stretch = np.hypot(1.0, np.gradient(rail_z, rail_y)) if approach else None
    theta = np.linspace(-0.12, 0.12, 61) if yaw else np.zeros(1)
    h, lateral, lift = gaps(wheel_y, wheel_z, theta)
    i, k = np.unravel_index(np.argmin(h), h.shape)
    on_wheel, angle, width, turn = wheel_y[i], theta[k], 2e-4, 0.004 if yaw else 0.0
    for _ in range(4):
        ys = np.linspace(on_wheel - width, on_wheel + width, 41)
        angles = np.linspace(angle - turn, angle + turn, 41) if yaw else np.zeros(1)
        h, lateral, lift = gaps(ys, np.interp(ys, wheel_y, wheel_z), angles)
        i, k = np.unravel_index(np.argmin(h), h.shape)
        on_wheel, angle, width, turn = ys[i], angles[k], width / 8, turn / 8
    return (h - lift)[i, k], on_wheel, lateral[i, k]


def rail_points(half_widths=(10.228, 26.0265), inclination=0.025, gauge=1.435):
    """60E1 or a sister placed as the right rail, by circles' equations: y, z [m], y increasing."""
    x1, x2 = half_widths
    n1 = np.array([x1, -np.sqrt(300.0**2 - x1**2)]) / 300.0  # outward normals, z down
    p1 = np.array([x1, 300.0 + 300.0 * n1[1]])
    c2 = p1 - 80.0 * n1
    n2 = np.array([x2 - c2[0], -np.sqrt(80.0**2 - (x2 - c2[0]) ** 2)]) / 80.0
    p2 = c2 + 80.0 * n2
    c3 = p2 - 13.0 * n2
    parts = []
    for centre, radius, a, b in (
        (np.array([0.0, 300.0]), 300.0, -n1[0], n1[0]),
        (c2, 80.0, n1[0], n2[0]),
        (c3, 13.0, n2[0], np.cos(np.arctan(0.05))),
    ):
        t = np.linspace(np.arcsin(a), np.arcsin(b), 40_001)
        parts.append(np.stack((centre[0] + radius * np.sin(t), centre[1] - radius * np.cos(t))))
    right = np.concatenate(parts[1:], axis=1)
    left = right[:, ::-1] * np.array([[-1.0], [1.0]])
    y, z = np.concatenate((left, parts[0], right), axis=1)
    flank_z = np.linspace(z[0], 40.0, 200)
    y = np.concatenate(((y[0] - 0.05 * (flank_z - z[0]))[::-1], y))
    z = np.concatenate((flank_z[::-1], z))
    angle = np.arctan(inclination)
    turned_y, turned_z = (
        y * np.cos(angle) + z * np.sin(angle),
        z * np.cos(angle) - y * np.sin(angle),
    )
    turned_z -= turned_z.min()
    top = np.argmin(turned_z)
    gauge_side = slice(0, top)
    deep = turned_z[gauge_side] <= 14.0
    face = turned_y[gauge_side][deep].min()
    placed = turned_y - face + 500.0 * gauge
    # the part that is a function of y, without the joints' double points
    falling = np.flatnonzero(np.diff(placed[: top + 1]) < -1e-9)
    start = int(falling[-1]) + 1 if falling.size else 0
    placed, turned_z = placed[start:], turned_z[start:]
    single = np.concatenate(([True], np.diff(placed) > 1e-9))
    return 1e-3 * placed[single], 1e-3 * turned_z[single]
