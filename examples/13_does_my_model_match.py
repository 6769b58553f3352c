"""Does my model match?

The run of `measured_run/` stands for a test: wheel forces of the leading wheelset and accelerations
of a coach on a line with two curves. The shipped coach is simulated over the same line, and section
values stand against the limits of EN 14363 Annex T: simulated over measured, with the limit of the
mean (dashed). The model matches, although one of its springs is 20 % off: the next
example finds it.
"""

import railsim
from railsim.identification.runs import simulated_run
from railsim.plot.style import save
from railsim.plot.validation import scatter

measured = railsim.load_measurement("coach_25t_run")
result = simulated_run(measured, railsim.load_vehicle("coach_25t"))

found = railsim.validate_model(measured, result)
print(found)
print(*found.remarks, sep="\n")

figure = scatter(found)
save(figure, "13_does_my_model_match.png", overwrite=True)
