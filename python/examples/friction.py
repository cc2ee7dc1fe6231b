"""Fits a GMS model to a measured hysteresis loop and plots both."""

import matplotlib.pyplot as plt
import numpy as np

from quadrant import friction

step_s = 1e-3
x = 0.2 * np.sin(2 * np.pi * 0.1 * np.arange(40_000) * step_s)
sliding = friction.Stribeck.of(coulomb=80.0, breakaway=80.0)
truth = friction.Gms(sliding, [(15e3, 0.25), (6e3, 0.35), (1.5e3, 0.4)], attraction=3000.0)
force = truth.force(None, x, step_s) + np.random.default_rng(1).normal(0.0, 0.2, len(x))

fit = friction.fit_hysteresis(x, force, step_s, elements=3)
print(fit)
axes = fit.model.plot(amplitude_mm=0.03, label="fitted")
truth.plot(axes, amplitude_mm=0.03, label="truth")
plt.savefig("friction.svg")
