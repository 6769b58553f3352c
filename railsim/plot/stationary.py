"""Picture of stationary tests: unloading over the twist, loading and unloading."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from railsim.linear.stationary import TwistLoop
from railsim.notation import SIDES
from railsim.plot.style import Picture, styled


@styled()
def twist_figure(loops: Mapping[str, TwistLoop], limit: float, title: str) -> Figure:
    """DQ/Q0 of the worst wheel of each twist over the twist, from both directions.

    `loops`: By the name of the twist. `limit`: Of dQ/Q0 [1].
    """
    figure = Picture(9.6, 3.8)
    figure.suptitle(title)
    panels = figure.subplots(1, max(1, len(loops)), sharey=True, squeeze=False)[0]
    for panel, (name, loop) in zip(panels, loops.items(), strict=False):
        wheelset, side = loop.worst
        way = np.append(0.0, loop.share) if len(loop.share) > 2 else loop.share
        unloading = loop.unloading[:, wheelset, side]
        values = np.append(0.0, unloading) if len(loop.share) > 2 else unloading
        panel.plot(100.0 * way, values, "o-", ms=2.5)
        panel.axhline(limit, color="0.3", ls="--", lw=0.8)
        panel.axhline(0.0, color="0.6", lw=0.6, zorder=0)
        panel.set(title=f"{name},\nwheelset {wheelset + 1} {SIDES[side]}")
        panel.set(xlabel="of the twist (%)")
    panels[0].set_ylabel("$(Q_0 - Q)/Q_0$")
    return figure
