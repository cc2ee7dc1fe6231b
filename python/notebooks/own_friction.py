# %% [markdown]
# # Your own friction model against ours in the same loop
#
# The law runs tick by tick on a simulated axis whose friction it does not know. Its own feedforward is switched off, and a model in Python
# adds its voltage to the word; then the firmware's feedforward does the same. Everything is simulated.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

import quadrant as q

settings = q.Settings.simulated()
stage = q.Stage()
reference = q.Motion.sine(5.0, 20.0, cycles=1.25, lead_s=0.3).samples(settings, "x")


class Tanh:
    """A common shortcut: a Coulomb level that turns within a velocity, and viscous friction."""

    def __init__(self, level_v: float, velocity_mm_s: float, viscous: float) -> None:
        self.level_v, self.velocity_mm_s, self.viscous = level_v, velocity_mm_s, viscous

    def __call__(self, position_mm: float, velocity_mm_s: float) -> float:
        return self.level_v * math.tanh(velocity_mm_s / self.velocity_mm_s) + self.viscous * velocity_mm_s


class Nothing:
    def __call__(self, position_mm: float, velocity_mm_s: float) -> float:
        return 0.0


# %%
def closed_loop(model, settings: q.Settings, seed: int = 1) -> np.ndarray:
    """Errors of the loop with a model of friction beside the law, µm."""
    law, axis = q.Axis(settings, "x"), stage.axis("x", rate_hz=settings.rate_hz, seed=seed)
    counts = axis.read()
    law.step(0.0, counts)
    law.hold_here()
    positions, velocities, accelerations = (signal.tolist() for signal in reference)
    late = law.preview_ticks
    errors = []
    for k, (x, v, a) in enumerate(zip(positions, velocities, accelerations)):
        word = law.step(x, counts, v, a) + round(model(x, v) / law.volts_per_word)
        errors.append(1e3 * (positions[max(k - late, 0)] - axis.position_mm))
        counts = axis.step(word)
    return np.array(errors)


without = settings.copy()
without["x/feedforward/kind"] = "none"
truth = stage.truth_of("x")["positive"]
contestants = {
    "no friction fed forward": (Nothing(), without),
    "tanh, well tuned": (Tanh(0.12, 0.5, 0.002), without),
    "static + GMS, the firmware's": (Nothing(), settings),
}
for name, (model, of) in contestants.items():
    errors = closed_loop(model, of)
    print(f"{name:<30} {np.sqrt(np.mean(errors**2)):6.2f} µm RMS, {np.max(np.abs(errors)):6.2f} µm at most")
    plt.plot(np.arange(len(errors)) / settings.rate_hz, errors, linewidth=0.8, label=name)
plt.xlabel("time, s")
plt.ylabel("error, µm")
plt.legend()

# %% [markdown]
# By hand or by `simulate`, the firmware's law does the same.

# %%
by_hand = closed_loop(Nothing(), settings)
at_once = 1e3 * q.simulate(settings, reference, stage).error_mm
print(f"{np.sqrt(np.mean(by_hand**2)):.2f} and {np.sqrt(np.mean(at_once**2)):.2f} µm RMS")
assert abs(np.sqrt(np.mean(by_hand**2)) / np.sqrt(np.mean(at_once**2)) - 1) < 0.2
