"""Hertz contact against exact values made by another program (`tests/data/contact/hertz.csv`)."""

import csv

import numpy as np
import pytest
from creep_curves import DATA

from railsim.contact import hertz


@pytest.fixture
def rows():
    with (DATA / "hertz.csv").open() as file:
        return list(csv.DictReader(file))


def test_hertz_agrees_with_exact_values(rows):
    def column(name):
        return np.array([float(row[name]) for row in rows])

    G, nu = 1e6 * column("G_N_per_mm2"), column("nu")
    for material in set(zip(G, nu, strict=True)):
        of_material = (material[0] == G) & (nu == material[1])
        contact = hertz(
            500.0 / column("Rx_mm")[of_material],
            500.0 / column("Ry_mm")[of_material],
            column("N_newton")[of_material],
            2.0 * material[0] * (1.0 + material[1]),
            material[1],
        )
        for found, name, scale in (
            (contact.a, "a_mm", 1e3),
            (contact.b, "b_mm", 1e3),
            (contact.approach, "approach_mm", 1e3),
            (contact.p_max, "pmax_N_per_mm2", 1e-6),
        ):
            # the reference is printed with eight digits
            np.testing.assert_allclose(scale * found, column(name)[of_material], rtol=1e-7)


def test_hertz_agrees_with_contact(rows):
    for row in rows:
        if not row["contact_a_mm"]:
            continue
        G, nu = 1e6 * float(row["G_N_per_mm2"]), float(row["nu"])
        contact = hertz(
            500.0 / float(row["Rx_mm"]),
            500.0 / float(row["Ry_mm"]),
            float(row["N_newton"]),
            2 * G * (1 + nu),
            nu,
        )
        # discretisation of the reference's 60 x 60 elements, stated beside it
        assert 1e3 * contact.approach == pytest.approx(float(row["contact_approach_mm"]), rel=1e-4)
        assert 1e-6 * contact.p_max == pytest.approx(float(row["contact_pmax_N_per_mm2"]), rel=5e-4)
