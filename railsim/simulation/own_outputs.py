"""Quantities of a result by laws of one's own, of other quantities at the same instant."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from railsim.arrays import Floats
from railsim.definitions.settings import Settings
from railsim.errors import Fault, InputError, nearest
from railsim.laws.binding import Takes, bind
from railsim.notation import COMPONENTS, QUANTITIES, REQUESTED, SIDES, Quantity
from railsim.result.labels import chosen_names

Place = tuple[str, tuple[Any, ...]]
"""A quantity, and the indices over all of the time."""


class OwnOutputs:
    """Laws of `settings.outputs.own`, each bound to its inputs.

    `known`: what the run outputs otherwise; `coordinates`: names along its dimensions. Raises
    InputError: an input that is not output, a law that is not permitted or cannot be compiled.
    """

    def __init__(
        self,
        settings: Settings,
        quantities: Sequence[Quantity],
        coordinates: Mapping[str, Sequence[str]],
    ) -> None:
        self._known = {quantity.name: quantity for quantity in quantities}
        self._coordinates = {"side": SIDES, "component": COMPONENTS, **coordinates}
        self._laws, self.quantities = [], []
        laws = settings.laws or {}
        for name, one in (settings.outputs.own or {}).items():
            key = f"outputs.own.{name}"
            if name in QUANTITIES or name in REQUESTED:
                raise _fault(key, "the name of a quantity of railsim", "another name")
            if one.law not in laws:
                allowed = nearest(one.law, laws) if laws else "there is none"
                raise _fault(f"{key}.law", f"no law '{one.law}'", allowed)
            places = [self._place(f"{key}.inputs.{n}", at) for n, at in one.inputs.items()]
            bound = bind(one.law, laws[one.law], Takes("an output quantity", (), tuple(one.inputs)))
            values = bound.parameters(f"{key}.parameters", one.parameters)
            self._laws.append((name, bound, places, values))
            shown = "-" if one.unit == "1" else one.unit
            words = one.words or name.replace("_", " ")
            self.quantities.append(Quantity(name, words, "", one.unit, ("time",), shown, 1.0))

    def _place(self, key: str, selection: str) -> Place:
        """Return where an input is."""
        name, *labels = selection.split(":")
        if name not in self._known:
            if name in REQUESTED:
                request = f"outputs.{REQUESTED[name].request}"
                raise _fault(key, f"'{name}' is not output", f"ask for it by {request}")
            raise _fault(key, f"no quantity '{name}'", nearest(name, self._known))
        dims = self._known[name].dims
        if dims[0] != "time":
            raise _fault(key, f"'{name}' does not change", "a quantity over time")
        try:
            names = chosen_names(dims[1:], self._coordinates, labels)
        except KeyError as error:
            found, _, allowed = str(error.args[0]).partition("; ")
            raise _fault(key, found, allowed) from None
        if [len(names.get(k, ())) for k in range(len(dims) - 1)] != [1] * (len(dims) - 1):
            raise _fault(key, f"found '{selection}'", f"one label of each: {', '.join(dims[1:])}")
        return name, (
            slice(None),
            *(list(self._coordinates[dim]).index(names[k][0]) for k, dim in enumerate(dims[1:])),
        )

    def values(self, outputs: Mapping[str, Floats]) -> tuple[dict[str, Floats], str]:
        """Return what the laws give of the other quantities, float64[time], and what is wrong.

        That is, which law gave a value that is not finite although all that it was given is; or
        empty.
        """
        found, wrong = {}, ""
        for name, bound, places, parameters in self._laws:
            given = [outputs[quantity][at] for quantity, at in places]
            rows = np.stack(given, axis=-1) if given else np.empty((len(outputs["time"]), 0))
            found[name] = bound.values(rows, parameters)
            bad = np.flatnonzero(~np.isfinite(found[name]) & np.isfinite(rows).all(axis=-1))
            if bad.size and not wrong:
                words = f"the law of output {name} gave a value that is not finite"
                wrong = f"{words} at {outputs['time'][bad[0]]:.6g} s"
        return found, wrong


def _fault(key: str, found: str, allowed: str) -> InputError:
    return InputError([Fault("settings", key, found, allowed)])
