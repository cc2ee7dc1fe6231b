"""Fits a GMS model to a hysteresis loop and plots both."""

import matplotlib.pyplot as plt
import numpy as np

from quadrant import friction

step_s = 1e-3
x = 0.2 * np.sin(2 * np.pi * 0.1 * np.arange(40_000) * step_s)
sliding = friction.Stribeck.of(coulomb=80.0, breakaway=80.0)
truth = friction.Dahl(sliding, stiffness=8000.0, exponent=1.0)
force = truth.force(None, x, step_s) + np.random.default_rng(1).normal(0.0, 0.2, len(x))

fit = friction.fit_hysteresis(x, force, step_s, elements=5)
print(fit)
axes = fit.model.plot(amplitude_mm=0.03, label="GMS, fitted")
truth.plot(axes, amplitude_mm=0.03, label="Dahl, the truth")
plt.savefig("friction.svg")
