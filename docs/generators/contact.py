"""Fill the tables of `docs/validation/contact_geometry.md`.

It takes some minutes: it runs the curving study with six
contact tables, boundary elements at a dozen points, and an independent rigid search.
"""

import dataclasses
import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from generators.filling import fill_page, table
from railsim import load_track, load_vehicle, simulate
from railsim.contact import build_contact_table, contact_geometry
from railsim.contact.elastic import loaded_contact
from railsim.contact.exact_normal import exact_contact
from railsim.contact.table import TableGrid
from railsim.definitions.settings import Settings
from railsim.model import assembly
from railsim.profiles import load_profile
from railsim.profiles.builtin import s1002_height

DOCS = Path(__file__).parents[1]
PAGE = DOCS / "validation" / "contact_geometry.md"
for folder in ("reference", "verification"):
    sys.path.insert(0, str(DOCS.parent / "tests" / folder))
from curving_study import measured, published  # noqa: E402
from independent_contact import lowest_gap, rail_points  # noqa: E402

LOAD = 60e3
STEP = 0.25e-3  # s, short enough for the finest table too
PAIRS = {
    "60E1, 1:40": ("60E1", 0.025, (10.228, 26.0265)),
    "60E1, 1:20": ("60E1", 0.05, (10.228, 26.0265)),
    "benchmark rail, 1:40": ("benchmark", 0.025, (10.49979, 25.98803)),
}


def rigid_table() -> str:
    """Rigid geometry against the independent search."""
    wheel_y = np.arange(-60.0, 60.0, 0.02)
    wheel = 1e-3 * wheel_y, 1e-3 * s1002_height(wheel_y)
    body = []
    for name, (rail_name, inclination, half_widths) in PAIRS.items():
        rail = rail_points(half_widths, inclination)
        slope = np.gradient(rail[1], rail[0])
        lateral = np.arange(-0.0080, 0.00801, 2e-4)
        geometry = contact_geometry(
            load_profile("S1002"), load_profile(rail_name), inclination=inclination, lateral=lateral
        )
        fine = contact_geometry(
            load_profile("S1002"),
            load_profile(rail_name),
            inclination=inclination,
            lateral=np.arange(-0.0080, 0.00801, 2e-5),
        )
        jumps = np.array([lateral for lateral, _ in fine.jumps(0.4e-3)])
        errors = []
        for i, y in enumerate(lateral):
            if np.min(np.abs(jumps - y)) < 1.5e-4:
                continue

            def sides(roll, y=y, rail=rail):
                return (
                    lowest_gap(*wheel, *rail, -y, -roll, 0.0, 0.46),
                    lowest_gap(*wheel, *rail, y, roll, 0.0, 0.46),
                )

            roll = brentq(
                lambda r, sides=sides: np.subtract(*[s[0] for s in sides(r)]),
                -0.012,
                0.012,
                xtol=1e-9,
            )
            for side, (_, on_wheel, on_rail) in enumerate(sides(roll)):
                radius = 0.46 + np.interp(on_wheel, *wheel)
                angle = np.arctan(-np.interp(on_rail, rail[0], slope))
                errors.append(
                    (
                        abs(geometry.rolling_radius[i, side] - radius),
                        abs(geometry.contact_angle[i, side] - angle),
                    )
                )
        worst = np.max(errors, axis=0)
        conicity = fine.equivalent_conicity([0.001, 0.003, 0.005])
        positions = sorted({round(1e3 * abs(p), 2) for p, _ in fine.jumps(1e-3)})
        body.append(
            (
                name,
                f"{1e3 * worst[0]:.4f}",
                f"{1e3 * worst[1]:.2f}",
                ", ".join(f"{p:.2f}" for p in positions),
                " / ".join(f"{c:.3f}" for c in conicity),
            )
        )
    header = ("S1002 on", "radius, mm", "angle, mrad", "jumps at, mm", "conicity at 1/3/5 mm")
    return table(header, body)


def exact_table() -> str:
    """Elastic contact of the table, with ellipses and non-elliptic, against boundary elements."""
    wheel, rail = load_profile("S1002"), load_profile("60E1")
    lateral = 1e-3 * np.array([-6, -3, -1, 0, 0.5, 1, 2, 3, 4, 4.8, 5.0, 5.2, 5.6, 6.0, 6.2, 7.0])
    roll = contact_geometry(wheel, rail, lateral=lateral).roll
    tables = [
        build_contact_table(wheel, rail, grid=TableGrid(normal=n))
        for n in ("hertz", "kik-piotrowski")
    ]
    body = []
    for y, r in zip(lateral, roll, strict=True):
        exact = exact_contact(wheel, rail, y, r, LOAD)
        found = [loaded_contact(table, y, r, LOAD) for table in tables]

        def split(patches) -> str:
            return " + ".join(f"{1e-3 * p.N_z:.1f}" for p in patches if p.N_z > 0.01 * LOAD)

        def centre(patches) -> float:
            return sum(p.N_z * p.y for p in patches) / sum(p.N_z for p in patches)

        def lateral_force(patches) -> float:
            return sum(p.N_y for p in patches)

        area = sum(p.area for p in exact.patches)
        p_max = max(p.p_max for p in exact.patches)
        areas = [sum(np.pi * p.a * p.b for p in f.patches) / area for f in found]
        pressures = [max(p.p_max for p in f.patches) / p_max for f in found]
        body.append(
            (
                f"{1e3 * y:.1f}",
                f"{1e6 * exact.penetration:.0f} ({1e6 * (found[0].z - exact.z):+.0f})",
                f"{1e3 * centre(exact.patches):.2f} "
                f"({1e3 * (centre(found[0].patches) - centre(exact.patches)):+.2f})",
                f"{split(exact.patches[::-1])} ({split(found[0].patches)})",
                f"{1e-3 * lateral_force(exact.patches):.1f} "
                f"({1e-3 * (lateral_force(found[0].patches) - lateral_force(exact.patches)):+.1f})",
                f"{1e6 * area:.0f}",
                " / ".join(f"{a:.2f}" for a in areas),
                f"{1e-6 * p_max:.0f}",
                " / ".join(f"{p:.2f}" for p in pressures),
            )
        )
        print(body[-1], flush=True)
    header = (
        "y, mm",
        "penetration, µm",
        "centre at, mm",
        "Q of patches, kN",
        "Y, kN",
        "area, mm²",
        "table/exact",
        "p_max, MPa",
        "table/exact",
    )
    return table(header, body)


COARSE = {"ds": 2e-4, "droll": 1.5e-3, "n_w": 9}
FINE = {  # over the part of the table that the run uses
    "s_min": -0.012,
    "s_max": 0.012,
    "ds": 5e-5,
    "roll_max": 9e-3,
    "droll": 0.375e-3,
    "n_w": 33,
}
VARIANTS = {
    "default: 60E1, 1:40": ({}, "60E1", 0.025),
    "60E1, grid twice as coarse": (COARSE, "60E1", 0.025),
    "60E1, grid twice as fine": (FINE, "60E1", 0.025),
    "benchmark rail": ({}, "benchmark", 0.025),
    "60E1, 1:20": ({}, "60E1", 0.05),
    "non-elliptic patches": ({"normal": "kik-piotrowski"}, "60E1", 0.025),
}


def curving_table() -> str:
    """The curving study with other rails and other contact tables."""
    usual = assembly.cached_contact_table
    body = []
    names = list(published("manchester"))
    for name, (changes, rail, inclination) in VARIANTS.items():
        grid = dataclasses.replace(TableGrid(), **changes)

        def changed(wheel, rail, *, grid=grid, **geometry):
            del geometry["normal"]  # the grid says it
            return build_contact_table(wheel, rail, grid=grid, **geometry)

        assembly.cached_contact_table = changed
        track = load_track(
            "curve_r250", [f'rail="{rail}"', f"inclination={inclination}", 'support.preset="rigid"']
        )
        vehicle = load_vehicle("coach_manchester")
        result = simulate(vehicle, track, speed=20.0, settings=Settings(step=STEP))
        values = [measured(result, quantity) for quantity in names]
        if not body:
            base = values
            scales = (100.0, 1e-3, 1.0, 1e3, 1e3, 1e3)
            digits = (2, 2, 3, 3, 2, 3)
            shown = [f"{s * v:.{d}f}" for v, s, d in zip(values, scales, digits, strict=True)]
        else:
            shown = [f"{100 * (v / b - 1):+.1f} %" for v, b in zip(values, base, strict=True)]
        body.append((name, *shown))
        print(body[-1], flush=True)
    assembly.cached_contact_table = usual
    header = (
        "contact table",
        "dQ/Q0, %",
        "sum abs Y, kN",
        "Y/Q",
        "roll, mrad",
        "yaw, mrad",
        "lateral, mm",
    )
    return table(header, body)


def time_table() -> str:
    """Times to build a table of a new pair."""
    body = []
    for normal in ("hertz", "kik-piotrowski"):
        pair = load_profile("S1002"), load_profile("54E1")
        build_contact_table(*pair, grid=TableGrid(ds=1e-3, n_w=2, normal=normal))
        cpu = time.process_time()
        build_contact_table(*pair, grid=TableGrid(normal=normal))
        body.append((normal, f"{time.process_time() - cpu:.1f}"))
    return table(("normal contact", "processor time of both cores, s"), body)


PARTS = {
    "rigid": rigid_table,
    "exact": exact_table,
    "tables": curving_table,
    "building": time_table,
}


def make(parts):
    """Fill the tables of these names."""
    fill_page(PAGE, PARTS, parts)
