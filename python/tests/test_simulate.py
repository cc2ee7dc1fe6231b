"""The simulated stage under the law."""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import quadrant

SETTINGS = quadrant.Settings.simulated()
SINE = quadrant.Motion.sine(5.0, 20.0, cycles=0.75, lead_s=0.2)


def test_positions_of_ones_own_are_followed_row_by_row() -> None:
    time_s = np.arange(10_000) / SETTINGS.rate_hz
    reference = 7.0 + 2.0 * (1 - np.cos(2 * np.pi * time_s))
    result = quadrant.simulate(SETTINGS, reference)
    assert len(result) == len(reference)
    assert np.allclose(result.reference_mm, reference, atol=1e-7)
    assert result.largest_error_mm < 0.02
    assert np.max(np.abs(result.measured_mm - result.position_mm)) < 3e-3


def test_the_same_seed_gives_the_same_bits_and_another_does_not() -> None:
    first, same, other = (quadrant.simulate(SETTINGS, SINE, seed=seed) for seed in (4, 4, 5))
    assert np.array_equal(first.word, same.word)
    assert not np.array_equal(first.word, other.word)


def test_feedforward_of_friction_lowers_the_error_on_a_stage_of_ones_own() -> None:
    stage = quadrant.Stage(mass_kg=11.0, friction_asymmetry_percent=2.0)
    plain = SETTINGS.copy()
    plain["x/feedforward/kind"] = "none"
    with_friction = quadrant.simulate(SETTINGS, SINE, stage)
    assert with_friction.rms_error_mm < 0.5 * quadrant.simulate(plain, SINE, stage).rms_error_mm
    assert not np.any(quadrant.simulate(plain, SINE, stage).feedforward_v)


def test_a_dict_runs_the_stage() -> None:
    results = quadrant.simulate(SETTINGS, {"x": SINE, "z": SINE}, seed=2)
    assert set(results) == {"x", "y", "z"}
    assert not np.any(results["y"].reference_mm)
    assert np.max(np.abs(results["z"].position_mm)) > 4.0
    with pytest.raises(ValueError, match="must have as many"):
        quadrant.simulate(SETTINGS, {"x": SINE, "y": np.zeros(10)})


def test_many_runs_are_those_of_simulate() -> None:
    many = quadrant.simulate_many(SETTINGS, SINE, seeds=range(3, 7), keep=["error_mm", "output_v"])
    assert len(many) == 4 and many.signals["error_mm"].shape[0] == 4
    for row, seed in enumerate(range(3, 7)):
        alone = quadrant.simulate(SETTINGS, SINE, seed=seed)
        assert np.array_equal(many.signals["error_mm"][row], alone.error_mm)
        assert np.array_equal(many.signals["output_v"][row], alone.output_v)
        assert np.isclose(many.rms_error_mm[row], alone.rms_error_mm)
    stages = [quadrant.Stage(mass_kg=mass) for mass in (9.0, 10.0, 11.0)]
    assert len(quadrant.simulate_many(SETTINGS, SINE, stages)) == 3
    with pytest.raises(ValueError, match="must be one or as many"):
        quadrant.simulate_many(SETTINGS, SINE, stages, seeds=[1, 2])


def test_a_fault_of_one_of_many_runs_ends_that_one() -> None:
    stages = [quadrant.Stage(), quadrant.Stage(mass_kg=40.0, coulomb_n=4000.0)]
    many = quadrant.simulate_many(SETTINGS, SINE, stages)
    assert many.faults[0] is None and isinstance(many.faults[1], quadrant.Fault)
    assert np.isnan(many.rms_error_mm[1])
    with pytest.raises(quadrant.Fault, match="axis|axes|x"):
        quadrant.simulate(SETTINGS, SINE, stages[1])


def test_ctrl_c_ends_a_long_run() -> None:
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        quadrant.simulate_many(SETTINGS, SINE, seeds=range(100_000))
    assert time.monotonic() - start < 3.0


def test_the_lock_is_released() -> None:
    counted = 0
    thread = threading.Thread(target=lambda: quadrant.simulate_many(SETTINGS, SINE, seeds=range(40)))
    thread.start()
    while thread.is_alive():
        counted += 1
    assert counted > 1000


def test_an_axis_of_a_stage_can_be_stepped_by_hand() -> None:
    truth = quadrant.Stage().axis("x", seed=1)
    for _ in range(100):
        truth.step(0)
    assert abs(truth.position_mm) < 0.05
    for _ in range(1000):
        counts = truth.step(3000)
    assert truth.velocity_mm_s > 10.0
    assert abs(counts * 5e-4 - truth.position_mm) < 2e-3
    truth.set_load_v(0.1)


def test_stages_refuse_what_cannot_be_and_are_pickled() -> None:
    stage = quadrant.Stage(y={"friction": "lugre", "resonance_hz": 90.0}, mass_kg=12.0)
    assert pickle.loads(pickle.dumps(stage)) == stage
    assert stage.truth_of("x")["gain_mm_per_v_s2"] == pytest.approx(1e3 * 693.9 / 12.0)
    with pytest.raises(ValueError, match="mass_kg = -1 is outside"):
        quadrant.Stage(mass_kg=-1.0)
    with pytest.raises(ValueError, match="mas_kg"):
        quadrant.Stage(mas_kg=1.0)
    assert any(name == "mass_kg" for name, *_ in quadrant.Stage.fields())


def test_a_motion_that_was_pickled_has_the_same_samples() -> None:
    for motion in (SINE, quadrant.Motion.move_by(-3.7, 41.3)):
        again = pickle.loads(pickle.dumps(motion))
        for ours, theirs in zip(motion.samples(SETTINGS, "x"), again.samples(SETTINGS, "x")):
            assert np.array_equal(ours, theirs)


def test_axes_that_nobody_has_commissioned_do_not_start() -> None:
    with pytest.raises(ValueError, match="commission"):
        quadrant.simulate(quadrant.Stage(mass_kg=9.0).settings(), SINE)


def test_results_are_data_frames() -> None:
    pytest.importorskip("pandas")
    frame = quadrant.simulate(SETTINGS, SINE).to_pandas()
    assert frame.index.name == "t_s"
    assert {"error_mm", "word", "feedforward_v", "position_mm"} <= set(frame.columns)
