# %% [markdown]
# # GMS loops and virgin curves against one's own data
#
# A slow sine makes an axis turn round again and again, and the voltage is the friction. Put your own record in the place of the simulated
# one: positions in mm and voltage, or force, at equal times.

# %%
import matplotlib.pyplot as plt
import numpy as np

import quadrant as q
from quadrant import friction

# Your own: recording = quadrant.files.read("slow-sine.csv"), then recording.position_mm, recording.voltage_v, recording.sample_time_s.
settings = q.Settings.simulated()
settings["x/feedforward/kind"] = "none"
settings["x/feedback/law"] = "pid"
stage = q.Stage(ripple_n=0)
time_s = np.arange(0.0, 45.0, 1e-4)
reference = 0.3 * np.sin(2 * np.pi * 0.1 * time_s) * np.minimum(1.0, time_s / 5.0)
run = q.simulate(settings, reference, stage)
# A sample each millisecond: the position at its beginning, the mean voltage over it.
position, voltage, step_s = run.measured_mm[::10], run.output_v.reshape(-1, 10).mean(axis=1), 1e-3

# %%
fit = friction.fit_hysteresis(position, voltage, step_s, elements=4)
print(fit)

# %% [markdown]
# The averaged branches, seen from their reversals with both axes halved (Masing), the fitted virgin curve, and the truth of the simulation.

# %%
truth = stage.truth_of("x")
mean = 0.5 * (truth["positive"]["breakaway_v"] + truth["negative"]["breakaway_v"])
true = friction.Gms(friction.Stribeck.of(mean, mean), truth["elements"])
places = np.linspace(0.0, 0.04, 400)
figure, axes = plt.subplots(1, 2, figsize=(10, 3.5))
axes[0].plot(1e3 * fit.details["curve_mm"], fit.details["curve_force"], ".", markersize=2, label="measured")
axes[0].plot(1e3 * places, fit.model.virgin_curve(places), label="fitted")
axes[0].plot(1e3 * places, true.virgin_curve(places), "--", label="truth")
axes[0].set(xlabel="displacement, µm", ylabel="friction, V", xlim=(0, 40))
axes[0].legend()
axes[1].plot(1e3 * position[8000:], voltage[8000:], linewidth=0.5, label="measured")
axes[1].plot(1e3 * position, fit.model.force(None, position, step_s), linewidth=0.8, label="fitted")
axes[1].set(xlabel="position, µm", ylabel="friction, V")
axes[1].legend()
apart = np.max(np.abs(fit.model.virgin_curve(places) - true.virgin_curve(places))) / mean
print(f"the fitted curve is within {100 * apart:.1f} % of the breakaway level of the truth")
assert apart < 0.15

# %% [markdown]
# The same loop by every model: those with one state do not close a small loop within a larger one.

# %%
t = np.arange(0.0, 4.0, 1e-4)
inner = 0.02 * np.sin(2 * np.pi * 0.5 * t) + 0.008 * np.sin(2 * np.pi * 3.5 * t)
sliding = fit.model.sliding
for model in (fit.model, friction.SmoothedGms(sliding, fit.model.elements, fit.model.attraction), friction.Dahl(sliding, 15.0), friction.LuGre(sliding, 15.0)):
    plt.figure(figsize=(5, 2.5))
    plt.plot(1e3 * inner, model.force(None, inner, 1e-4), linewidth=0.8)
    plt.title(type(model).__name__)
