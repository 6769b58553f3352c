"""The quantities of a result, the curving study, and the first picture of README and manual.

The tests check that they are up to date, of the picture what it shows, which is in its file as a
text.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from generators.filling import fill_page, table
from railsim import Result, Settings, load_track, load_vehicle, simulate
from railsim.notation import QUANTITIES, REQUESTED, Quantity
from railsim.plot.histories import histories

DOCS = Path(__file__).parents[1]
PAGES = (DOCS.parent / "README.md", DOCS / "notation.md", DOCS / "validation" / "curving.md")
PICTURE = DOCS / "img" / "curve_r250.png"
PICTURED, SHOWN = ("dQ_over_Q0", "Y_over_Q"), (250.0, 550.0)  # quantities; m

sys.path.insert(0, str(DOCS.parent / "tests" / "reference"))
from curving_study import COACHES, MID_CURVE, RIGID, measured, published  # noqa: E402


def tables() -> dict[str, str]:
    """All tables by name."""
    studies = {coach: curving_table(coach) for coach in COACHES}
    return {"quantities": quantity_table(), "validation": short(studies["manchester"]), **studies}


def short(study: str) -> str:
    """Return the rows of the curving study that have a published value, for README."""
    rows = [line for line in study.splitlines() if "|  |  |" not in line]
    return "".join(f"{line}\n" for line in rows)


def quantity_table() -> str:
    """Table of the quantities of a result."""
    head = ("name", "symbol", "meaning", "sign", "unit", "shown", "dimensions")
    return table(head, map(_quantity_row, QUANTITIES.values()), "---")


def _quantity_row(quantity: Quantity) -> tuple[str, ...]:
    return (
        f"`{quantity.name}`",
        f"${quantity.symbol}$".replace("|", r"{\vert}"),
        quantity.long_name,
        quantity.sign,
        quantity.unit,
        quantity.shown_unit,
        ", ".join(quantity.dims),
    )


def curving_table(coach: str) -> str:
    """Comparison of one coach with the published curving study, on rigid and on elastic rails."""
    track, vehicle = load_track("curve_r250"), load_vehicle(f"coach_{coach}")
    rigid = simulate(vehicle, track.replace(support=RIGID), speed=20.0)
    deflected = Settings.model_validate({"outputs": {"track": True}})
    elastic = simulate(vehicle, track, speed=20.0, settings=deflected)
    rows = []
    for name, expected in published(coach).items():
        quantity, found = QUANTITIES[name], measured(rigid, name)
        where = "largest" if name == "dQ_over_Q0" else "mid-curve"
        difference = f"{100.0 * (found / expected - 1.0):+.1f} %"
        values = (expected, found, measured(elastic, name))
        numbers = [_digits(quantity.scale * value) for value in values]
        rows.append((f"{quantity.words}, {where}", *numbers[:2], difference, numbers[2]))
    rows += _beside(elastic)
    head = ("leading wheelset", "published", "rigid rails", "difference", "elastic rails")
    return table(head, rows)


def _beside(elastic: Result) -> list[tuple[str, ...]]:
    """What elastic rails add to the wheelset's lateral displacement: without a published value."""
    middle = int(np.argmin(np.abs(elastic["time"] - MID_CURVE)))
    left, right = elastic["rail_deflection_lateral"][middle, 0]
    aside = REQUESTED["wheelset_lateral_on_track"]
    values = (
        ("of this, half the widening of the gauge under load (mm)", 0.5 * (left - right)),
        (f"{aside.words}", measured(elastic, aside.name)),
    )
    return [(words, "", "", "", _digits(aside.scale * value)) for words, value in values]


def first_run() -> Result:
    """The run of README's first picture, as its example of one run."""
    return simulate(load_vehicle("coach_manchester"), load_track("curve_r250"), speed=20.0)


def shown(result: Result) -> str:
    """What the picture shows, in numbers: they tell whether it is up to date."""
    change, quotient = (result[name][result["distance"] > SHOWN[0]] for name in PICTURED)
    return (
        f"dQ/Q0 {100.0 * change.min():.1f} to {100.0 * change.max():.1f} %, "
        f"Y/Q {quotient.min():.2f} to {quotient.max():.2f}"
    )


def draw_first_picture() -> None:
    """Wheel load change and derailment quotient in the curve."""
    result = first_run()
    figure = histories(result, PICTURED, between=SHOWN)
    figure.savefig(PICTURE, metadata={"Description": shown(result)})


def _digits(value: float) -> str:
    return f"{value:.2f}" if abs(value) >= 1.0 else f"{value:.3f}"


PARTS = ()


def make(parts: Sequence[str]) -> None:
    """Fill the tables and draw the first picture."""
    draw_first_picture()
    makers = {name: lambda made=made: made for name, made in tables().items()}
    for page in PAGES:
        fill_page(page, makers)
