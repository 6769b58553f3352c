"""Tables of a mechanism's results."""

from railsim.mechanisms.selection import Choice
from railsim.mechanisms.tables import selection_table


def choice(name, fits=False, reasons=("stroke too short",)):
    return Choice("catalogue", name, fits, reasons, {})


def test_neighbours_that_do_not_fit_for_the_same_reason_share_a_row():
    long = ("too long",)
    fitting = [choice(name, True, ()) for name in "cd"]
    choices = [choice("a"), choice("b"), *fitting, *(choice(name, reasons=long) for name in "efg")]
    rows = selection_table(choices).records()
    assert [row["row"] for row in rows] == ["a ... b (2 rows)", "c", "d", "e ... g (3 rows)"]
    assert [row["fits"] for row in rows] == ["no", "yes", "yes", "no"]
