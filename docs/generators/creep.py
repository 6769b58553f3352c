"""Fill the tables of `docs/validation/creep.md` and draw its pictures.

It takes some minutes: it solves all reference points with
the half-space solver on several grids, and runs the curving study with every creep law.
"""

import csv
import sys
from pathlib import Path

import numpy as np

from generators.filling import fill_page, table
from railsim import load_settings, load_track, load_vehicle, simulate
from railsim.contact.creep import LAWS, CreepForce, creep_force
from railsim.contact.creep_curves import CASES, Patch, exact_force
from railsim.contact.creep_table import linear_coefficients
from railsim.contact.exact_creep import exact_creep_force
from railsim.contact.kalker import kalker_coefficients
from railsim.notation import QUANTITIES
from railsim.plot.creep import creep_curves_figure, traction_figure
from railsim.plot.style import save

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "validation" / "creep.md"
sys.path.insert(0, str(DOCS.parent / "tests" / "reference"))
from creep_curves import DATA, creep_curves  # noqa: E402
from curving_study import COACHES, measured, published  # noqa: E402

CURVES = creep_curves()
RATIOS = (0.3, 1.0, 3.0)


def law(name, n=10):
    """Forces of a law at all points."""
    return creep_force(*CURVES.inputs(), G=CURVES.G, nu=CURVES.nu, law=name, nx=n, ny=n)


def exact(nx, ny):
    """Forces of the half-space solver at all points."""
    found = []
    for case in zip(*CURVES.inputs(), strict=True):
        solution = exact_creep_force(*map(float, case), G=CURVES.G, nu=CURVES.nu, nx=nx, ny=ny)
        found.append((solution.T_x, solution.T_y, solution.M_z))
    return CreepForce(*np.array(found).T)


def error_row(name, force, method="contact_ext"):
    """Largest and root mean square error of the force by ratio, largest of the moment."""
    error, moment = CURVES.errors(force, method)
    cells = [f"{error[ratio == CURVES.ratio].max():.4f}" for ratio in RATIOS]
    return (name, *cells, f"{np.sqrt(np.mean(error**2)):.4f}", f"{moment.max():.4f}")


HEADER = ("", "a/b = 0.3", "1", "3", "rms", "moment")


def fastsim_table():
    """FASTSIM against its own limit."""
    return table(
        HEADER,
        [
            error_row(f"{n} × {n}", law("fastsim", n), "fastsim3_continuum")
            for n in (10, 20, 50, 100)
        ],
    )


def laws_table():
    """All laws against the full theory."""
    body = [
        error_row("`table`", law("table")),
        error_row("`fastsim`, 10 × 10", law("fastsim")),
        error_row("`fastsim`, 100 × 100", law("fastsim", 100)),
        error_row("`fastrip`, 10 × 10", law("fastrip")),
        error_row("`fastrip`, 100 × 100", law("fastrip", 100)),
        error_row("`polach`", law("polach")),
        error_row("`linear`", law("linear")),
    ]
    for name, method in (
        ("CONTACT's FASTSIM, blended flexibilities, 100 × 100", "fastsim3_blend_par_100"),
        ("CONTACT's FaStrip, 100 × 100", "fastrip_100"),
        ("CONTACT itself, 60 × 60, not extrapolated", "contact60"),
    ):
        difference = CURVES.result(method) - CURVES.result("contact_ext")
        error = np.hypot(difference[0], difference[1])
        cells = [f"{error[ratio == CURVES.ratio].max():.4f}" for ratio in RATIOS]
        rms = np.sqrt(np.mean(error**2))
        body.append((name, *cells, f"{rms:.4f}", f"{np.abs(difference[2]).max():.4f}"))
    return table(HEADER, body)


def curves_table():
    """Largest error of each curve."""
    with open(DATA / "creep_curve_errors_dev.csv", newline="") as stream:
        listed = {(float(r["a_over_b"]), r["curve"]): r for r in csv.DictReader(stream)}
    forces = {"table": law("table"), "fastsim": law("fastsim", 100), "fastrip": law("fastrip", 100)}
    errors = {name: CURVES.errors(force, "contact_ext") for name, force in forces.items()}
    body = []
    for (ratio, curve), row in listed.items():
        chosen = (CURVES.ratio == ratio) & (CURVES.curve == curve)
        largest = {name: error[chosen].max() for name, (error, _) in errors.items()}
        body.append(
            (
                f"{curve.replace('_', ' ')}, a/b = {ratio:g}",
                f"{largest['table']:.3f}",
                f"{largest['fastsim']:.3f}",
                f"{float(row['fastsim3_continuum_maxerr_f']):.3f}",
                f"{largest['fastrip']:.3f}",
                f"{float(row['fastrip_100_maxerr_f']):.3f}",
            )
        )
    header = ("curve", "`table`", "`fastsim`", "listed", "`fastrip`", "listed")
    return table(header, body)


def solver_table():
    """The half-space solver on several grids."""
    found = {n: exact(n, n) for n in (14, 20, 28, 36)}
    body = [error_row(f"{n} × {n}", force) for n, force in found.items()]
    weight = 1.0 / (np.sqrt(8.0) - 1.0)
    both = CreepForce(*(f + weight * (f - c) for f, c in zip(found[28], found[14], strict=True)))
    body.append(error_row("28 × 28 and 14 × 14, extrapolated", both))
    return table(HEADER, body)


def coefficients_table():
    """Creepage coefficients by the solver, by CONTACT and as printed."""
    with open(DATA / "kalker_coefficients_computed.csv", newline="") as stream:
        computed = {
            float(r["a_over_b"]): r for r in csv.DictReader(stream) if float(r["nu"]) == 0.28
        }
    body = []
    for ratio in (0.1, 0.3, 1.0, 2.0, 5.0, 10.0):
        own = linear_coefficients(ratio)
        printed = kalker_coefficients(ratio, 0.28)
        other = [computed[ratio][c] for c in ("C11", "C22", "C23", "C33")]
        cells = [
            f"{o:.4g} / {float(k):.4g} / {float(t):.4g}"
            for o, k, t in zip(own, other, printed, strict=True)
        ]
        body.append((f"{ratio:g}", *cells))
    return table(("a/b", "c11", "c22", "c23", "c33"), body)


RUNS = (("fastsim", 10), ("fastsim", 50), *((name, 10) for name in LAWS if name != "fastsim"))


def curving_table():
    """The published curving study with every law: values, and what changes against FASTSIM."""
    names = list(published(COACHES[0]))
    quantities = [QUANTITIES[name] for name in names]
    body = []
    for coach in COACHES:
        body.append((f"**{coach}**, SIMPACK", *map(shown, quantities, published(coach).values())))
        base = None
        for law_name, n in RUNS:
            settings = load_settings(
                overrides=[f'creep_law="{law_name}"', f"fastsim_grid=[{n},{n}]"]
            )
            result = simulate(
                load_vehicle(f"coach_{coach}"), load_track("curve_r250"), speed=20.0,
                settings=settings,
            )  # fmt: skip
            values = [measured(result, name) for name in names]
            cells = list(map(shown, quantities, values))
            if base is None:
                base = values
            else:
                changes = [100.0 * (v / b - 1.0) for v, b in zip(values, base, strict=True)]
                cells = [f"{c} ({d:+.1f} %)" for c, d in zip(cells, changes, strict=True)]
            grid = f", {n} × {n}" if law_name in ("fastsim", "fastrip") else ""
            body.append((f"`{law_name}`{grid}", *cells))
            print(body[-1], flush=True)
    return table(("", *(quantity.words for quantity in quantities)), body)


def shown(quantity, value):
    """A value in the quantity's usual unit."""
    value *= quantity.scale
    return f"{value:.2f}" if abs(value) >= 1.0 else f"{value:.3f}"


def pictures():
    """Creep curves and traction fields of a flange-root patch."""
    patch = Patch(a=6e-3, b=4e-3, N=70e3, mu=0.35)
    save(creep_curves_figure(patch, LAWS), DOCS / "img" / "creep_curves.png", overwrite=True)
    fields = {}
    for name, direction in CASES.items():
        unit = np.array(patch.creepages(direction)) / np.linalg.norm(direction)
        fields[name] = exact_force(patch, 1.5 * unit)
    figure = traction_figure(fields, patch.mu * patch.N)
    save(figure, DOCS / "img" / "creep_traction.png", overwrite=True)


MAKERS = {
    "fastsim": fastsim_table,
    "creep_laws": laws_table,
    "creep_curves": curves_table,
    "solver": solver_table,
    "coefficients": coefficients_table,
    "law_curving": curving_table,
}
PARTS = (*MAKERS, "pictures")


def make(parts):
    """Fill the tables of these names, draw the `pictures`."""
    if "pictures" in parts or not parts:
        pictures()
    fill_page(PAGE, MAKERS, parts)
