# %% [markdown]
# # Commission an axis and see what it gained
#
# A simulated axis whose parameters nobody knows: what a data sheet says is all that its firmware starts from. Everything here is simulated.

# %%
import matplotlib.pyplot as plt
import numpy as np

import quadrant as q
from quadrant import design

stage = q.Stage(mass_kg=14.0, coulomb_n=95.0, resonance_hz=130.0, delay_ms=1.0)
found = q.commission(stage, "x", progress=q.print_progress)
print(*found.notes, sep="\n")

# %% [markdown]
# What was identified, beside the truth of the simulation.

# %%
truth = stage.truth_of("x")
for name, (value, error) in found.plant.parameters.items():
    print(f"{name:>14}: {value:.5g} ± {error:.2g}")
print(f"truth: A = {truth['gain_mm_per_v_s2']:.0f} mm/(V s²), Td = {1e3 * truth['delay_s']:.2f} ms")

# %%
figure, axes = plt.subplots(1, 2, figsize=(10, 3.5))
runs = found.friction_runs
axes[0].errorbar(runs["velocity_mm_s"], runs["voltage_v"], runs["deviation_v"], fmt=".", label="runs")
found.friction.sliding.plot(axes[0], 40.0, "fitted")
x, force = found.friction.loop(0.02)
axes[1].plot(1e3 * x, force)
axes[1].set(xlabel="position, µm", ylabel="pre-sliding friction, V")
found.response.plot()

# %% [markdown]
# The margins of the PID, and the laws that were tried on the axis.

# %%
print(found.margins)
for index, law in enumerate(found.laws):
    mark = "*" if index == found.chosen else " "
    print(f"{mark} {law.law:<30} {100 * law.mean_over_pid:5.0f} % of the PID's error on the mean, {100 * law.worst_over_pid:5.0f} % at worst")

# %% [markdown]
# The gain on a motion that the commissioning did not run.

# %%
assert found.pid_settings is not None
sine = q.Motion.sine(amplitude_mm=3.0, velocity_mm_s=12.0, cycles=1.25)
alone = q.simulate(found.pid_settings, sine, stage)
whole = q.simulate(found.settings, sine, stage)
axes = alone.plot(label="PID alone")
whole.plot(axes, label="chosen law")
print(f"RMS {1e3 * alone.rms_error_mm:.2f} -> {1e3 * whole.rms_error_mm:.2f} µm, largest {1e3 * alone.largest_error_mm:.2f} -> {1e3 * whole.largest_error_mm:.2f} µm")
assert whole.rms_error_mm < alone.rms_error_mm
