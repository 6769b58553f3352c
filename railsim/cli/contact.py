"""``railsim contact``: contact geometry of a wheelset, equivalent conicity, patches, creep."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from railsim.cli import common as cli
from railsim.cli.terminal import echo
from railsim.errors import Fault, Faults, input_error
from railsim.files.access import check_folder

if TYPE_CHECKING:
    from railsim.contact.creep_curves import Patch
    from railsim.contact.summary import ContactSummary
    from railsim.description import Description

TABLES = ("functions.csv", "conicity.csv", "patches.csv")
MAP, OVERLAY = ("conicity_over_gauge.png", "conicity_over_gauge.csv"), "overlay.png"
PICTURES = ("profiles.png", "functions.png", "conicity.png", "patches.png")
CREEP = ("creep_curves.png", "traction.png", "creep_curves.csv")
CREEP_TABLE = "creep_table.npz"
FIELD_SIZE = 1.2
"""Magnitude of the normalised creepage of the traction fields."""

RANGES = {
    "gauge": (0.3, 2.5, "m"),
    "gauges": (0.3, 2.5, "m"),
    "inclination": (0.0, 0.2, "(1:40 is 0.025)"),
    "back_to_back": (0.2, 2.4, "m"),
    "radius": (0.05, 1.5, "m"),
    "load": (1.0, 1e6, "N"),
    "max_shift": (0.001, 0.020, "m"),
}
"""What an option's number may be, and its unit."""


@click.command()
@click.argument("profiles", nargs=-1, metavar="[WHEEL] [RAIL]")
@cli.repeated("--wheel", "Wheel profile; twice for left and right.", "W", default=("S1002",))
@cli.repeated("--rail", "Rail profile; twice for left and right.", "R", default=("60E1",))
@cli.option("--gauge", "Track gauge in m.", "G", default=1.435)
@cli.option("--inclination", "Rail inclination, 0.025 for 1:40.", "I", default=0.025)
@cli.option("--back-to-back", "Distance between the flange backs in m.", "D", default=1.360)
@cli.repeated("--radius radii", "Rolling radius in m; twice likewise.", "R", float, default=(0.46,))
@cli.option("--load", "Vertical wheel load in N.", "Q", default=60e3)
@cli.option("--max-shift", "Largest lateral displacement in m.", "Y", default=0.010)
@cli.values("--gauges", "Also the conicity over these gauges in m.", "A:B:N")
@cli.option("--overlay", "With --out: also a wheel or rail profile drawn over the right one.", "P")
@cli.flag("--exact", "Check the patches by boundary elements (about ten seconds).")
@cli.choice("--normal", "Normal contact; --exact compares both.", "hertz|kik-piotrowski")
@cli.flag("--creep", "Creep forces of the centred wheel by every law, and traction fields.")
@cli.option("--friction", "Friction coefficient, for --creep.", "MU", default=0.4)
@cli.flag(
    "--build-creep-table", "Only recompute the table of the law `table`: half an hour, resumable."
)
@cli.option("--workers", "Processes, for --build-creep-table.", "N", cli.COUNT, default=2)
@cli.output_options("Folder for pictures and tables; created if it does not exist.")
def command(
    profiles: tuple[str, ...],
    wheel: tuple[str, ...],
    rail: tuple[str, ...],
    radii: tuple[float, ...],
    gauges: list[float] | None,
    overlay: str | None,
    creep: bool,
    friction: float,
    build_creep_table: bool,
    workers: int,
    output: cli.Output,
    **numbers: Any,
) -> None:
    """Contact geometry of a wheelset on its rails.

    Prints rolling radius difference, contact angles and contact positions over the lateral
    displacement, the equivalent conicity of EN 15302, the gauge values of the wheels with their
    limits, and the contact patches of the right wheel under a load.

    \b
    Example:
      railsim contact --wheel S1002 --rail 60E1 --inclination 0.025 --out s1002_60e1
      railsim contact S1002 60E1 --gauges 1.430:1.450:5
      railsim contact measured.whl 54E1 --overlay S1002 --out worn
      railsim contact --creep --friction 0.35 --out creep
    """
    from railsim.contact import tables
    from railsim.contact.creep_curves import forces_by_law
    from railsim.contact.summary import conicity_over_gauge, contact_summary
    from railsim.profiles import load_profile

    if build_creep_table:
        _build_creep_table(workers, output)
        return
    if len(profiles) > 2:
        raise click.UsageError("give a wheel and a rail; --wheel and --rail twice for both sides")
    wheel, rail = profiles[:1] or wheel, profiles[1:] or rail
    by_side = {"wheel": wheel, "rail": rail, "radius": radii}
    _check(by_side, numbers, gauges or ())
    if creep and not 0.0 < friction <= 1.0:
        raise input_error("--friction", f"found {friction:.12g}", "above 0, at most 1")
    if gauges and len(gauges) == 1:
        raise click.UsageError("--gauges needs two gauges at least")
    cli.goes_with("--out", output.folder, "overlay")
    cli.goes_with("--creep", creep, "friction")
    cli.goes_with("--build-creep-table", False, "workers")
    for kind, _ in zip(("wheel", "rail"), profiles, strict=False):
        cli.goes_with(f"no {kind.upper()}", False, kind)
    other = load_profile(overlay) if overlay else None
    further = CREEP * creep + MAP * bool(gauges) + (OVERLAY,) * bool(other)
    output.reserve(*PICTURES, *TABLES, *further)
    numbers["radii"] = radii[0], radii[-1]
    with output.progress("contact"):
        summary = contact_summary(_profiles(wheel, "wheel"), _profiles(rail, "rail"), **numbers)
    description = _description(summary)
    by_gauge = None
    if gauges:
        by_gauge = conicity_over_gauge(summary, gauges)
        description.data.update(gauges=gauges, conicity_over_gauge=by_gauge.tolist())
        description.parts.extend(["", tables.conicity_map_table(summary, gauges, by_gauge)])
    if output.folder:
        _write(output, summary, gauges, by_gauge, other)
    if creep:
        patch = summary.main_patch(friction)
        rows = forces_by_law(patch)
        description.data.update(creep=rows)
        description.parts.extend(["", tables.creep_table(patch, rows)])
        if output.folder:
            _write_creep(output, patch, rows)
    if not (output.as_json or output.quiet):
        for note in summary.notes:
            echo(note, err=True)
    output.answer(description.data, description.parts)


def _check(
    by_side: Mapping[str, Sequence[Any]], numbers: Mapping[str, Any], gauges: Sequence[float]
) -> None:
    """Refuse more values than there are sides, and numbers that mean nothing, all at once."""
    Faults(
        Fault(f"--{name}", "", f"given {len(values)} times", "give it once, or for each side")
        for name, values in by_side.items()
        if len(values) > 2
    ).check()
    faults, further = Faults(), {**by_side, "gauges": gauges}
    for name, (low, high, unit) in RANGES.items():
        for value in further[name] if name in further else [numbers[name]]:
            if not low <= value <= high:
                option, allowed = name.replace("_", "-"), f"{low:g} to {high:g} {unit}"
                faults.append(Fault(f"--{option}", "", f"found {value:.12g}", allowed))
    faults.check()


def _profiles(names: Sequence[str], kind: Any) -> tuple[Any, Any]:
    from railsim.profiles import load_profile

    loaded = {name: load_profile(name, kind) for name in dict.fromkeys(names)}
    return loaded[names[0]], loaded[names[-1]]


def _description(summary: "ContactSummary") -> "Description":
    """Return what is printed, and everything for ``--json``, SI."""
    from railsim.assessment.criteria import steering_index
    from railsim.assessment.influences import RADIUS
    from railsim.contact import tables
    from railsim.contact.gauges import gauge_table
    from railsim.description import Description

    left, right = summary.pairs
    wheels, diameter = (left.wheel, right.wheel), 2.0 * min(summary.radii)
    between = {"back_to_back": left.back_to_back, "gauge": left.gauge}
    gauge_values = gauge_table(wheels, diameter=diameter, **between)
    steering = steering_index(summary.geometry, RADIUS, min(summary.radii))
    data: dict[str, Any] = {name: values.tolist() for name, values in summary.functions.items()}
    conicities = zip(map(float, summary.amplitudes), map(float, summary.conicity), strict=True)
    data["equivalent_conicity"] = [{"amplitude": a, "value": v} for a, v in conicities]
    data["jumps"] = [{"lateral": y, "side": side} for y, side in summary.geometry.jumps()]
    data |= {"patches": summary.patches, "notes": summary.notes}
    data["gauge_values"] = gauge_values.records()
    data["steering_index"] = {"radius": RADIUS, "value": steering}
    words = f"steering index at R {RADIUS:g} m: {steering:.2f}; above 1 the flange steers too"
    functions, conicity = tables.printed_functions(summary), tables.printed_conicity(summary)
    patches = tables.patch_table(summary)
    return Description(data, [functions, "", conicity, "", gauge_values, words, "", patches])


def _write(
    output: cli.Output, summary: "ContactSummary", gauges: Any, by_gauge: Any, profile: Any
) -> None:
    """Write the tables and the pictures that there always are, over the gauge, of a profile."""
    from railsim.contact import tables
    from railsim.contact.summary import OTHER_NORMAL
    from railsim.plot import contact as plot
    from railsim.text import unformatted

    _, right = summary.pairs
    names = " / ".join(dict.fromkeys(pair.words for pair in summary.pairs))
    title, gauge = unformatted(names), f", gauge {1e3 * right.gauge:g} mm"
    contacts, load, exact = summary.contacts, summary.load, summary.exact
    other = summary.with_other_normal() if exact else None
    labels = (f"table, {summary.normal}", f"table, {OTHER_NORMAL[summary.normal]}")
    content = (
        tables.function_table(summary),
        tables.conicity_table(summary),
        tables.patch_table(summary),
        plot.profiles_figure(summary.geometry, summary.pairs),
        plot.functions_figure(summary.geometry, title + gauge),
        plot.conicity_figure({names + gauge: (summary.amplitudes, summary.conicity)}),
        plot.patches_figure(contacts, load, exact, other, labels, f", {title}"),
    )
    output.write_all(dict(zip((*TABLES, *PICTURES), content, strict=True)))
    if gauges:
        output.write(MAP[0], plot.conicity_map_figure(gauges, summary.amplitudes, by_gauge, title))
        output.write(MAP[1], tables.conicity_map_table(summary, gauges, by_gauge))
    if profile:
        of_pair = right.wheel if profile.kind == "wheel" else right.rail
        output.write(OVERLAY, plot.overlay_figure([profile, of_pair]))


def _write_creep(output: cli.Output, patch: "Patch", rows: Sequence[dict[str, Any]]) -> None:
    from railsim.contact.creep import LAWS
    from railsim.contact.creep_curves import CASES, exact_force
    from railsim.plot.creep import creep_curves_figure, traction_figure
    from railsim.table import Column, Table

    creepages = {n: FIELD_SIZE * patch.unit_creepages(way) for n, way in CASES.items()}
    fields = {case: exact_force(patch, creepage) for case, creepage in creepages.items()}
    figures = (creep_curves_figure(patch, LAWS), traction_figure(fields, patch.mu * patch.N))
    columns = [Column(name, unit="1/m" if name == "phi" else "") for name in rows[0]]
    output.write_all(dict(zip(CREEP, (*figures, Table(columns, rows)), strict=True)))


def _build_creep_table(workers: int, output: cli.Output) -> None:
    """Recompute the table of the full theory, in ``creep_table`` by default, and compare it."""
    import numpy as np

    from railsim.contact.creep_table import build_nodes, gather_nodes, shipped_nodes, write_nodes

    folder = output.folder or Path("creep_table")
    check_folder(folder, [CREEP_TABLE], overwrite=output.overwrite)
    with output.progress("creep table") as show:
        for done, count in build_nodes(folder, workers):
            show(done / count)
    nodes = gather_nodes(folder)
    write_nodes(nodes, folder / CREEP_TABLE)
    difference = float(np.abs(nodes.force - shipped_nodes().force).max())
    words = f"largest difference from the shipped table {difference:.1e} of mu N"
    output.written.append(folder / CREEP_TABLE)
    output.answer({"file": str(folder / CREEP_TABLE), "largest_difference": difference}, [words])
