"""Closes the loop by hand: the firmware's law and a simulated axis, a control period at a time."""

import numpy as np

import quadrant as q

settings = q.Settings.simulated()
law, axis = q.Axis(settings, "x"), q.Stage().axis("x", rate_hz=settings.rate_hz)
counts = axis.read()
law.step(0.0, counts)
law.hold_here()
errors = []
for t in np.arange(20_000) / settings.rate_hz:
    word = law.step(2.0 * (1.0 - np.cos(2 * np.pi * t)), counts)
    counts = axis.step(word)
    errors.append(law.terms["error_mm"])
print(f"error {1e3 * np.std(errors):.2f} um RMS, the last terms {law.terms}")
