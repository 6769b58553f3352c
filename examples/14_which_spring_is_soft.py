"""Which spring is soft?

The same run, and four numbers of the coach that may be off: stiffnesses of the primary and
secondary springs, both vertical dampers. Least squares over all channels between 0.5 and 15 Hz find
the factor of each on the value of the file, with its 95 % interval: the run was made with 0.80 of
the primary spring and 0.85 of the secondary damper. Residuals of the floor that are not white come
from its sensors, which are mounted at an angle. The picture shows the channels before and after.
"""

import railsim
from railsim.plot.style import save
from railsim.plot.validation import fits

measured = railsim.load_measurement("coach_25t_run").part(0.0, 450.0)

found = railsim.identify(
    "coach_25t",
    measured,
    [
        "coil_spring.stiffness.z",
        "primary_vertical_damper.damper_table",
        "secondary_spring.stiffness.z",
        "secondary_vertical_damper.damper_table",
    ],
    band=(0.5, 15.0),
    workers=1,
)
print(found.table())
print(found.residual_table())
print(*found.unidentified, *found.remarks, sep="\n")

figure = fits(found)
save(figure, "14_which_spring_is_soft.png", overwrite=True)
