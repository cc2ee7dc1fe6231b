"""Commissions a simulated axis and plots the PID against the full law."""

import matplotlib.pyplot as plt

import quadrant as q

stage = q.Stage(mass_kg=12.0, coulomb_n=90.0)
found = q.commission(stage, "x", progress=q.print_progress)
print(*found.notes, sep="\n")
sine = q.Motion.sine(amplitude_mm=5.0, velocity_mm_s=20.0)
assert found.pid_settings is not None
axes = q.simulate(found.pid_settings, sine, stage).plot(label="PID alone")
q.simulate(found.settings, sine, stage).plot(axes, label="full law")
plt.savefig("commission.svg")
