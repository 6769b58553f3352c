"""Creep laws beside FASTSIM: FaStrip, Polach, linear with saturation, a measured adhesion curve.

All take the arrays of all patches, see :class:`railsim.kernels.patches.Patches`; units, frame and
signs are those of that group: force on the rail, of the sign of the creepage.  Patches without
contact or friction give zero.  docs/theory/creep.md derives and compares them.
"""

import math

from . import compiled

# FaStrip: flexibilities go over to a single one around this much creepage ...
_BLEND_CREEPAGE = 2.1
# ... in which spin counts double; and spin counts so much more in the longitudinal slip of strips.
_BLEND_SPIN = 2.0
_STRIP_SPIN = 1.05
# Linear law: arm of the slip by spin over the root mean square of the semi-axes.
_SPIN_ARM = 0.6
_TINY = 1e-30
_HUGE = 1e9
_NO_LOAD = 1e-200  # a bound below this is none: its inverse would overflow [N]
_EXCESS_POINTS = 16


@compiled(python=False, ordered=True)
def linear_saturated(n, patches, G):
    """Kalker's linear theory, saturated after Shen, Hedrick and Elkins (1983), spin included.

    With u the size of the linear force over mu N: force over mu N is u - u^2/3 + u^3/27 up to
    u = 3, 1 beyond.  Their u leaves spin out but for its lateral force, so that pure spin
    saturates at mu N; here u has a third component, the slip by spin at 0.6 of the patch's size.
    All of force and moment is reduced by the same factor.  Without spin it is the original.

    Parameters as in `railsim.kernels.fastsim.fastsim`; c33, the spin moment's coefficient, is read
    too.

    Notes
    -----
    Largest error against CONTACT on 27 creep curves 0.33 mu N (0.91 without the third component).
    Source: Shen, Z.Y., Hedrick, J.K., Elkins, J.A. (1983), A comparison of alternative creep force
    models for rail vehicle dynamic analysis, Vehicle System Dynamics 12, 79-83.
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    c11, c22, c23, c33 = patches.c11, patches.c22, patches.c23, patches.c33
    xi_x, xi_y, phi = patches.xi_x, patches.xi_y, patches.phi
    T_x, T_y, M_z = patches.T_x, patches.T_y, patches.M_z
    for i in range(n):
        area = a[i] * b[i]
        size = math.sqrt(area)
        x = G * area * c11[i] * xi_x[i]
        y = G * area * (c22[i] * xi_y[i] + size * c23[i] * phi[i])
        m = G * area * size * (size * c33[i] * phi[i] - c23[i] * xi_y[i])
        arm_2 = 0.5 * _SPIN_ARM**2 * (a[i] * a[i] + b[i] * b[i])
        s_2 = (G * area * phi[i]) ** 2 * c11[i] * c22[i] * arm_2
        bound = max(mu_N[i], 0.0) if area > 0.0 else 0.0
        force = math.sqrt(x * x + y * y + s_2)
        if bound <= 0.0:
            factor = 0.0
        elif force >= 3.0 * bound:
            factor = bound / force
        else:
            u = force / bound
            factor = 1.0 - u / 3.0 + u * u / 27.0
        T_x[i] = factor * x
        T_y[i] = factor * y
        M_z[i] = factor * m


@compiled(ordered=True)
def polach(n, patches, G, k_adhesion, k_slip):
    """Creep force after Polach, with reduction factors for the areas of adhesion and slip.

    Force from the creepage (lateral creepage enlarged by spin)::

        T = 2/pi mu N (k_A e/(1 + (k_A e)^2) + atan(k_S e)),  e = pi G a b c s/(4 mu N)

    plus a lateral force from spin that has the slope of linear theory and vanishes for large spin.
    Their sum is cut back to mu N.  The law has no moment: M_z is zero.

    Parameters
    ----------
    k_adhesion, k_slip : float
        Reduction of Kalker's stiffness in the areas of adhesion and slip, k_slip <= k_adhesion
        <= 1 [1]: dry 1 and 1; Polach fits 0.3 and 0.1 to wet rails.

    Others as in `railsim.kernels.fastsim.fastsim`.

    Notes
    -----
    Sources: Polach, O. (1999), A fast wheel-rail forces calculation computer code, Vehicle System
    Dynamics Supplement 33, 728-739; Polach, O. (2005), Creep forces in simulations of traction
    vehicles running on adhesion limit, Wear 258, 992-1000 (reduction factors, falling friction).
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    c11, c22, c23 = patches.c11, patches.c22, patches.c23
    xi_x, xi_y, phi = patches.xi_x, patches.xi_y, patches.phi
    T_x, T_y, M_z = patches.T_x, patches.T_y, patches.M_z
    for i in range(n):
        bound = mu_N[i]
        M_z[i] = 0.0
        if not (bound > 0.0 and a[i] > 0.0 and b[i] > 0.0):
            T_x[i] = 0.0
            T_y[i] = 0.0
            if bound != bound:
                T_x[i] = bound
            continue
        area = a[i] * b[i]
        xi_yc = xi_y[i] + phi[i] * a[i]
        lateral = xi_yc if abs(xi_yc) > abs(xi_y[i]) else xi_y[i]
        s = math.sqrt(xi_x[i] * xi_x[i] + lateral * lateral) + _TINY
        plain = math.sqrt(xi_x[i] * xi_x[i] + xi_y[i] * xi_y[i]) + _TINY
        c = math.sqrt((c11[i] * xi_x[i]) ** 2 + (c22[i] * xi_y[i]) ** 2) / plain
        e = min(0.25 * math.pi * G * area * c * s / bound, _HUGE)
        e_adhesion = k_adhesion * e
        force = (
            2.0 / math.pi * bound
            * (e_adhesion / (1.0 + e_adhesion * e_adhesion) + math.atan(k_slip * e))
        )  # fmt: skip
        x = force * xi_x[i] / s
        y = force * xi_y[i] / s
        shape = 1.0 + 6.3 * (1.0 - math.exp(-a[i] / b[i]))
        e_spin = 8.0 / 3.0 * G * b[i] * math.sqrt(area) * c23[i] / (shape * bound) * abs(lateral)
        e_spin = min(k_adhesion * e_spin, _HUGE)
        d = (e_spin * e_spin - 1.0) / (e_spin * e_spin + 1.0)
        rest = max(1.0 - d * d, 0.0)
        k_m = rest * math.sqrt(rest) / 3.0 - e_spin * (d * d * d / 3.0 - 0.5 * d * d + 1.0 / 6.0)
        y += 9.0 / 16.0 * a[i] * bound * k_m * shape * phi[i] / s
        total = math.sqrt(x * x + y * y)
        if total > bound:
            x *= bound / total
            y *= bound / total
        T_x[i] = x
        T_y[i] = y


@compiled(ordered=True)
def adhesion_curve(n, patches, curve):
    """Creep force by a measured adhesion curve, T/(mu N) over creepage.

    The force has the direction of the creepage, the curve gives its size over that of the
    creepage::

        T = mu N f(s) (xi_x, xi_s)/s,  s^2 = xi_x^2 + xi_s^2,  xi_s = xi_y + c23/c22 sqrt(a b) phi

    xi_s is the lateral creepage that has the lateral force of the spin in linear theory: spin is
    taken as Shen, Hedrick and Elkins (1983) take it, with the measured curve instead of their
    cubic.  There is no moment.

    Parameters
    ----------
    curve : ndarray, shape (k, 2), k >= 2
        Creepage, rising from 0, and T/(mu N) from 0 on, 0..1 [1]; linear between the rows,
        constant beyond the last.

    Others as in `railsim.kernels.fastsim.fastsim`.

    Notes
    -----
    Measured curves are those of Logston, C.F., Itami, G.S. (1980), Locomotive friction-creep
    studies, Journal of Engineering for Industry 102, 275-281, and their like: force over creepage
    of a driven wheelset on dry, wet or oiled rails.
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    last = curve.shape[0] - 1
    for i in range(n):
        size = math.sqrt(max(a[i] * b[i], 0.0))
        x = patches.xi_x[i]
        y = patches.xi_y[i] + patches.c23[i] / patches.c22[i] * size * patches.phi[i]
        s = math.sqrt(x * x + y * y)
        k = 1
        while k < last and s > curve[k, 0]:
            k += 1
        fraction = (s - curve[k - 1, 0]) / (curve[k, 0] - curve[k - 1, 0])
        share = curve[k - 1, 1] + min(fraction, 1.0) * (curve[k, 1] - curve[k - 1, 1])
        bound = max(mu_N[i], 0.0) if a[i] > 0.0 and b[i] > 0.0 else 0.0
        factor = bound * share / (s + _TINY)
        patches.T_x[i] = factor * x
        patches.T_y[i] = factor * y
        patches.M_z[i] = 0.0


@compiled(python=False)
def _fastrip_strips(n, nx, ny, patches, G, work):
    """Prepare the strips of all patches for `_fastrip_cell`.

    Rows of work: 0 to 2 growth per cell of the direction's traction (x and y at the middle, y by
    spin times x/l); 3 end of the slip zone, x/l; 4, 5 state of the direction's traction, 6 how far
    it counts as at its bound, 0 to 1; 7 to 9 sums of p_x, p_y, x p_y, which begin with those of the
    stick zone; 10 integral of the ellipse over the slipping part of the cell that the stick zone
    cuts.
    """
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    c11, c22, c23 = patches.c11, patches.c22, patches.c23
    xi_x, xi_y, phi = patches.xi_x, patches.xi_y, patches.phi
    for i in range(n):
        loaded = mu_N[i] > _NO_LOAD and a[i] > 0.0 and b[i] > 0.0
        bound = mu_N[i] if loaded else 1.0
        aa = a[i] if loaded else 1.0
        bb = b[i] if loaded else 1.0
        size = math.sqrt(aa * bb)
        unit = G * aa * bb / bound
        # no force changes beyond creepages of a million times the linear range
        n_x = unit * c11[i] * xi_x[i]
        n_y = unit * c22[i] * xi_y[i]
        n_s = unit * size * c23[i] * phi[i]
        reach = math.sqrt(n_x * n_x + n_y * n_y + (_BLEND_SPIN * n_s) ** 2)
        scale = (1.0 if reach < 1e6 else 1e6 / reach) if loaded else 0.0
        x, y, s = scale * xi_x[i], scale * xi_y[i], scale * phi[i]
        reach = min(reach, 1e6)
        # slip of strip theory over that which slides at once; spin in units of full sliding
        k_x = 4.0 / (3.0 * math.pi) * unit * c11[i]
        k_y = 4.0 / (3.0 * math.pi) * unit * c22[i]
        psi = unit * size * c23[i] * s
        # flexibilities over a/G
        f_x = 8.0 / (3.0 * c11[i])
        f_y = 8.0 / (3.0 * c22[i])
        f_s = math.pi * math.sqrt(aa / bb) / (4.0 * c23[i])
        total = x * x + y * y + (size * s) ** 2
        single = math.sqrt(
            ((f_x * x) ** 2 + (f_y * y) ** 2 + (f_s * size * s) ** 2 + _TINY) / (total + _TINY)
        )
        weight = reach * reach / (reach * reach + _BLEND_CREEPAGE**2)
        f_x += weight * (single - f_x)
        f_y += weight * (single - f_y)
        f_s += weight * (single - f_s)
        per_cell = math.pi * unit / nx  # (2 a l/nx)/(a/G) over 2 mu N/(pi a b)
        for j in range(ny):
            c = j * n + i
            eta = (2 * j + 1 - ny) / ny
            l = math.sqrt(1.0 - eta * eta)
            t = bb * eta
            work[0, c] = per_cell * (x / f_x - t * s / f_s) / l
            work[1, c] = per_cell * y / f_y / l
            work[2, c] = per_cell * aa * s / f_s
            u = k_x * (x - _STRIP_SPIN * t * s)
            v = k_y * y
            square = u * u + v * v
            inside = v * v + (1.0 - psi * psi) * u * u
            # slip length d solves (1 - psi^2) d^2 - 2 v psi d - u^2 - v^2 = 0
            divisor = math.sqrt(max(inside, 0.0)) - v * psi
            sticks = inside >= 0.0 and divisor * l > square and square > 0.0
            d = square / divisor if sticks else l
            # no jump where beyond the limit of spin the last root vanishes
            d += (1.0 - min(1.0, max(inside, 0.0) / (0.5 * v * v + _TINY))) * (l - d)
            stick_x, stick_y, stick_m = _stick_zone(u / d, v / d, psi, d / l)
            work[3, c] = 2.0 * d / l - 1.0
            work[4, c] = 0.0
            work[5, c] = 0.0
            work[6, c] = min(1.0, 5.0 * (1.0 - d / l))  # no jump where the strip begins to stick
            work[7, c] = stick_x
            work[8, c] = stick_y
            work[9, c] = stick_m
            # the cell that is cut by the end of the slip zone: ellipse between its rear and there
            end = work[3, c]
            rear = 1.0 - 2.0 * math.ceil(max(0.5 * nx * (1.0 - end), 1e-12)) / nx
            work[10, c] = _ellipse_area(end) - _ellipse_area(max(rear, -1.0))


@compiled(python=False)
def _ellipse_area(x):
    """Integral of sqrt(1 - x^2) from 0 to x, |x| <= 1."""
    x = min(max(x, -1.0), 1.0)
    return 0.5 * (x * math.sqrt(1.0 - x * x) + math.asin(x))


@compiled(python=False)
def _stick_zone(kappa, lam_d, psi, d):
    """Integrals over the stick zone 2 d - 1 < x < 1 of a strip: p_x, p_y, x p_y.

    In units of the strip's bound at its middle and its half length; d: slip length over l.
    """
    lam = lam_d + psi
    end = 2.0 * d - 1.0
    rest = max(1.0 - end * end, 0.0)
    outer_area = 0.25 * math.pi - _ellipse_area(end)
    outer_moment = rest * math.sqrt(rest) / 3.0
    inner_area = 0.5 * math.pi * (1.0 - d) * (1.0 - d)
    x_sum = kappa * (outer_area - inner_area)
    y_sum = lam * outer_area - lam_d * inner_area
    m_sum = lam * outer_moment - lam_d * d * inner_area
    # strip theory may exceed the bound at the leading edge where spin is beyond its limit (the
    # inner root is sqrt(1 - d) of the outer one there): take away what is too much
    inner = math.sqrt(1.0 - d)
    if (kappa * (1.0 - inner)) ** 2 + (lam - lam_d * inner) ** 2 > 1.0:
        for k in range(_EXCESS_POINTS):
            angle = math.pi * (k + 0.5) / _EXCESS_POINTS
            x = d + (1.0 - d) * math.cos(angle)
            width = (1.0 - d) * math.sin(angle) * math.pi / _EXCESS_POINTS
            bound = math.sqrt(1.0 - x * x)
            root = (1.0 - d) * math.sin(angle)
            p_x = kappa * (bound - root)
            p_y = lam * bound - lam_d * root
            excess = width * max(1.0 - bound / math.sqrt(p_x * p_x + p_y * p_y + _TINY), 0.0)
            x_sum -= excess * p_x
            y_sum -= excess * p_y
            m_sum -= excess * p_y * x
    return x_sum, y_sum, m_sum


@compiled(python=False)
def _fastrip_cell(m, x_front, x_rear, x_slip, step, ellipse, work):
    """One cell of all m strips: FASTSIM's direction, and its share of the slip zone added up."""
    grow_x, grow_y, grow_s, slip_end = work[0], work[1], work[2], work[3]
    fx, fy, at_bound = work[4], work[5], work[6]
    sum_x, sum_y, sum_m, partial = work[7], work[8], work[9], work[10]
    x_cell = 0.5 * (x_front + x_rear)
    parabola = 1.0 - x_cell * x_cell
    full = 1.0 / parabola
    for c in range(m):
        gx = grow_x[c]
        gy = grow_y[c] + x_slip * grow_s[c]
        x = fx[c] + step * gx
        y = fy[c] + step * gy
        square = x * x + y * y + _TINY
        inverse = 1.0 / math.sqrt(square)
        cut = min(1.0, parabola * inverse)
        # a traction that opposes the slip turns round through stick
        before = fx[c] * fx[c] + fy[c] * fy[c] + _TINY
        left = min(1.0, square / before)
        mode = max(at_bound[c] * left * left, _TINY)
        mode = 1.0 if cut < 1.0 else mode
        x *= cut
        y *= cut
        fx[c] = x
        fy[c] = y
        at_bound[c] = mode
        end = slip_end[c]
        slides = ellipse if end >= x_front else (partial[c] if end > x_rear else 0.0)
        factor = slides * (mode * max(inverse, full) + (1.0 - mode) * full)
        sum_x[c] += factor * x
        sum_y[c] += factor * y
        sum_m[c] += factor * y * x_cell


@compiled
def fastrip(n, nx, ny, patches, G, work):
    """Tangential forces on the rail after the idea of FaStrip: strip theory joined to FASTSIM.

    In the stick zone of each strip, which begins at the leading edge, the traction is that of
    Kalker's strip theory for slip and spin, with its creepages scaled so that the small-creepage
    limit is linear theory; in the slip zone its size is the elliptic (Hertzian) bound and its
    direction that of FASTSIM with the parabolic bound.  Ours differs from the published algorithm:
    (1) FASTSIM's three flexibilities go over to one when the creepage is large, so that full
    sliding has the direction of the slip; (2) the stick zone is kept for spin beyond the limit of
    strip theory where lateral creepage opposes it, and shrinks to nothing where its end has no
    solution; (3) a direction that reverses passes through smaller tractions.  The force is
    continuous in the creepages, with any number of cells.  Three numbers of the blend were fitted
    to CONTACT's results for a/b = 0.3, 1 and 3.

    Parameters as in `railsim.kernels.fastsim.fastsim`.

    Notes
    -----
    Sources: Kalker, J.J. (1967), A strip theory for rolling with slip and spin, Proc. KNAW B 70,
    10-62; Sichani, M.Sh., Enblom, R., Berg, M. (2016), An alternative to FASTSIM for tangential
    solution of the wheel-rail contact, Vehicle System Dynamics 54, 748-764; single flexibility for
    large creepage: Vollebregt, E.A.H. (2022), as in CONTACT.
    """
    _fastrip_strips(n, nx, ny, patches, G, work)
    m = n * ny
    half = 1.0 / nx
    for k in range(nx):
        x_front, x_rear = 1.0 - 2.0 * k * half, 1.0 - 2.0 * (k + 1) * half
        ellipse = _ellipse_area(x_front) - _ellipse_area(x_rear)
        x_slip, step = (1.0 - 0.5 * half, 0.5) if k == 0 else (x_front, 1.0)
        _fastrip_cell(m, x_front, x_rear, x_slip, step, ellipse, work)
    across = 0.0
    for j in range(ny):
        eta = (2 * j + 1 - ny) / ny
        across += 1.0 - eta * eta
    a, b, mu_N = patches.a, patches.b, patches.mu_N
    T_x, T_y, M_z = patches.T_x, patches.T_y, patches.M_z
    for i in range(n):
        tx = ty = mz = 0.0
        for j in range(ny):
            c = j * n + i
            eta = (2 * j + 1 - ny) / ny
            l2 = 1.0 - eta * eta
            tx += l2 * work[7, c]
            ty += l2 * work[8, c]
            mz += l2 * (math.sqrt(l2) * a[i] * work[9, c] - eta * b[i] * work[7, c])
        # full sliding along one direction gives pi/2 per strip: scaled to mu N
        unit = max(mu_N[i], 0.0) / (0.5 * math.pi * across)
        if not (a[i] > 0.0 and b[i] > 0.0):
            unit = 0.0
        T_x[i] = unit * tx
        T_y[i] = unit * ty
        M_z[i] = unit * mz
