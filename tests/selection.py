"""Which points of a grid always run.

The others, and long checks beside shorter ones of the same thing, carry the mark ``further``:
``tests/check --all`` runs them too.
"""

import pytest


def points(names, values, always, **options):
    """``pytest.mark.parametrize`` whose values at the indices `always` run every time.

    Parameters
    ----------
    names : str or tuple of str
        One name, or the names of each value's parts.
    values : sequence
        Points of the grid.
    always : sequence of int
        Indices of those that run without ``--all``.
    **options
        Of ``pytest.mark.parametrize``.
    """
    one = isinstance(names, str)
    chosen = [
        pytest.param(
            *((value,) if one else value), marks=() if i in always else pytest.mark.further
        )
        for i, value in enumerate(values)
    ]
    return pytest.mark.parametrize(names, chosen, **options)
