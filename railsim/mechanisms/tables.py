"""Results as tables of texts in the field's units, for the terminal and for the page."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from railsim.mechanisms.analysis import Analysis
from railsim.mechanisms.checks import Check
from railsim.mechanisms.comparison import Comparison
from railsim.mechanisms.contact import Contact, moved
from railsim.mechanisms.dynamics import driving
from railsim.mechanisms.kinematics import folded
from railsim.mechanisms.quantities import SHOWN, force_unit, quantity, shown
from railsim.mechanisms.selection import Choice
from railsim.mechanisms.summary import parameter_data, published_data
from railsim.mechanisms.tolerance import Scatter

if TYPE_CHECKING:
    from railsim.mechanisms.optimum import Optimum

Texts = tuple[list[str], list[list[str]]]


def position_table(result: Analysis) -> Texts:
    """Results at the start, in the zone and at the end."""
    rows = [("start", {k: float(v[0]) for k, v in result.output.items()})]
    rows += list(result.zone.items())
    rows += [("end", {k: float(v[-1]) for k, v in result.output.items()})]
    return value_table(result, rows)


def value_table(result: Analysis, rows: Sequence[tuple[str, dict[str, float]]]) -> Texts:
    """Rows of results by name, a column each."""
    names = list(result.output)
    header = ["at"]
    for name in names:
        unit = quantity(name, result.definition).shown
        header.append(f"{name} / {unit}" if unit else name)
    texts = []
    for row, values in rows:
        cells = []
        for name in names:
            what = quantity(name, result.definition)
            value = values[name]
            if name in result.definition.angles:
                value = float(folded(value))
            cells.append(f"{value * what.scale:.{what.digits}f}" if np.isfinite(value) else "-")
        texts.append([row, *cells])
    return header, texts


def upright(table: Texts) -> Texts:
    """A table with rows and columns exchanged, for the terminal."""
    header, rows = table
    turned = [list(column) for column in zip(header, *rows, strict=True)]
    return turned[0], turned[1:]


def parameter_table(result: Analysis) -> Texts:
    """Every parameter with its unit and where it is from."""
    definition = result.definition
    rows = [
        [name, shown(value, definition.unit_of(name), 8), definition.provenance_of(name)]
        for name, value in parameter_data(result).items()
    ]
    return ["parameter", "value", "provenance"], rows


def published_table(result: Analysis) -> Texts:
    """Results that the source prints, beside ours."""
    rows = []
    for name, both in published_data(result).items():
        unit = "N" if name.endswith("force") else "rad" if name in result.min_angles else "m"
        if name == "travel":
            unit = quantity("travel", result.definition).unit
        difference = both["ours"] / both["published"] - 1.0
        cells = [shown(both[key], unit, 8) for key in ("published", "ours")]
        rows.append([name, *cells, f"{difference:+.1e}"])
    return ["result", "published", "computed", "relative difference"], rows


def check_table(checks: Sequence[Check]) -> Texts:
    """One row for each check."""
    rows = []
    for check in checks:
        unit, scale = SHOWN.get(check.unit, (check.unit, 1.0))
        sign = {"above": ">=", "below": "<="}.get(check.sense, "about")
        rows.append(
            [
                check.name,
                f"{check.value * scale:.2f}",
                f"{sign} {check.limit * scale:.2f}",
                unit,
                "-" if check.sense == "about" else "yes" if check.ok else "NO",
            ]
        )
    return ["check", "value", "must be", "unit", "met"], rows


def selection_table(choices: Sequence[Choice]) -> Texts:
    """One row for each row of a catalogue, with the force that the mechanism then needs."""
    rows = []
    for alike in _alike(choices):
        c = alike[0]
        name = c.name if len(alike) == 1 else f"{c.name} ... {alike[-1].name} ({len(alike)} rows)"
        v = {key: f"{value:.1f}" for key, value in c.values.items() if key.startswith(("F", "f"))}
        sizes = [f"{c.values[key] * 1e3:g}" for key in ("body", "rod") if key in c.values]
        rows.append(
            [
                c.catalogue,
                name,
                "yes" if c.fits else "no",
                "; ".join(c.reasons),
                "/".join(sizes) or "-",
                f"{c.values['progression']:.2f}" if c.values else "-",
                f"{v['F1_low']} to {v['F1_high']}" if c.values else "-",
                f"{v['force_least']} to {v['force_most']}" if "force_least" in v else "-",
                f"{v['force_lowest']} to {v['force_highest']}" if "force_least" in v else "-",
            ]
        )
    header = ["catalogue", "row", "fits", "stroke, or why not", "body/rod / mm", "p", "F1 / N"]
    return [*header, "unknown force / N", "over temperature and F1 / N"], rows


def _alike(choices: Sequence[Choice]) -> list[list[Choice]]:
    """Rows in turn, those of a catalogue that do not fit for the same reason together."""
    groups: list[list[Choice]] = []
    for choice in choices:
        same = groups and not choice.fits and groups[-1][0].reasons == choice.reasons
        if same and groups[-1][0].catalogue == choice.catalogue:
            groups[-1].append(choice)
        else:
            groups.append([choice])
    return groups


def reaction_table(result: Analysis) -> Texts:
    """Largest reaction of every joint."""
    what = quantity("travel", result.definition)
    rows = [
        [name, f"{r.max:.1f}", f"{r.at * what.scale:.{what.digits}f}"]
        for name, r in result.reactions.items()
    ]
    return ["joint", "largest reaction / N", f"at {what.shown}"], rows


def sentences(result: Analysis) -> list[str]:
    """What is no table: stroke, zeros, contact force, motion."""
    travel = quantity("travel", result.definition)

    def driver(value: float) -> str:
        return f"{value * travel.scale:.4f} {travel.shown}"

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
    if result.definition.solve is None and moved(result.motion) and not result.rests:
        found.append(
            f"no position of rest from {driver(result.model.start)} to {driver(result.model.end)}"
        )
    for change in result.transitions:
        jump = change.rate_after / change.rate_before - 1.0
        found.append(
            f"{change.joint}: from arc {change.before} to {change.after} at "
            f"{driver(change.travel)}, gap {change.gap * 1e3:.4f} mm, jump of the rate "
            f"{round(jump * 100.0, 3) + 0.0:.3f} %"
        )
    if (contact := result.contact) is not None:
        found += _contact_sentences(contact)
    if (timed := result.timed) is not None:
        drives = driving(result.definition)
        unit = force_unit(drives, result.definition)
        found.append(
            f"motion in {timed.time[-1]:.3f} s: force of '{drives}' {timed.force[0]:.2f} {unit} at "
            f"first, {np.min(timed.force):.2f} to {np.max(timed.force):.2f} {unit}"
        )
    if (released := result.release) is not None:
        end = "reaches" if released.reached else "is then at"
        found.append(
            f"let go at {driver(released.s[0])} it {end} {driver(released.s[-1])} after "
            f"{released.time[-1]:.5f} s"
        )
    return found


def _force_sentence(result: Analysis, driver: Callable[[float], str]) -> str:
    """Least and largest unknown force, on the way back too where there is friction."""
    assert result.definition.solve is not None
    unit = quantity("force", result.definition).shown
    found = []
    for name, words in (("force", ""), ("force_back", "on the way back ")):
        if name in result.output:
            ends = result.extremes(name)
            low, high = (f"{force + 0.0:.2f} {unit} at" for force in (ends.least, ends.most))
            found.append(f"{words}{low} {driver(ends.least_at)} to {high} {driver(ends.most_at)}")
    largest = f"largest amount {result.peak_force:.2f} {unit}"
    return f"force of '{result.definition.solve.unknown}' {'; '.join(found)}; {largest}"


def _contact_sentences(contact: Contact) -> list[str]:
    def forces(values: Mapping[str, float]) -> str:
        return ", ".join(
            f"{name} {value:.2f} N" if np.isfinite(value) else f"{name} no value"
            for name, value in values.items()
        )

    found = [f"contact force at {contact.pressure / 1e6:.5f} MPa: {forces(contact.force)}"]
    if contact.rising != contact.falling:
        found[0] += f" (mean); rising {forces(contact.rising)}; falling {forces(contact.falling)}"
    found += [contact.reason] if contact.reason else []
    for (low, high), rest in zip(contact.heights, contact.rests, strict=True):
        word = "stable" if rest.stable else "unstable"
        height = f"{low * 1e3:.1f}" + (f" to {high * 1e3:.1f}" if rest.low < rest.high else "")
        found.append(f"rests at a height of {height} mm without contact, {word}")
    if not contact.rests and not contact.reason:
        found.append("rests nowhere within the travel without contact")
    return found


def comparison_table(comparison: Comparison) -> Texts:
    """One row for each mechanism; the first is the reference of the error."""
    scales = {
        "stroke": ("stroke / mm", 1e3, 4),
        "length_start": ("length closed / mm", 1e3, 3),
        "peak_force": ("largest force / N", 1.0, 1),
        "work_force": ("at work / N", 1.0, 1),
        "zone_spread": ("spread in the zone / %", 100.0, 2),
        "min_angle": ("least angle / deg", float(np.degrees(1.0)), 3),
    }
    rows = []
    for row in comparison.rows:
        cells = [row.name]
        for name, (_, scale, digits) in scales.items():
            value = row.values.get(name, np.nan) * scale
            cells.append(f"{value:.{digits}f}" if np.isfinite(value) else "-")
        rows.append([*cells, f"{row.error:.4g}" if np.isfinite(row.error) else "-"])
    return ["mechanism", *(title for title, _, _ in scales.values()), "error of ratio"], rows


def optimum_sentences(optimum: "Optimum") -> list[str]:
    """How the search went."""
    kept = sum(start.feasible for start in optimum.starts if np.isfinite(start.objective))
    lost = sum(not np.isfinite(start.objective) for start in optimum.starts)
    before = (
        f"{optimum.objective_before:.6g}"
        if np.isfinite(optimum.objective_before)
        else "none: the file's own parameters cannot be assembled"
    )
    found = [
        f"objective {optimum.objective:.6g}, before {before}",
        f"{len(optimum.starts)} starts with seed {optimum.seed}: {kept} keep all constraints, "
        f"{lost} could not be assembled",
    ]
    if not optimum.feasible:
        breaches = ", ".join(f"{name} by {value:.6g}" for name, value in optimum.breaches.items())
        found.append(f"no start keeps all constraints; least broken (SI): {breaches}")
    return found


def optimum_table(optimum: "Optimum") -> Texts:
    """Parameters before and after, with their bounds' names where they are active."""
    definition = optimum.definition
    own = next((start for start in optimum.starts if start.number == 0), optimum.starts[0])
    rows = [
        [
            name,
            shown(own.begin[name], definition.unit_of(name), 8),
            shown(value, definition.unit_of(name), 8),
        ]
        for name, value in optimum.parameters.items()
    ]
    return ["parameter", "before", "after"], rows


def active_table(optimum: "Optimum") -> Texts:
    """Limits that hold the optimum."""
    rows = [[a.name, a.side, f"{a.slack:.3g}", f"{a.multiplier:.4g}"] for a in optimum.active]
    return ["active limit", "side", "slack / SI", "multiplier / SI"], rows


def start_table(optimum: "Optimum") -> Texts:
    """One row for each start."""
    rows = [
        [
            str(start.number),
            f"{start.objective:.5g}" if np.isfinite(start.objective) else "not assembled",
            "yes" if start.feasible else "no",
            str(start.evaluations),
        ]
        for start in optimum.starts
    ]
    return ["start", "objective", "constraints kept", "evaluations"], rows


def scatter_table(found: Sequence[Scatter]) -> Texts:
    """One row for each result: its scatter and the parameter that matters most."""
    rows = []
    for one in found:
        unit, scale = SHOWN.get(one.unit, (one.unit, 1.0))
        worst = max(one.single, key=lambda name: abs(one.single[name]))
        rows.append(
            [
                one.name,
                f"{one.value * scale:.4f} {unit}".rstrip(),
                f"+- {one.random * scale:.4f}",
                f"+- {one.worst * scale:.4f}",
                f"{worst} ({one.single[worst] * scale:+.4f})",
            ]
        )
    return ["result", "nominal", "random", "worst case", "most by"], rows
