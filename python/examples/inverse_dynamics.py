"""Inertia and friction from an ordinary motion, with standard errors, written to Parquet and MAT."""

import numpy as np

import quadrant as q
from quadrant import files, identify

t = np.arange(0.0, 16.0, 1e-4)
reference = np.minimum(1.0, t) * (8.0 * np.sin(2 * np.pi * 0.4 * t) + 2.0 * np.sin(2 * np.pi * 1.1 * t))
run = q.simulate(q.Settings.simulated(), reference)
models = identify.motion(run.measured_mm, run.output_v, 1e-4)
for model in models:
    print(f"{100 * (model.validation_error or np.nan):6.2f} % on withheld motion: {model.name}")
best = models.recommended
assert best is not None
for name, (value, error) in best.parameters.items():
    print(f"{name:>30}: {value:.5g} +- {error:.2g}")
files.to_parquet(run, "run.parquet")
files.to_mat(run, "run.mat")
