"""Tables of a result: its peaks, and its values in full curves."""

from collections.abc import Sequence

from railsim.notation import Quantity
from railsim.result.data import Result
from railsim.result.extremes import MidCurve, mid_curves, peaks
from railsim.table import Amount, Column, Table

KINDS = {"abs": "", "max": ", largest", "min": ", smallest"}
MOST_CURVES = 3  # curves with a table each; more are listed, one line each
PLACE = [Column("time", "t", "s", ".2f"), Column("distance", "s", "m", ".1f")]
"""When, and where the reference body was."""


def peak_table(result: Result) -> Table:
    """Return the peaks of a result: value, and after a low pass of 20 Hz."""
    rows = []
    for peak in peaks(result):
        column = Column.of(peak.quantity)
        text = f"{peak.quantity.words}{KINDS[peak.kind]}"
        name = peak.labels.get("wheelset", "")
        wheelset = f"{result.wheelsets.index(name) + 1} {name}" if name else ""
        smooth = None if peak.smooth is None else Amount(peak.smooth, column)
        cells = wheelset, peak.labels.get("side", ""), Amount(peak.value, column)
        rows.append([peak.quantity.name, text, *cells, smooth, peak.time, peak.distance])
    heads = Column("quantity", "Peaks"), Column("words", "largest magnitude")
    values = Column("value", format=">"), Column("low_pass_20_hz", "20 Hz", format=">")
    return Table([*heads, "wheelset", "side", *values, *PLACE], rows)


def full_curve_table(result: Result, curve: MidCurve) -> Table:
    """Return medians and scatter of every wheel over a full curve."""
    rows = []
    for name, values in curve.medians.items():
        quantity, spread = result.quantities[name], curve.scatter[name]
        sides = result.coordinates["side"] if values.ndim == 2 else ("",)
        by_side = zip(sides, values.T.reshape(len(sides), -1), strict=True)
        for (side, medians), around in zip(by_side, spread.T.reshape(len(sides), -1), strict=True):
            cells = map(_with_scatter, [quantity] * len(medians), medians, around)
            rows.append([name, quantity.words, side, *cells])
    begin, end = curve.full_curve
    around_words = "median, ± still settling" if curve.settling else "median and scatter"
    place = f"s = {begin:.1f} to {end:.1f} m: {around_words}"
    if begin == end:
        place = f"shorter than the vehicle, at its middle, s = {begin:.1f} m: values there"
    title = f"Full curve R {curve.radius:.6g} m, {place}"
    numbers = [Column(str(index + 1), format=">") for index in range(len(result.wheelsets))]
    columns = [Column("quantity", " "), Column("words", "wheelset"), Column("side")]
    return Table([*columns, *numbers], rows, title)


def _with_scatter(quantity: Quantity, value: float, scatter: float) -> str:
    """Return a value with its scatter, where there is any to the digits that are shown."""
    around = quantity.text(scatter)
    zero = around == "nan" or float(around) == 0.0
    return quantity.text(value) + ("" if zero else f" ± {around}")


def full_curves_table(result: Result, curves: Sequence[MidCurve]) -> Table:
    """Return one line for each curve: the largest median of each quantity over all wheels."""
    names = list(curves[0].medians)
    rows = []
    for curve in curves:
        largest = {peak.quantity.name: peak.value for peak in curve.median_peaks}
        begin, end = curve.full_curve
        ends = f"{curve.radius:.6g} m", f"{begin:.1f} to {end:.1f}"
        rows.append([*ends, *map(largest.get, names)])
    heads = (
        Column("radius", "Full curves, largest medians"),
        Column("distance", "s (m)", format=">"),
    )
    return Table([*heads, *(Column.of(result.quantities[n], n) for n in names)], rows)


def result_parts(result: Result, remarks: Sequence[str] = ()) -> list[str | Table]:
    """Return how a run ended, `remarks`, its peaks and its values in curves: lines and tables."""
    facts = result.attributes
    end = f"{result.status}: {facts['status_reason']}"
    if len(result["time"]):
        end += (
            f"; last output at t = {result['time'][-1]:.3f} s, s = {result['distance'][-1]:.2f} m"
        )
    else:
        end += "; at its start, before the first instant was recorded"
    parts: list[str | Table] = [
        f"  {end}",
        f"  step {1e3 * float(facts['step']):.4g} ms; {facts['cpu_time']:.2f} s of CPU time in the "
        f"loop, {facts['real_time_factor']:.0f} x real time; {facts['wall_time']:.1f} s altogether",
        *(f"  remark: {remark}" for remark in remarks),
        "",
    ]
    if len(result["time"]):
        parts.append(peak_table(result))
    curves = mid_curves(result)
    if len(curves) > MOST_CURVES:
        parts += ["", full_curves_table(result, curves)]
    else:
        for curve in curves:
            parts += ["", full_curve_table(result, curve)]
    return parts
