"""Results as tables and sentences in the field's units, for terminal, notebook and page."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from railsim.definitions.mechanism.faults import bounds_of, bounds_remarks
from railsim.design_checks import NEAR_BOUND, check_table, shown_unit, with_unit
from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import checks
from railsim.mechanisms.comparison import compare
from railsim.mechanisms.contact import Contact, is_loaded
from railsim.mechanisms.dynamics import NEAR, driving_actuator
from railsim.mechanisms.kinematics import folded
from railsim.mechanisms.quantities import force_unit, force_units, quantity
from railsim.mechanisms.selection import Choice, selection
from railsim.mechanisms.summary import parameter_data, published_data
from railsim.mechanisms.tolerance import Scatter, scatter
from railsim.table import Amount, Column, Table

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum

COMPARISON = [
    Column("name", "mechanism"),
    Column("stroke", "", "mm", ".4f"),
    Column("length_start", "length closed", "mm", ".3f"),
    Column("peak_force", "largest force", "N", ".1f"),
    Column("work_force", "force at work", "N", ".1f"),
    Column("zone_spread", "spread in the zone", "%", ".2f"),
    Column("min_angle", "least angle", "deg", ".3f"),
    Column("error", "error of ratio", "", ".4g"),
]
SELECTION = [
    Column("catalogue"),
    Column("row"),
    Column("fits"),
    Column("reasons", "stroke, or why not"),
    Column("sizes", "body/rod (mm)", format=">"),
    Column("progression", "p", "", ".2f"),
    Column("F1", "F1 (N)", format=">"),
    Column("force", "unknown force (N), torque (N m)", format=">"),
    Column("extreme", "over temperature and F1", format=">"),
]


def position_table(result: Analysis) -> Table:
    """Return results at the start, in the zone and at the end; a row for each of them."""
    first, last = ({k: v[row] for k, v in result.output.items()} for row in (0, -1))
    return value_table(result, [("start", first), *result.zone.items(), ("end", last)])


def value_table(result: Analysis, positions: Sequence[tuple[str, Mapping[str, Any]]]) -> Table:
    """Return a row for each result and a column for each of some positions."""
    definition, rows = result.definition, []
    for name in result.output:
        column = quantity(name, definition)
        unit = f" ({column.unit})" if column.unit else ""
        values = [folded(v[name]) if name in definition.angles else v[name] for _, v in positions]
        rows.append([f"{name}{unit}", *(Amount(float(value), column) for value in values)])
    return Table(["at", *(Column(where, format=">") for where, _ in positions)], rows)


def parameter_table(result: Analysis) -> Table:
    """Return every parameter with its unit and where it is from."""
    definition = result.definition
    rows = [
        [name, with_unit(value, definition.unit_of(name), 8), definition.provenance_of(name)]
        for name, value in parameter_data(result).items()
    ]
    return Table(["parameter", Column("value", format=">"), "provenance"], rows)


def published_table(result: Analysis) -> Table:
    """Return results that the source prints, beside the computed ones."""
    rows = []
    for name, both in published_data(result).items():
        unit = "rad" if name in result.min_angles else "m"
        if name in ("travel", "max_force", "min_force"):
            unit = quantity(name.rpartition("_")[2], result.definition).si_unit
        cells = [with_unit(both[key], unit, 8) for key in ("published", "ours")]
        difference = both["ours"] / both["published"] - 1.0 if both["published"] else None
        rows.append([name, *cells, difference])
    numbers = [Column("published", format=">"), Column("computed", format=">")]
    return Table(["result", *numbers, Column("relative difference", format="+.1e")], rows)


def selection_table(choices: Sequence[Choice]) -> Table:
    """Return a row for each row of a catalogue; neighbours that fail for one reason share one."""
    rows = []
    for _, (first, *others) in groupby(choices, lambda c: id(c) if c.fits else replace(c, name="")):
        v, name = first.values, first.name
        if others:
            name = f"{name} ... {others[-1].name} ({len(others) + 1} rows)"
        row: dict[str, Any] = {
            "catalogue": first.catalogue, "row": name, "fits": "yes" if first.fits else "no",
            "reasons": "; ".join(first.reasons),
            "sizes": "/".join(f"{v[k] * 1e3:g}" for k in ("body", "rod") if k in v) or "-",
            "progression": v.get("progression", np.nan),
        }  # fmt: skip
        for column, low, high in (
            ("F1", "F1_low", "F1_high"),
            ("force", "force_least", "force_most"),
            ("extreme", "force_lowest", "force_highest"),
        ):
            ends = dict.fromkeys(f"{v[end]:.1f}" for end in (low, high) if end in v)
            row[column] = " to ".join(ends) or "-"
        rows.append(row)
    return Table(SELECTION, rows)


def reaction_table(result: Analysis) -> Table:
    """Return the largest reaction of every joint."""
    travel = quantity("travel", result.definition)
    largest = Column("largest reaction", unit="N", format=".1f")
    at = Column("at", "at the driver", travel.unit, travel.format)
    rows = [[name, r.max, r.at] for name, r in result.reactions.items()]
    return Table(["joint", largest, at], rows, "Reactions")


def sentences(result: Analysis) -> list[str]:
    """What is no table: stroke, zeros, contact force, motion."""
    travel = quantity("travel", result.definition)

    def driver(value: float) -> str:
        return f"{value * travel.scale:.4f} {travel.unit}"

    found = []
    if "length" in result.output:
        stroke = f"stroke {result.stroke * 1e3:.4f} mm"
        found.append(f"{stroke} over a travel of {driver(result.travel)}")
    if "force" in result.output:
        found.append(_force_sentence(result, driver))
    if result.force_zeros:
        found.append(f"force zero at {', '.join(driver(s) for s in result.force_zeros)}")
    for rest in result.rests:
        where = driver(rest.at)
        if rest.low < rest.high:
            where = f"{driver(rest.low)} to {driver(rest.high)} (friction)"
        found.append(f"at rest at {where}, {'stable' if rest.stable else 'unstable'}")
    if result.definition.solve is None and is_loaded(result.motion) and not result.rests:
        found.append(
            f"no position of rest from {driver(result.model.start)} to {driver(result.model.end)}"
        )
    for change in result.transitions:
        before, after = change.rate_before, change.rate_after
        jump = (after - before) / (max(abs(before), abs(after)) or 1.0)
        arcs = f"from arc {change.before} to {change.after} at {driver(change.travel)}"
        sizes = f"gap {change.gap * 1e3:.4f} mm, jump of the rate {jump * 100.0:z.3f} %"
        found.append(f"{change.joint}: {arcs}, {sizes}")
    if result.contact is not None:
        found += _contact_sentences(result.contact)
    if (timed := result.timed) is not None:
        drives = driving_actuator(result.definition)
        unit = force_unit(drives, result.definition)
        low, high = f"{np.min(timed.force):.2f}", f"{np.max(timed.force):.2f} {unit}"
        first = f"force of '{drives}' {timed.force[0]:.2f} {unit} at first"
        found.append(f"motion in {timed.time[-1]:.3f} s: {first}, {low} to {high}")
    if (released := result.release) is not None:
        end = "reaches" if released.reached else "is then at"
        where = f"{end} {driver(released.s[-1])} after {released.time[-1]:.5f} s"
        first_end, last_end = sorted((result.model.start, result.model.end))
        beyond = np.maximum(first_end - released.s, released.s - last_end)
        if beyond.max() > NEAR:
            where += f"; it leaves the travel, up to {driver(released.s[np.argmax(beyond)])}"
        found.append(f"let go at {driver(released.s[0])} it {where}")
    return found


def _force_sentence(result: Analysis, driver: Callable[[float], str]) -> str:
    """Least and largest unknown force, on the way back too where there is friction."""
    unit = quantity("force", result.definition).unit
    found = []
    for name, words in (("force", ""), ("force_back", "on the way back ")):
        if name in result.output:
            ends = result.extremes(name)
            low, high = (f"{force:z.2f} {unit} at" for force in (ends.least, ends.most))
            found.append(f"{words}{low} {driver(ends.least_at)} to {high} {driver(ends.most_at)}")
    largest = f"largest amount {result.peak_force:.2f} {unit}"
    return f"force of '{result.definition.unknown}' {'; '.join(found)}; {largest}"


def _contact_sentences(contact: Contact) -> Iterator[str]:
    def forces(values: Mapping[str, float]) -> str:
        return ", ".join(
            f"{name} {value:.2f} N" if np.isfinite(value) else f"{name} no value"
            for name, value in values.items()
        )

    mean = f"contact force at {contact.pressure / 1e6:.5f} MPa: {forces(contact.force)}"
    if contact.rising != contact.falling:
        mean += f" (mean); rising {forces(contact.rising)}; falling {forces(contact.falling)}"
    yield mean
    if contact.reason:
        yield contact.reason
    for rest in contact.rests:
        word = "stable" if rest.stable else "unstable"
        end = f" to {rest.high * 1e3:.1f}" if rest.low < rest.high else ""
        yield f"rests at a height of {rest.low * 1e3:.1f}{end} mm without contact, {word}"
    if not contact.rests and not contact.reason:
        yield "rests nowhere within the travel without contact"


def comparison_table(results: Sequence[Analysis]) -> Table:
    """Return one row for each mechanism; the first is the reference of the error."""
    unknown = {column.name: np.nan for column in COMPARISON}
    unit = force_units(one.definition for one in results)
    columns = [replace(one, unit=unit) if one.unit == "N" else one for one in COMPARISON]
    return Table(columns, [{**unknown, **row} for row in compare(results)])


def optimum_sentences(optimum: "Optimum") -> list[str]:
    """How the search went."""
    assembled = [start for start in optimum.starts if np.isfinite(start.objective)]
    before = "none: the file's own parameters cannot be assembled"
    if np.isfinite(optimum.objective_before):
        broken = "" if optimum.feasible_before else ", which breaks constraints"
        before = f"{optimum.objective_before:.6g}{broken}"
    written = optimum.definition.with_parameters(optimum.own)
    found = [
        f"objective {optimum.objective:.6g}, before {before}",
        f"{len(optimum.starts)} starts with seed {optimum.seed}: "
        f"{sum(start.feasible for start in assembled)} keep all constraints, "
        f"{len(optimum.starts) - len(assembled)} could not be assembled",
        *(f"{remark.key}: {remark.text}" for remark in bounds_remarks(written)),
    ]
    for name, low, high in bounds_of(written):
        end = optimum.parameters[name]
        share = min(end - low, high - end) / (high - low)
        if share <= NEAR_BOUND and name not in (active.name for active in optimum.active):
            found.append(f"{name} ends {share:.1%} of its range from a bound that does not hold it")
    if not optimum.feasible:
        angles = optimum.after.min_angles
        breaches = ", ".join(
            f"{name} by {with_unit(value, 'rad') if name in angles else f'{value:.6g}'}"
            for name, value in optimum.breaches.items()
        )
        found.append(f"no start keeps all constraints; least broken (SI): {breaches}")
    return found


def optimum_tables(optimum: "Optimum") -> list[Table]:
    """Return parameters before and after, limits that hold the optimum, and the starts."""
    unit_of = optimum.definition.unit_of
    changed = [
        [name, with_unit(optimum.own[name], unit_of(name), 8), with_unit(value, unit_of(name), 8)]
        for name, value in optimum.parameters.items()
    ]
    number = Column("slack", "slack (SI)", format=".3g")
    multiplier = Column("multiplier", "multiplier (SI)", format=".4g")
    limits = [Column("active limit"), Column("side"), number, multiplier]
    starts = []
    for s in optimum.starts:
        ended = s.objective if np.isfinite(s.objective) else "not assembled"
        starts.append([s.number, ended, "yes" if s.feasible else "no", s.evaluations])
    first, last = Column("start", format="d"), Column("evaluations", format="d")
    columns = [first, Column("objective", format=".5g"), Column("constraints kept"), last]
    before_after = [Column("before", format=">"), Column("after", format=">")]
    active = Table(limits, [list(vars(a).values()) for a in optimum.active])
    found = [Table(["parameter", *before_after], changed), active, Table(columns, starts)]
    return [table for table in found if len(table)]


def parts_of(
    results: Sequence[Analysis],
    values_at: Sequence[Sequence[Mapping[str, Any]]],
    optimum: "Optimum | None" = None,
) -> list[str | Table]:
    """Return sentences and tables on some mechanisms, or on the optimum of one.

    `values_at`: For each mechanism its results where one of them has a value, ``where`` in words.
    """
    parts: list[str | Table] = []
    if optimum is not None:
        parts += [*optimum_sentences(optimum), ""]
        parts += [part for table in optimum_tables(optimum) for part in (table, "")]
    for number, (result, values) in enumerate(zip(results, values_at, strict=True)):
        parts += [*[""] * (number > 0), *_result_parts(result, values)]
    return [*parts, "", comparison_table(results)] if len(results) > 1 else parts


def _result_parts(result: Analysis, values_at: Sequence[Mapping[str, Any]]) -> list[str | Table]:
    definition = result.definition
    case = f", case {result.case}" if result.case else ""
    parts: list[str | Table] = [f"{definition.name}{case}", "", position_table(result), ""]
    if values_at:
        parts += [value_table(result, [(values["where"], values) for values in values_at]), ""]
    parts += sentences(result)
    tables = (
        reaction_table(result),
        published_table(result),
        check_table(checks(result)),
        selection_table(selection(result)),
        scatter_table(scatter(definition) if definition.tolerances else []),
    )
    return parts + [part for table in tables if len(table) for part in ("", table)]


def scatter_table(scatters: Sequence[Scatter]) -> Table:
    """Return one row for each result: its scatter and the parameter that matters most."""
    rows = []
    for result in scatters:
        scaled = abs(result.worst) * Column("", unit=shown_unit(result.unit)).scale
        before = int(np.floor(np.log10(scaled))) if scaled else 0
        # four digits of the scatter, four decimals at most
        decimals = min(max(3 - before, 0), 4)
        column = Column("", unit=shown_unit(result.unit), format=f".{decimals}f")
        most = max(result.single, key=lambda name: abs(result.single[name]))
        values = [Amount(value, column) for value in (result.value, result.random, result.worst)]
        change = f"{result.single[most] * column.scale:+{column.format}}"
        name = f"{result.name} ({column.unit})" if column.unit else result.name
        rows.append([name, *values, f"{most} ({change})" if result.single[most] else "-"])
    numbers = [Column(name, format=">") for name in ("nominal", "RSS, ±", "worst case, ±")]
    return Table(["result", *numbers, "most by"], rows)
