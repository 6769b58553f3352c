"""Which coil springs does a trailing arm need?

Two wanted deflections fix the stiffnesses of the outer and the inner spring; `verify` then finds
equilibrium, heights and stresses under all loads of the file, with every check against its limit.
"""

import railsim
from railsim.plot.springs import deflection_figure
from railsim.plot.style import save
from railsim.springs.design import design
from railsim.springs.verification import verify

suspension = railsim.load_spring("turasas_axlebox")
designed = design(suspension)
for name, stiffness, coils in zip(designed.names, designed.K_V, designed.n, strict=True):
    print(f"{name} spring: {stiffness / 1e3:.1f} N/mm, {coils:.2f} active coils")

verified = verify(suspension)
for case in verified.cases:
    print(f"{case.name:12} {case.load / 1e3:6.2f} kN: deflection {1e3 * case.deflection:6.2f} mm")
for check in verified.checks:
    print(f"{check.name:22} {check.value:12.5g} {check.sense} {check.limit:.5g} {check.unit}")

figure = deflection_figure(suspension, verified)
save(figure, "08_trailing_arm_spring.png", overwrite=True)
