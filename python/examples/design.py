"""From a measured response to a PID: fit, design, margins, and python-control's Nyquist plot."""

import control
import matplotlib.pyplot as plt
import numpy as np

import quadrant as q
from quadrant import design, identify

found = q.commission(q.Stage(resonance_hz=110.0), "x", trials=False)
fit = identify.fit_tf(found.response.to_control(), least_coherence=0.8)
for name, (value, error) in fit.parameters.items():
    print(f"{name:>12}: {value:.5g} +- {error:.2g}")
best = design.pid(fit.plant, ms=1.7, mt=1.5)
print(best.gains, best.margins, sep="\n")

hz = np.geomspace(1.0, 1000.0, 2000)
loop = control.frd(design.open_loop(fit.plant, best.gains, hz), 2 * np.pi * hz, smooth=True)
control.nyquist_plot(loop, warn_encirclements=False)
plt.savefig("design.svg")
