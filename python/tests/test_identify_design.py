"""Identification and design."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import quadrant
from quadrant import design, identify

control = pytest.importorskip("control")

X = identify.Plant(69_390.0, 144.8, 0.0, 1.2e-3)


def rigid(hz: np.ndarray) -> np.ndarray:
    s = 2j * np.pi * hz
    return np.asarray(69_390.0 * np.exp(-1.2e-3 * s) / (s * s + 144.8 * s))


def measured(noise: float = 0.002, modes: tuple[identify.Mode, ...] = ()) -> identify.Frf:
    hz = np.geomspace(3.0, 600.0, 160)
    plant = identify.Plant(69_390.0, 144.8, 0.0, 1.2e-3, modes)
    draw = np.random.default_rng(3).normal(size=(2, len(hz)))
    response = plant.response(hz) * (1 + noise * (draw[0] + 1j * draw[1]))
    return identify.Frf(hz, response, np.full(len(hz), 0.99), np.full(len(hz), noise))


def test_the_response_of_a_model_is_its_formula_and_python_controls() -> None:
    hz = np.geomspace(1.0, 300.0, 20)
    assert np.allclose(X.response(hz), rigid(hz), rtol=1e-12)
    by_control = X.to_control(pade=None)(2j * np.pi * hz) * np.exp(-2j * np.pi * hz * 1.2e-3)
    assert np.allclose(by_control, rigid(hz), rtol=1e-9)
    with_mode = identify.Plant(69_390.0, 144.8, 0.0, 0.0, (identify.Mode(90.0, 0.03, (70.0, 0.02)),))
    assert np.allclose(with_mode.to_control()(2j * np.pi * hz), with_mode.response(hz), rtol=1e-9)


def test_a_recording_gives_the_response_with_coherence() -> None:
    rate = 2000.0
    rng = np.random.default_rng(4)
    voltage = np.repeat(rng.normal(0.0, 1.0, 40_000), 1)
    # x'' = A u - B x' exactly over each held sample.
    a, b, t = 69_390.0, 144.8, 1.0 / rate
    e = np.exp(-b * t)
    position = np.zeros(len(voltage))
    v = 0.0
    for k in range(len(voltage) - 1):
        drive = a * voltage[k] / b
        position[k + 1] = position[k] + drive * t + (v - drive) * (1 - e) / b
        v = drive + (v - drive) * e
    found = identify.frf(position, voltage, rate, nperseg=4000, band_hz=(5.0, 300.0))
    hz = found.omega / (2 * np.pi)
    s = 2j * np.pi * hz
    expected = a / (s * s + b * s)
    assert np.median(np.abs(np.squeeze(found.frdata) / expected - 1)) < 0.03
    assert np.all(found.coherence > 0.9)
    assert found.magnitude.shape[-1] == len(hz)
    fit = identify.fit_tf(found)
    assert fit.plant.gain_mm_per_v_s2 == pytest.approx(a, rel=0.02)
    with pytest.raises(ValueError, match="nperseg"):
        identify.frf(position[:100], voltage[:100], rate, nperseg=5000)


def test_fit_tf_finds_plant_dead_time_and_mode() -> None:
    fit = identify.fit_tf(measured())
    for found, truth in zip(fit.plant.numbers(), X.numbers()):
        assert found == pytest.approx(truth, rel=0.02)
    value, error = fit.parameters["Td"]
    assert abs(value - 1.2e-3) < 5 * error
    mode = identify.Mode(120.0, 0.04, None)
    shown = identify.fit_tf(measured(modes=(mode,)).to_control(), modes=1)
    assert shown.plant.modes[0].frequency_hz == pytest.approx(120.0, rel=0.02)
    with pytest.raises(ValueError, match="shows 1"):
        identify.fit_tf(measured(modes=(mode,)), modes=0)
    with pytest.raises(ValueError, match="dead time of 1.2"):
        identify.fit_tf(measured(), delay=False)


def test_the_best_pid_keeps_its_bounds_and_python_control_finds_the_same_margins() -> None:
    found = design.pid(X, rate_hz=None, derivative_filter_s=1e-4)
    assert found.margins.sensitivity_peak <= 1.7 and found.margins.complementary_peak <= 1.5
    kp, ki, kd, tau = found.gains.numbers()
    omega = np.geomspace(1.0, 6000.0, 40_000)
    s = 1j * omega
    loop = rigid(omega / (2 * np.pi)) * (kp + ki / s + kd * s / (1 + tau * s))
    gain, phase, _, _, crossover, _ = control.stability_margins(control.frd(loop, omega, smooth=True))
    assert 20 * np.log10(gain) == pytest.approx(found.margins.gain_margin_db, abs=0.01)
    assert phase == pytest.approx(found.margins.phase_margin_deg, abs=0.01)
    assert np.max(1 / np.abs(1 + loop)) == pytest.approx(found.margins.sensitivity_peak, rel=1e-3)
    assert np.allclose(design.open_loop(X, found.gains, omega / (2 * np.pi), rate_hz=None), loop, rtol=1e-9)


def test_sampling_costs_margin_and_other_bounds_are_used() -> None:
    best = design.pid(X)
    tight = design.pid(X, ms=1.4, mt=1.2)
    assert tight.margins.sensitivity_peak <= 1.4 and tight.margins.complementary_peak <= 1.2
    assert design.load_error(X, best.gains) < design.load_error(X, tight.gains)
    continuous = design.margins(X, best.gains, rate_hz=None)
    assert best.margins.phase_margin_deg < continuous.phase_margin_deg
    assert design.margins(X, best.gains) == best.margins
    with pytest.raises(ValueError, match="above 1"):
        design.pid(X, ms=0.9)


def test_a_measured_response_is_designed_on_without_a_model() -> None:
    on_model = design.pid(X, derivative_filter_s=1e-4)
    on_data = design.pid(measured(noise=1e-5), derivative_filter_s=1e-4)
    assert design.load_error(X, on_data.gains) == pytest.approx(design.load_error(X, on_model.gains), rel=0.02)


def test_popov_bounds_the_nonlinear_gain() -> None:
    gains = design.pid(X).gains
    proof = design.popov(X, gains)
    assert 1 < proof.circle <= proof.popov
    gain = design.npid(X, gains, sector_share=0.5, breakaway_v=0.15)
    assert gain is not None
    assert gain.largest == pytest.approx(0.5 * proof.popov, rel=1e-9)
    assert gain.range_mm == pytest.approx(0.15 / gains.kp_v_per_mm)
    with pytest.raises(TypeError, match="model"):
        design.popov(measured(), gains)  # type: ignore[arg-type]


def test_gains_go_into_settings_and_come_out() -> None:
    settings = quadrant.Settings.simulated()
    gains = design.PidGains.of(settings, "y")
    assert gains.kp_v_per_mm == settings["y/feedback/pid/kp_v_per_mm"]
    other = design.PidGains(2.0, 1.0, 5e-3, 6e-5)
    other.put_into(settings, "y")
    assert design.PidGains.of(settings, "y") == other


def test_a_square_wave_gives_the_motor_constant(tmp_path: Path) -> None:
    axis = quadrant.Stage(noise_um=0.05).axis("x", rate_hz=10_000.0)
    volts = []
    for sign in (1.0, -1.0, 1.0, -1.0):
        for level in range(24):
            volts += [sign * (0.35 if level % 2 == 0 else 0.14)] * 80
        volts += [0.0] * 1000
    position = []
    for volt in volts:
        position.append(axis.read() & 0xFFFFFFFF)
        axis.step(round(volt * 3276.7))
    mm = np.array(position, dtype=np.uint32).astype(np.int32) * 5e-4
    found = identify.motor_constant(mm, volts, 10_000.0)
    assert found.gain_mm_per_v_s2 == pytest.approx(69_390.0, rel=0.1)
    assert 0 < found.standard_error < 0.2 * found.gain_mm_per_v_s2


def test_commissioning_finds_the_axis_and_reports_progress() -> None:
    stage = quadrant.Stage(mass_kg=12.0)
    seen: list[tuple[str, float]] = []
    found = quadrant.commission(stage, "x", progress=lambda step, share: seen.append((step, share)))
    assert {step for step, _ in seen} >= {"motor constant", "frequency response", "verdict"}
    assert max(share for _, share in seen) > 0.8
    truth = stage.truth_of("x")
    assert found.plant.plant.gain_mm_per_v_s2 == pytest.approx(truth["gain_mm_per_v_s2"], rel=0.05)
    sine = quadrant.Motion.sine(5.0, 20.0)
    assert found.pid_settings is not None
    alone = quadrant.simulate(found.pid_settings, sine, stage)
    whole = quadrant.simulate(found.settings, sine, stage)
    assert whole.rms_error_mm < 0.6 * alone.rms_error_mm
    assert found.laws[0].worst_over_pid == pytest.approx(1.0) and found.chosen is not None
    assert any("minutes" in note for note in found.notes)


def test_an_exception_of_progress_ends_the_commissioning() -> None:
    def refuse(step: str, share: float) -> None:
        raise LookupError(step)

    with pytest.raises(LookupError, match="motor constant"):
        quadrant.commission(quadrant.Stage(), "x", progress=refuse)


def test_a_response_is_measured_on_a_stage_and_on_a_machine() -> None:
    stage = quadrant.Stage(mass_kg=12.0)
    settings = quadrant.Settings.simulated()
    seen: list[float] = []
    found = identify.measure_frf(stage, settings=settings, averages=8, progress=lambda step, share: seen.append(share))
    fit = identify.fit_tf(found, least_coherence=0.8)
    truth = stage.truth_of("x")
    assert fit.plant.gain_mm_per_v_s2 == pytest.approx(truth["gain_mm_per_v_s2"], rel=0.05)
    assert fit.plant.delay_s == pytest.approx(truth["delay_s"], abs=3e-4) and max(seen) > 0.8
    with quadrant.Machine("simulated", stage=stage, settings=settings) as machine:
        before = machine.settings()
        on_machine = identify.measure_frf(machine, averages=8)
        assert machine.settings() == before and machine.status()["state"] == "disabled"
    ratio = np.abs(np.squeeze(on_machine.frdata) / np.squeeze(found.frdata))
    assert np.median(np.abs(ratio - 1)) < 0.1
    with pytest.raises(RuntimeError, match="travel"):
        identify.measure_frf(stage, settings=settings, velocity_mm_s=240.0, period_s=5.0)
    with pytest.raises(ValueError, match="multisine"):
        identify.measure_frf(stage, settings=settings, waveform="square")
    with pytest.raises(ValueError, match="no law of its own"):
        identify.measure_frf(stage)


def test_a_commissioning_that_ends_early_leaves_the_settings_of_the_machine_as_they_were() -> None:
    def refuse(step: str, share: float) -> None:
        if step != "motor constant":
            raise LookupError(step)

    with quadrant.Machine("simulated:commissioned") as machine:
        before = machine.settings()
        with pytest.raises(LookupError):
            quadrant.commission(machine, progress=refuse)
        assert machine.settings() == before and machine.status()["state"] == "disabled"
