"""Does the vehicle pass?

EN 14363 takes percentiles of filtered quantities in many test sections of four zones. One curve
gives a few sections of one zone: a first look, far from an assessment, and the verdict says so:
`incomplete`. The bars are the estimates in per cent of their limits.
"""

import railsim
from railsim.plot.assessment import assessment_figure
from railsim.plot.style import save

coach = railsim.load_vehicle("coach_manchester")
zone4 = railsim.load_track("en14363_zone4")
settings = railsim.Settings().with_values(
    {
        "output_rate": 200.0,
        "outputs.low_pass": {"frequency": 80.0},
        "outputs.quantities": ["Q", "Y", "wheelset_distance"],
        "outputs.sensors": True,
    }
)
result = railsim.simulate(coach, zone4, speed=22.0, until=500.0, settings=settings)

(assessment,) = railsim.assess(result)
print("verdict:", assessment.verdict)
print(*assessment.reasons, sep="\n")
for row in assessment.worst:
    print(f"{row.criterion.words:40} {100.0 * row.share:5.1f} % of the limit")

figure = assessment_figure([assessment])
save(figure, "02_does_it_pass.png", overwrite=True)
