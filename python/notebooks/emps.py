# %% [markdown]
# # EMPS, step by step
#
# EMPS is a real ball-screw axis whose record and model are a public benchmark (A. Janot, M. Gautier, M. Brunot, *Data Set and Reference
# Models of EMPS*, 2019). The record is not part of this project: `docs/identification.md` says where it is and how it becomes a CSV file.
# Name that file in `QUADRANT_EMPS`, or put it at `../shared/data/emps/emps.csv` beside the project. Without it a simulated axis stands in.

# %%
import os
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import quadrant as q
from quadrant import files, identify

FORCE_PER_VOLT = 35.15065188248547
candidates = [os.environ.get("QUADRANT_EMPS", ""), "../../../shared/data/emps/emps.csv", "../../../../shared/data/emps/emps.csv"]
path = next((Path(c) for c in candidates if c and Path(c).is_file()), None)
if path is not None:
    recording = files.read(path)
else:
    print("STAND-IN: the EMPS record is not here; what follows is a simulated axis, and its figures are not those of EMPS")
    t = np.arange(0.0, 24.0, 1e-4)
    reference = np.minimum(1.0, t) * (40.0 * np.sin(2 * np.pi * 0.16 * t) + 6.0 * np.sin(2 * np.pi * 0.9 * t))
    run = q.simulate(q.Settings.simulated(), reference)
    recording = files.Recording(1e-4, run.measured_mm, run.output_v.astype(float), run.reference_mm, np.zeros(len(run)))
force = FORCE_PER_VOLT * recording.voltage_v
print(f"{len(force)} samples at {1 / recording.sample_time_s:.0f} Hz", *recording.notes, sep="\n")

# %% [markdown]
# Eight models, from the four parameters that are published on. *Withheld* is the error on parts of the trajectory that the fit did not see.

# %%
models = identify.motion(recording.position_mm, force, recording.sample_time_s)
for model in models:
    withheld = "       " if model.validation_error is None else f"{100 * model.validation_error:6.3f} %"
    print(f"{100 * model.relative_error:6.3f} %  withheld {withheld}  {model.name}")

# %% [markdown]
# The first model beside the published values: M = 95.1089 kg, Fv = 203.5034 N s/m, Fc = 20.3935 N, offset = -3.1648 N (Janot et al., 2019).

# %%
PUBLISHED = {"M'": 95.1089, "sigma": 203.5034, "Fc": 20.3935, "offset": -3.1648}
for name, (value, error, unit) in models[0].parameters_si.items():
    print(f"{name:>8}: {value:9.4f} ± {error:.2g} {unit:<6}", f"(published: {PUBLISHED[name]})" if path else "")
if path is not None:
    # The figures of docs/identification.md.
    assert abs(models[0].parameters_si["M'"][0] / PUBLISHED["M'"] - 1) < 2e-3
    assert abs(100 * models[0].relative_error - 4.037) < 0.01
    assert abs(100 * models[-1].relative_error - 1.714) < 0.01

# %% [markdown]
# The friction that is left when inertia and offset are taken away, and the recommended model's curve.

# %%
best = models.recommended
assert best is not None
print("recommended:", best.name)
v, left = best.rows["velocity_mm_s"], best.rows["friction"]
plt.plot(v, left, ".", markersize=2, label="force without inertia and offset")
speeds = np.linspace(v.min(), v.max(), 600)
from quadrant.friction import Stribeck

plt.plot(speeds, Stribeck(best.positive, best.negative).force(speeds), label="model")
plt.xlabel("velocity, mm/s")
plt.ylabel("friction, N")
plt.legend()

# %% [markdown]
# An open loop adds up every error of the force: the position that the recorded force gives, beside the recorded one.

# %%
replayed = models.replay(best, recording.position_mm, force, recording.sample_time_s)
every = round(len(recording.position_mm) / len(replayed))
apart = replayed - recording.position_mm[::every][: len(replayed)]
plt.figure()
plt.plot(np.arange(len(apart)) * every * recording.sample_time_s, apart)
plt.xlabel("time, s")
plt.ylabel("open loop minus record, mm")
print(f"RMS {np.sqrt(np.mean(apart**2)):.2f} mm in open loop")
