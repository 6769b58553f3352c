"""Labels along the dimensions of a result: names, and for wheelsets numbers.

Texts and tables number wheelsets from 1, from the leading end; integers and arrays count from 0.
"""

from collections.abc import Mapping, Sequence

from railsim.errors import nearest


def known_labels(dim: str, names: Sequence[str]) -> dict[str, int]:
    """Return the indices of all texts that name a place along a dimension.

    >>> known_labels("wheelset", ["front", "rear"])
    {'1': 0, '2': 1, 'front': 0, 'rear': 1}
    """
    numbers = range(1, len(names) + 1) if dim == "wheelset" else ()
    return {str(number): number - 1 for number in numbers} | {n: k for k, n in enumerate(names)}


def index_of(dim: str, names: Sequence[str], label: str | int) -> int:
    """Return the index of a label, a text or an integer from 0; KeyError: there is no such one."""
    if isinstance(label, str):
        indices = known_labels(dim, names)
        if label not in indices:
            raise KeyError(f"no {dim} '{label}'; {nearest(label, indices)}")
        return indices[label]
    if not -len(names) <= label < len(names):
        raise KeyError(f"no {dim} {label}; 0 to {len(names) - 1}, or a name")
    return int(label)


def all_labels(
    dims: Sequence[str], coordinates: Mapping[str, Sequence[str]]
) -> dict[str, tuple[str, str]]:
    """Return dimension and name of all texts that name a place along some dimensions."""
    rows = ((dim, coordinates[dim], known_labels(dim, coordinates[dim])) for dim in dims)
    return {label: (dim, names[k]) for dim, names, index in rows for label, k in index.items()}


def chosen_names(
    dims: Sequence[str], coordinates: Mapping[str, Sequence[str]], labels: Sequence[str]
) -> dict[int, list[str]]:
    """Return the names that labels choose, by the number of their dimension.

    Raises KeyError: a label that is not known.
    """
    places = all_labels(dims, coordinates)
    chosen: dict[int, list[str]] = {}
    for label in labels:
        if label not in places:
            raise KeyError(f"no label '{label}'; {nearest(label, places)}")
        dim, name = places[label]
        chosen.setdefault(dims.index(dim), []).append(name)
    return chosen
