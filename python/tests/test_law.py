"""The law as the firmware runs it: settings, and words beside those of the firmware's own image."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import quadrant

DATA = Path(__file__).parent / "data"
# `cargo xtask emulate --seconds 2 --words FILE`: x of the image in QEMU, on a circle of 30 mm at 15 mm/s from a lead-in of 0.05 s on.
FIRMWARE = DATA / "firmware_words.csv.gz"


def test_every_word_is_the_emulated_firmwares() -> None:
    counts, words, enabled = np.loadtxt(FIRMWARE, delimiter=",", skiprows=1, dtype=np.int64, unpack=True)
    settings = quadrant.Settings.simulated()
    axis = quadrant.Axis(settings, "x")
    first_enabled = int(np.flatnonzero(enabled)[0])
    for count in counts[: first_enabled + 1]:
        # Disabled, the axis follows its encoder.
        axis.step(axis.position_mm, int(count))
        axis.hold_here()
    assert (words[:first_enabled] == 0).all()
    # The plan starts in tick 210, and x has a preview that is a tick shorter than that of z.
    start = 211
    circle = quadrant.Motion.sine(30.0, 15.0, cycles=10.0, lead_s=0.05, phase_rad=np.pi / 2)
    positions, velocities, accelerations = circle.samples(settings, "x")
    here = axis.position_mm
    standing = start - first_enabled - 1
    size = len(counts) - first_enabled - 1
    moving = size - standing
    reference = tuple(
        np.concatenate((np.full(standing, rest), signal[:moving]))
        for signal, rest in ((here + positions, here), (velocities, 0.0), (accelerations, 0.0))
    )
    result = axis.run(reference, counts[first_enabled + 1 :])
    expected = words[first_enabled + 1 :]
    assert np.count_nonzero(expected) > 0.9 * len(expected)
    differing = np.flatnonzero(result.word != expected)
    assert len(differing) == 0, (len(differing), differing[:5])


def test_a_step_is_a_row_of_a_run() -> None:
    settings = quadrant.Settings.simulated()
    motion = quadrant.Motion.sine(2.0, 10.0, cycles=0.5)
    simulated = quadrant.simulate(settings, motion)
    whole, stepped = quadrant.Axis(settings), quadrant.Axis(settings)
    ran = whole.run(motion, simulated.counts)
    reference = motion.samples(settings, "x")
    words = [
        stepped.step(float(p), int(c), float(v), float(a))
        for p, v, a, c in zip(*reference, simulated.counts)
    ]
    assert np.array_equal(ran.word, words)
    assert stepped.terms["word"] == words[-1]
    assert np.isclose(ran.output_v[-1], words[-1] * stepped.volts_per_word, atol=stepped.volts_per_word)


def test_the_terms_add_up_to_the_output() -> None:
    result = quadrant.simulate(quadrant.Settings.simulated(), quadrant.Motion.sine(2.0, 10.0, cycles=0.5))
    total = result.proportional_v + result.integral_v + result.derivative_v + result.feedforward_v + result.inertia_v
    assert np.allclose(total[~result.limited], result.output_v[~result.limited], atol=2e-6)


def test_settings_are_a_dictionary_a_file_and_back(tmp_path: Path) -> None:
    settings = quadrant.Settings.simulated()
    settings["y/feedback/pid/kp_v_per_mm"] = 1.25
    for other in (
        quadrant.Settings.from_dict(settings.to_dict()),
        quadrant.Settings(settings.to_dict()),
        quadrant.Settings.parse(settings.text()),
        pickle.loads(pickle.dumps(settings)),
        copy.deepcopy(settings),
    ):
        assert other == settings
        assert other["y/feedback/pid/kp_v_per_mm"] == 1.25
    settings.write(tmp_path / "stage.toml")
    assert quadrant.Settings.read(tmp_path / "stage.toml") == settings
    assert settings != quadrant.Settings.simulated()


def test_a_part_that_may_be_left_out_is_made_and_removed() -> None:
    settings = quadrant.Settings.simulated()
    settings["x/homing"] = None
    assert settings["x/homing"] is None
    settings["x/homing"] = "present"
    assert settings["x/homing"] == "present"
    assert "x/homing/search_mm_s" in settings.paths("x/homing")


def test_refusals_name_field_value_limits_and_remedy(tmp_path: Path) -> None:
    settings = quadrant.Settings.simulated()
    with pytest.raises(KeyError, match="did you mean"):
        settings["x/feedback/pid/kp"]
    settings["x/feedback/pid/kp_v_per_mm"] = -1.0
    with pytest.raises(ValueError, match=r"x/feedback/pid/kp_v_per_mm = -1.*outside"):
        settings.validate()
    with pytest.raises(ValueError, match="x/feedback/pid/kp_v_per_mm"):
        quadrant.Axis(settings)
    with pytest.raises(OSError, match="missing.toml"):
        quadrant.Settings.read(tmp_path / "missing.toml")
    with pytest.raises(ValueError, match='"x", "y" or "z"'):
        quadrant.Axis(quadrant.Settings.simulated(), "w")


def test_a_fault_is_an_exception_with_code_axis_cause_and_remedy() -> None:
    axis = quadrant.Axis(quadrant.Settings.simulated(), "y")
    axis.step(0.0, 0)
    axis.hold_here()
    with pytest.raises(quadrant.Fault) as found:
        for _ in range(100):
            axis.step(20.0, 0)
    fault = pickle.loads(pickle.dumps(found.value))
    assert (fault.code, fault.name, fault.axis) == (1, "following-error", "y")
    assert "blocked axis" in fault.remedy and fault.cause in str(fault)
    with pytest.raises(ValueError, match="not a finite number"):
        axis.step(float("nan"), 0)
    with pytest.raises(ValueError, match="must have as many"):
        axis.run(np.zeros(5), np.zeros(4, dtype=int))
