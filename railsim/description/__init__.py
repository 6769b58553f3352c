"""What an input file or a result holds: tables for people, plain values for programs.

`vehicles`, `tracks`, `design_files` one subject each; `rest` a vehicle at rest.

>>> import railsim
>>> railsim.describe(railsim.load_track("curve_r250")).data["length"]
980.0
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

from railsim.definitions import Track, Vehicle
from railsim.definitions.file_definition import FileDefinition
from railsim.description.tracks import describe_track
from railsim.description.values import Description
from railsim.description.vehicles import describe_vehicle
from railsim.table import Table

if TYPE_CHECKING:
    from railsim.definitions.study.definition import Study
    from railsim.result import Result

__all__ = ["Description", "describe"]


def describe(item: "FileDefinition | Result", speeds: Sequence[float | str] = ()) -> Description:
    """Return what a vehicle, track, spring, mechanism, study, settings or result holds.

    Parameters
    ----------
    item
        Definition or result.
    speeds : sequence of float or str
        Of a track: speeds for which the cant deficiency in its curves is given [m/s], or texts with
        units.
    """
    if not isinstance(item, FileDefinition):
        return _result(item)
    if isinstance(item, Track):
        return describe_track(item, speeds)
    if isinstance(item, Vehicle):
        return describe_vehicle(item)
    data = {"kind": item.KIND, **item.model_dump()}
    if item.KIND in ("spring", "mechanism"):
        from railsim.description.design_files import PARTS

        return Description(data, PARTS[item.KIND](item))
    if item.KIND == "study":
        study = cast("Study", item)
        data = {"kind": "study", "runs": study.runs, **study.model_dump(exclude_none=True)}
        runs_text = f"{study.runs} run{'s' * (study.runs != 1)}"
        if study.optimise:
            runs_text = f"up to {study.optimise.evaluations} designs, {runs_text} each"
        return Description(data, [f"{study.name}: {runs_text}", "", study.to_toml().rstrip()])
    return Description(data, [item.to_toml().rstrip()])


def _result(result: "Result") -> Description:
    """Return what a result holds, without its arrays."""
    if not hasattr(result, "attributes"):
        raise TypeError(f"found {result!r}; give what railsim.load_... or open_result returns")
    inputs = ("vehicle_toml", "track_toml", "settings_json")
    attributes = {k: v for k, v in result.attributes.items() if k not in (*inputs, "remarks")}
    coordinates = {name: list(labels) for name, labels in result.coordinates.items()}
    # by the dimensions: the arrays of a long run are not read for their shapes
    lengths = {"time": len(result["time"])} | {dim: len(n) for dim, n in coordinates.items()}
    quantities: dict[str, dict[str, Any]] = {
        name: {
            "dims": quantity.dims,
            "shape": tuple(lengths[dim] for dim in quantity.dims),
            "unit": quantity.unit,
        }
        for name, quantity in result.quantities.items()
    }
    remarks = list(result.remarks)
    data = {"kind": "result", "attributes": attributes, "remarks": remarks}
    data |= {"coordinates": coordinates, "quantities": quantities}
    items = ((name, *q.values()) for name, q in quantities.items())
    rows = [[n, ", ".join(dims), " x ".join(map(str, size)), unit] for n, dims, size, unit in items]
    return Description(
        data,
        [
            *(f"{name:18} {value}" for name, value in attributes.items()),
            *(f"{'remark':18} {remark}" for remark in remarks),
            "",
            *(f"{name:18} {', '.join(labels)}" for name, labels in coordinates.items()),
            "",
            Table(["quantity", "dimensions", "shape", "unit"], rows),
        ],
    )
