"""Constants of railway engineering that more than one part of railsim takes."""

GRAVITY = 9.81  # m/s2, as in the reference study
STANDARD_GRAVITY = 9.80665  # m/s2, the unit g (3rd General Conference on Weights and Measures)
NORMAL_GAUGE = 1.435  # m
# m, difference of a gauge that does not make it another one, with the round-off of 1.465 - 1.435
WIDENED = 0.030 + 1e-9
CANT_BASE = 1.5  # m, 2 b_0: distance of the nominal rolling circles, over which cant is measured
FASTEST = 125.0  # m/s, admissible speed that is remarked on: trains reach 100 m/s in service
