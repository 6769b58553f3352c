"""Creep laws beside FASTSIM: FaStrip, Polach, and Kalker's linear theory with saturation.

All take the arrays of all patches, as :func:`railsim.kernels.fastsim.fastsim` does; units, frame
and signs are those of that function: force on the rail, of the sign of the creepage.  Patches
without contact or friction give zero.  docs/theory/creep.md derives and compares them.
"""

import math

from . import jit

# FaStrip: flexibilities go over to a single one around this much creepage ...
_BLEND_CREEPAGE = 2.1
# ... in which spin counts double; and spin counts so much more in the longitudinal slip of strips.
_BLEND_SPIN = 2.0
_STRIP_SPIN = 1.05
# Linear law: arm of the slip by spin over the root mean square of the semi-axes.
_SPIN_ARM = 0.6
_TINY = 1e-30
_HUGE = 1e9


@jit
def linear_saturated(n, a, b, mu_N, c11, c22, c23, c33, G, xi_x, xi_y, phi, T_x, T_y, M_z):
    """Kalker's linear theory, saturated after Shen, Hedrick and Elkins (1983), spin included.

    With u the size of the linear force over mu N: force over mu N is u - u^2/3 + u^3/27 up to
    u = 3, 1 beyond.  Their u leaves spin out but for its lateral force, so that pure spin
    saturates at mu N; here u has a third component, the slip by spin at 0.6 of the patch's size.
    All of force and moment is reduced by the same factor.  Without spin it is the original.

    Parameters and results as in `railsim.kernels.fastsim.fastsim`; c33 is the spin moment's
    coefficient [1].

    Notes
    -----
    Largest error against CONTACT on 27 creep curves 0.33 mu N (0.91 without the third component).
    Source: Shen, Z.Y., Hedrick, J.K., Elkins, J.A. (1983), A comparison of alternative creep force
    models for rail vehicle dynamic analysis, Vehicle System Dynamics 12, 79-83.
    """
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


@jit
def polach(
    n, a, b, mu_N, c11, c22, c23, G, k_adhesion, k_slip, xi_x, xi_y, phi, T_x, T_y, M_z
):  # fmt: skip
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

    Others and results as in `railsim.kernels.fastsim.fastsim`.

    Notes
    -----
    Sources: Polach, O. (1999), A fast wheel-rail forces calculation computer code, Vehicle System
    Dynamics Supplement 33, 728-739; Polach, O. (2005), Creep forces in simulations of traction
    vehicles running on adhesion limit, Wear 258, 992-1000 (reduction factors, falling friction).
    """
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
        spun = xi_y[i] + phi[i] * a[i]
        lateral = spun if abs(spun) > abs(xi_y[i]) else xi_y[i]
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


@jit
def _fastrip_strips(n, nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi, work):
    """Prepare the strips of all patches for `_fastrip_march`.

    Rows of work: 0 to 2 growth per cell of the direction's traction (x and y at the middle, y by
    spin times x/l); 3 to 6 the stick zone's factors kappa, lambda, lambda', slip length over l;
    7, 8 state of the direction's traction, 9 whether it is at its bound; 10 to 12 sums.
    """
    for i in range(n):
        loaded = mu_N[i] > 0.0 and a[i] > 0.0 and b[i] > 0.0
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
            place = (2 * j + 1 - ny) / ny
            l = math.sqrt(1.0 - place * place)
            t = bb * place
            work[0, c] = per_cell * (x / f_x - t * s / f_s) / l
            work[1, c] = per_cell * y / f_y / l
            work[2, c] = per_cell * aa * s / f_s
            u = k_x * (x - _STRIP_SPIN * t * s)
            v = k_y * y
            square = u * u + v * v
            inside = v * v + (1.0 - psi * psi) * u * u
            # slip length d solves (1 - psi^2) d^2 - 2 v psi d - u^2 - v^2 = 0
            divisor = math.sqrt(max(inside, 0.0)) - v * psi
            sticks = inside >= 0.0 and divisor * l > square
            d = square / divisor if sticks and square > 0.0 else 1.0
            work[3, c] = u / d
            work[4, c] = v / d + psi
            work[5, c] = v / d
            work[6, c] = (
                square / divisor / l if sticks and square > 0.0 else (0.0 if sticks else 2.0)
            )
            work[7, c] = 0.0
            work[8, c] = 0.0
            work[9, c] = 1.0 if sticks else 0.0
            work[10, c] = 0.0
            work[11, c] = 0.0
            work[12, c] = 0.0


@jit
def _fastrip_cell(m, x_cell, x_slip, step, work):
    """One cell of all m strips: strip theory where it sticks, FASTSIM's direction where not."""
    grow_x, grow_y, grow_s = work[0], work[1], work[2]
    kappa, lam, lam_d, slip_length = work[3], work[4], work[5], work[6]
    fx, fy, at_bound = work[7], work[8], work[9]
    sum_x, sum_y, sum_m = work[10], work[11], work[12]
    parabola = 1.0 - x_cell * x_cell
    ellipse = math.sqrt(parabola)
    for c in range(m):
        gx = grow_x[c]
        gy = grow_y[c] + x_slip * grow_s[c]
        mode = at_bound[c]
        # a traction that opposes the slip turns round through stick
        mode = 0.0 if fx[c] * gx + fy[c] * gy < 0.0 else mode
        x = fx[c] + step * gx
        y = fy[c] + step * gy
        size = math.sqrt(x * x + y * y + _TINY)
        cut = min(1.0, parabola / size)
        mode = 1.0 if size > parabola else mode
        x *= cut
        y *= cut
        fx[c] = x
        fy[c] = y
        at_bound[c] = mode
        d = slip_length[c]
        inner = math.sqrt(max((1.0 - d) * (1.0 - d) - (x_cell - d) * (x_cell - d), 0.0))
        sticks = x_cell > 2.0 * d - 1.0
        factor = ellipse / (size * cut) if mode > 0.5 else 1.0 / ellipse
        px = kappa[c] * (ellipse - inner) if sticks else factor * x
        py = lam[c] * ellipse - lam_d[c] * inner if sticks else factor * y
        # strip theory may exceed the bound at the leading edge where spin is beyond its limit
        over = min(1.0, ellipse / math.sqrt(px * px + py * py + _TINY))
        px *= over
        py *= over
        sum_x[c] += px
        sum_y[c] += py
        sum_m[c] += x_cell * py


@jit
def fastrip(n, nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi, work, T_x, T_y, M_z):
    """Tangential forces on the rail after the idea of FaStrip: strip theory joined to FASTSIM.

    In the stick zone of each strip, which begins at the leading edge, the traction is that of
    Kalker's strip theory for slip and spin, with its creepages scaled so that the small-creepage
    limit is linear theory; in the slip zone its size is the elliptic (Hertzian) bound and its
    direction that of FASTSIM with the parabolic bound.  Ours differs from the published algorithm:
    (1) FASTSIM's three flexibilities go over to one when the creepage is large, so that full
    sliding has the direction of the slip; (2) the stick zone is kept for spin beyond the limit of
    strip theory where lateral creepage opposes it; (3) a direction that reverses passes through
    smaller tractions.  Three numbers of the blend were fitted to CONTACT's results for
    a/b = 0.3, 1 and 3.

    Parameters and results as in `railsim.kernels.fastsim.fastsim`.

    Notes
    -----
    Sources: Kalker, J.J. (1967), A strip theory for rolling with slip and spin, Proc. KNAW B 70,
    10-62; Sichani, M.Sh., Enblom, R., Berg, M. (2016), An alternative to FASTSIM for tangential
    solution of the wheel-rail contact, Vehicle System Dynamics 54, 748-764; single flexibility for
    large creepage: Vollebregt, E.A.H. (2022), as in CONTACT.
    """
    _fastrip_strips(n, nx, ny, a, b, mu_N, c11, c22, c23, G, xi_x, xi_y, phi, work)
    m = n * ny
    for k in range(nx):
        x_cell = 1.0 - (2 * k + 1) / nx
        if k == 0:
            _fastrip_cell(m, x_cell, 1.0 - 0.5 / nx, 0.5, work)
        else:
            _fastrip_cell(m, x_cell, 1.0 - 2.0 * k / nx, 1.0, work)
    # cells' areas times the elliptic bound, summed: for full sliding along x exactly mu N
    whole = 0.0
    for k in range(nx):
        x_cell = 1.0 - (2 * k + 1) / nx
        whole += math.sqrt(1.0 - x_cell * x_cell)
    across = 0.0
    for j in range(ny):
        place = (2 * j + 1 - ny) / ny
        across += 1.0 - place * place
    for i in range(n):
        tx = ty = mz = 0.0
        for j in range(ny):
            c = j * n + i
            place = (2 * j + 1 - ny) / ny
            l2 = 1.0 - place * place
            tx += l2 * work[10, c]
            ty += l2 * work[11, c]
            mz += l2 * (math.sqrt(l2) * a[i] * work[12, c] - place * b[i] * work[10, c])
        unit = max(mu_N[i], 0.0) / (whole * across)
        if not (a[i] > 0.0 and b[i] > 0.0):
            unit = 0.0
        T_x[i] = unit * tx
        T_y[i] = unit * ty
        M_z[i] = unit * mz
