"""A thousand runs on all cores: how the error grows as the moving mass departs from the model's."""

import matplotlib.pyplot as plt
import numpy as np

import quadrant as q

masses = np.repeat(np.linspace(8.0, 13.0, 25), 8)
stages = [q.Stage(mass_kg=float(mass)) for mass in masses]
settings, sine = q.Settings.simulated(), q.Motion.sine(5.0, 20.0, cycles=1.0, lead_s=0.3)
many = q.simulate_many(settings, sine, stages, seeds=range(len(stages)))
print(many)
plt.plot(masses, 1e3 * many.rms_error_mm, ".")
plt.xlabel("mass, kg")
plt.ylabel("error, µm RMS")
plt.savefig("many.svg")
