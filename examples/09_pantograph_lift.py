"""Which lift gives a pantograph a constant contact force?

The ATR95 pantograph with three of its lift mechanisms, all on the same air spring: ratio of the linkage and force
over the height of the head, the first one as the reference.
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
