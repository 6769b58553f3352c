"""What of a run's peaks is left in what is stored of it.

The time loop looks at every step; a result holds some of them, perhaps filtered.  Where that costs
a good part of a peak, a remark says how much.
"""

from collections.abc import Callable, Mapping

import numpy as np

from railsim.arrays import Floats
from railsim.notation import QUANTITIES
from railsim.result.data import Attributes
from railsim.result.sinks import Sink, SinkBefore

LOOKED_AT = ("Q", "Y", "sum_Y")
LOST, LEAST = 0.05, 1e3  # share of a peak, and force [N], that are worth a remark


class StoredPeaks(SinkBefore):
    """Hands everything on, and remembers the largest magnitudes of what tables of peaks list.

    `evaluation`: When the part of the run begins that is evaluated [s]; until then all counts.
    `largest`: Largest magnitudes of the quantities in `LOOKED_AT` so far [SI]. `remark`: Returns
    at the end what there is to remark on, or nothing, from whether that part has begun.
    """

    def __init__(self, sink: Sink, evaluation: float) -> None:
        super().__init__(sink)
        self._evaluation, self._evaluates = evaluation, False
        self.largest: dict[str, float] = {}
        self.remark: Callable[[bool], str] = lambda _: ""

    def append(self, chunk: Mapping[str, Floats]) -> None:
        """See `Sink.append`."""
        time, first = chunk["time"], 0
        if len(time) and time[-1] > self._evaluation:
            first = int(np.searchsorted(time, self._evaluation - 1e-9))
            if not self._evaluates:
                self.largest.clear()
            self._evaluates = True
        for name in LOOKED_AT:
            if name in chunk and len(time):
                most = float(np.abs(chunk[name][first:]).max())
                self.largest[name] = max(self.largest.get(name, 0.0), most)
        self._sink.append(chunk)

    def _finish(self, attributes: Attributes) -> Attributes:
        remark = self.remark(self._evaluates)
        remarks = "\n".join(filter(None, [str(attributes.get("remarks", "")), remark]))
        return {**attributes, "remarks": remarks}


def lost_peak(
    stored: Mapping[str, float], step_peaks: Mapping[str, Floats], outputs: str, *, filtered: bool
) -> str:
    """Sentence on the peak of which most is lost in what is stored; empty where none loses much.

    `stored`: Largest magnitudes in what is stored. `step_peaks`: Largest and smallest values over
    all steps, both of the part that is evaluated. `outputs`: How often is stored, in words.
    `filtered`: Whether what is stored is filtered; then its peaks are those that tables list.

    >>> words = lost_peak({"Q": 80e3}, {"Q": np.array([100e3, 0.0])}, "20 per s", filtered=False)
    >>> words.split(": ")[0], words.split("; ")[1]
    ('Between two outputs (20 per s) forces peak', 'tables of peaks list the former.')
    """
    whole = {name: float(np.nanmax(np.abs(step_peaks[name]))) for name in stored}
    lost = [name for name in stored if whole[name] - stored[name] > LEAST]
    shares = {name: 1.0 - stored[name] / whole[name] for name in lost}
    name = max(shares, key=lambda name: shares[name], default="")
    if not name or shares[name] <= LOST:
        return ""
    quantity, percent = QUANTITIES[name], f"{100.0 * shares[name]:.0f} %"
    steps, rest = (f"{quantity.text(v)} {quantity.shown_unit}" for v in (whole[name], stored[name]))
    if filtered:
        return (
            f"The low pass takes {percent} off the largest {name}: {steps} over all steps, {rest} "
            "in what is stored; tables of peaks list the latter."
        )
    return (
        f"Between two outputs ({outputs}) forces peak: the largest {name} is {steps} over all "
        f"steps, {rest} in the stored histories, {percent} less; tables of peaks list the former."
    )
