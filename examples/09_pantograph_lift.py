"""Which force does the lift of a pantograph need over the height?

Three lifts of the ATR95 pantograph: ratio of the linkage and force of the lift over the height of
the head. The first lift is the reference; the working range is shaded, the dashed line is the
working height.
"""

import railsim
from railsim.mechanisms.analysis import analyse
from railsim.plot.mechanisms import comparison_figure
from railsim.plot.style import save

results = {}
for number in (1, 4, 5):
    mechanism = railsim.load_mechanism(f"atr95_lift_{number}")
    results[f"lift {number}"] = analyse(mechanism)

for name, result in results.items():
    middle = result.at("height", 0.9)
    print(name, {key: middle[key] for key in ("ratio", "force") if key in middle})

figure = comparison_figure(results)
save(figure, "09_pantograph_lift.png", overwrite=True)
