"""Searches for Pareto fronts on problems whose answers are known."""

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator
from scipy.spatial.distance import cdist

from railsim.studies.search import METHODS, Surrogate, Task, Values, _promising, knee, non_dominated
from railsim.studies.sensitivity import Sensitivity, sensitivities


def zdt1(x):
    """Zitzler, Deb and Thiele (2000), problem 1 with two variables."""
    g = 1.0 + 9.0 * x[:, 1]
    return np.column_stack([x[:, 0], g * (1.0 - np.sqrt(x[:, 0] / g))])


def kursawe(x):
    """Kursawe (1991) with two variables: a front in parts, many local optima."""
    x = 10.0 * x - 5.0
    first = -10.0 * np.exp(-0.2 * np.sqrt((x**2).sum(axis=1)))
    return np.column_stack([first, (np.abs(x) ** 0.8 + 5.0 * np.sin(x**3)).sum(axis=1)])


def searched(problem, method, *, number, batch=8, seed=0, constraint=None, variables=2):
    """Return all values that a search has asked for, and the designs."""
    asked = []

    def evaluate(points):
        asked.append(points)
        x = np.vstack(asked)
        kept = np.zeros((len(x), 0)) if constraint is None else constraint(x)[:, None]
        return Values(problem(x), kept)

    m = problem(np.full((1, variables), 0.5)).shape[1]
    task = Task(evaluate, variables, m, 0 if constraint is None else 1, number, batch, seed)
    METHODS[method](task)
    designs = np.vstack(asked)
    return problem(designs), designs


@pytest.mark.parametrize(
    ("limit", "nearest"),
    [(0.7, (0.6, 0.71)), (0.3, (0.2, 0.31)), (-0.5, (0.0, 0.1))],  # the last: none is feasible
)
def test_new_designs_are_looked_for_where_linear_constraints_are_met_or_broken_least(
    limit, nearest
):
    """Both objectives improve with x0, and x0 <= limit; splines with a linear part are exact."""
    designs = np.random.default_rng(2).random((30, 2))
    objectives = np.column_stack([-designs[:, 0], -2.0 * designs[:, 0]])
    values = Values(objectives, designs[:, :1] - limit)
    found = _promising(designs, values, 4, np.random.default_rng(0))
    assert len(found) == 4
    # the last, and all that add nothing, look where nothing has been tried
    led = found[: 3 if limit > 0.0 else 1, 0]
    assert nearest[0] <= led.max() <= nearest[1]


@pytest.mark.parametrize("problem", [zdt1, kursawe])
def test_a_fifth_of_a_grid_finds_its_front(problem):
    side = np.linspace(0.0, 1.0, 20)
    grid = problem(np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2))
    indicator = pytest.importorskip("pymoo.indicators.hv")
    volume = indicator.HV(ref_point=grid.max(axis=0))  # between a front and this point
    for seed in range(3):
        values, designs = searched(problem, "surrogate", number=80, seed=seed)
        assert len(designs) == 80
        assert volume(values[non_dominated(values)]) >= 0.98 * volume(grid[non_dominated(grid)])


def sphere(x):
    """Optimum at (0.3, 0.3); on the line x + y = 1 at (0.5, 0.5)."""
    return ((x - 0.3) ** 2).sum(axis=1, keepdims=True)


# a genetic algorithm comes near an optimum, a surrogate of a parabola meets it
@pytest.mark.parametrize(
    ("method", "number", "near"),
    [("surrogate", 40, 0.002), ("nsga2", 400, 0.02), ("differential_evolution", 400, 0.02)],
)
def test_a_constraint_is_reached_and_kept(method, number, near):
    if method == "nsga2":
        pytest.importorskip("pymoo")
    values, designs = searched(
        sphere, method, number=number, batch=10, constraint=lambda x: 1.0 - x.sum(axis=1)
    )
    best = values[designs.sum(axis=1) >= 1.0].min()
    assert 0.08 <= best <= 0.08 + near  # at (0.5, 0.5); over the square it goes up to 0.98


@pytest.mark.parametrize("seed", range(4))
def test_evolution_prefers_feasible_designs_to_infeasible_ones_of_lower_objective(seed):
    """Feasible above 0.9, with objectives of 3.9 to 4; below, of -5 to -1.4."""
    points = []

    def evaluate(designs):
        points.extend(designs[:, 0].tolist())
        x = np.array(points)
        return Values(np.where(x > 0.9, 3.0 + x, 4.0 * x - 5.0)[:, None], (0.9 - x)[:, None])

    METHODS["differential_evolution"](Task(evaluate, 2, 1, 1, 400, 8, seed))
    # members that are feasible contract on the optimum at the limit
    assert min(x for x in points if x > 0.9) == pytest.approx(0.9, abs=1e-5)


def test_a_search_goes_on_where_designs_have_no_answer():
    def holes(x):
        return np.where(x[:, :1] > 0.8, np.nan, zdt1(x))

    values, _ = searched(holes, "surrogate", number=40)
    front = values[non_dominated(values)]
    assert len(front) > 5
    assert not np.isnan(front).any()
    # most of the designs are where there are answers: the holes are a fifth of the cube
    assert np.isnan(values[:, 0]).mean() < 0.3


@pytest.mark.parametrize("plateau", [np.nan, 1.0])
def test_evolution_goes_on_where_all_members_have_the_same_value_or_none(plateau):
    """As where no design of the first generation hunts, or all of them derail."""

    def hole(x):
        return np.where(sphere(x) > 0.01, plateau, sphere(x))

    values, designs = searched(hole, "differential_evolution", number=400, batch=8)
    assert (hole(designs[:8]) == plateau).all() or np.isnan(hole(designs[:8])).all()
    assert len(designs) == 400
    assert np.nanmin(values) < 0.01


def test_same_seed_same_designs():
    _, one = searched(zdt1, "surrogate", number=24)
    _, same = searched(zdt1, "surrogate", number=24)
    _, other = searched(zdt1, "surrogate", number=24, seed=1)
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_indices_of_a_sum_are_its_shares_of_the_variance():
    """x + 2 y: variances 1 to 4, no interaction (Sobol 2001); a plane is known exactly."""
    designs = np.random.default_rng(0).random((30, 2))
    values = designs @ np.array([[1.0], [2.0]])
    (found,) = sensitivities(designs, values, np.array([0.5, 0.5]), ["x", "y"], ["sum"])
    assert found.error < 1e-9
    assert found.low == pytest.approx({"x": 1.0, "y": 0.5})
    assert found.high == pytest.approx({"x": 2.0, "y": 2.5})
    # a sample of 1024 knows the shares to about a hundredth
    assert found.first == pytest.approx({"x": 0.2, "y": 0.8}, abs=0.02)
    assert found.total == pytest.approx({"x": 0.2, "y": 0.8}, abs=0.02)


def test_a_single_variable_explains_all_of_a_single_quantity():
    designs = np.linspace(0.0, 1.0, 6)[:, None]
    (found,) = sensitivities(designs, designs**2, np.array([0.5]), ["x"], ["square"])
    assert found.first == found.total == {"x": 1.0}


def test_a_surrogate_goes_through_what_is_known():
    designs = np.random.default_rng(2).random((20, 3))
    values = np.column_stack([np.sin(designs.sum(axis=1)), designs[:, 0] ** 2])
    assert Surrogate(designs, values)(designs) == pytest.approx(values, abs=1e-9)


def test_leave_one_out_errors_are_those_of_fits_without_a_design_each():
    designs = np.random.default_rng(3).random((24, 3))
    values = np.column_stack([np.sin(4.0 * designs.sum(axis=1)), 1e6 + designs[:, 0] ** 2])
    rows = np.arange(len(designs))
    missed = [Surrogate(designs[rows != i], values[rows != i])(designs[i : i + 1])[0] for i in rows]
    # over the cube: each design with the share that is nearest to it, by cells of 1/60
    cells = (np.indices((60, 60, 60)).reshape(3, -1).T + 0.5) / 60.0
    share = np.bincount(cdist(cells, designs).argmin(axis=1), minlength=24) / len(cells)
    deviation = np.sqrt(share @ (values - share @ values) ** 2)
    errors = np.sqrt(share @ (np.array(missed) - values) ** 2) / deviation
    assert Surrogate(designs, values).errors() == pytest.approx(errors, rel=0.01)


def ishigami(x):
    """Ishigami and Homma (1990), with a = 7, b = 0.1."""
    x = np.pi * (2.0 * x - 1.0)
    waves = 1.0 + 0.1 * x[:, 2] ** 4
    return (np.sin(x[:, 0]) * waves + 7.0 * np.sin(x[:, 1]) ** 2)[:, None]


@pytest.mark.parametrize("seed", range(3))
def test_designs_that_crowd_about_an_optimum_do_not_make_the_error_small(seed):
    """The surrogate of an evolution knows nothing of the rest: over the cube it is 80 % wrong."""
    _, designs = searched(ishigami, "differential_evolution", number=400, variables=3, seed=seed)
    designs = np.unique(designs, axis=0)
    model, points = (
        Surrogate(designs, ishigami(designs)),
        np.random.default_rng(9).random((4000, 3)),
    )
    true = ishigami(points)
    missed = np.sqrt(np.mean((model(points) - true) ** 2)) / true.std()
    assert missed > 0.8
    assert model.errors()[0] > 0.5 * missed


def test_many_designs_have_errors_at_once():
    """A fit for each of 800 would take most of a minute."""
    designs = np.random.default_rng(4).random((800, 2))
    assert Surrogate(designs, designs[:, :1] ** 2).errors() < 1e-2


def test_the_knee_does_not_depend_on_units():
    front = np.array([[0.0, 1.0], [0.1, 0.4], [0.5, 0.2], [1.0, 0.0]])
    assert knee(front) == knee(front * [1.0, 1e6]) == 1


def test_total_indices_of_a_product_hold_its_interaction_and_errors_are_root_mean_squares():
    """Of x1 x2 a variable alone explains 3/7 of the variance, 7/144, and 4/7 with the other one."""
    x = np.linspace(0.0, 1.0, 9)
    designs = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    values = designs.prod(axis=1, keepdims=True)
    (found,) = sensitivities(designs, values, np.array([0.5, 0.5]), ["a", "b"], ["product"])
    assert [*found.first.values()] == pytest.approx([3.0 / 7.0] * 2, abs=0.03)
    assert [*found.total.values()] == pytest.approx([4.0 / 7.0] * 2, abs=0.03)
    missed, z = [], values[:, 0]
    for i in range(len(z)):
        others = np.arange(len(z)) != i
        fit = RBFInterpolator(designs[others], z[others], kernel="thin_plate_spline", degree=1)
        missed.append(fit(designs[i : i + 1])[0] - z[i])
    # over the square: half a cell of the grid at its edges, a quarter at its corners
    side = np.array([0.5, *[1.0] * 7, 0.5]) / 8.0
    share = np.outer(side, side).ravel()
    deviation = np.sqrt(share @ (z - share @ z) ** 2)
    assert found.error == pytest.approx(np.sqrt(share @ np.square(missed)) / deviation, rel=0.01)


@pytest.mark.parametrize(
    ("error", "names", "doubt"),
    [(0.22, "ab", ""), (0.5, "ab", "25 %"), (3.0, "ab", "100 %"), (0.5, "a", "")],
)
def test_shares_of_the_variance_are_as_uncertain_as_what_the_surrogate_misses(error, names, doubt):
    """1 - R^2 of it, the mean square of its errors over the variance."""
    shares = dict.fromkeys(names, 1.0 / len(names))
    words = Sensitivity("z", shares, shares, shares, shares, error).sentence()
    end = f"; shares uncertain by {doubt})" if doubt else f"error {100.0 * error:.0f} %)"
    assert words.endswith(end)


def test_knee_counts_distances_over_the_range_of_the_front_wherever_it_lies():
    front = np.array([[0.0, 1.0], [4.0, 0.3], [10.0, 0.0]])
    for offset in (-200.0, 0.0, 100.0):
        assert knee(front + np.array([offset, 0.0])) == 1
