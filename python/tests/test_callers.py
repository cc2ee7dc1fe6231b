"""What callers get wrong, and what they expect of a package of numpy's family."""

from __future__ import annotations

import copy
import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import quadrant
from quadrant import design, files, friction, identify
from quadrant.machine import _forget

SETTINGS = quadrant.Settings.simulated()
MOTION = quadrant.Motion.sine(1.0, 20.0, cycles=0.25, lead_s=0.1)
PLANT = identify.Plant(69_390.0, 144.8, 0.0, 1.2e-3)
GAINS = design.PidGains(1.0, 5.0, 5e-3, 1e-4)
SLIDING = friction.Stribeck.of(0.12, 0.15, stribeck_velocity=1.0, viscous=1e-3)


def test_scalars_and_arrays_of_numpy_are_values_of_settings() -> None:
    settings = SETTINGS.copy()
    settings["x/feedback/pid/kp_v_per_mm"] = np.float32(1.5)
    settings["x/feedback/pid/ki_v_per_mm_s"] = np.int64(3)
    assert settings["x/feedback/pid/kp_v_per_mm"] == 1.5 and settings["x/feedback/pid/ki_v_per_mm_s"] == 3.0
    values = settings.to_dict()
    values["rate_hz"] = np.float64(10_000.0)
    assert quadrant.Settings(values) == settings
    assert quadrant.Stage(mass_kg=np.float32(9.0)) == quadrant.Stage(mass_kg=9.0)
    assert quadrant.Stage(travel_mm=np.array([-10.0, 10.0])) == quadrant.Stage(travel_mm=(-10.0, 10.0))
    with pytest.raises(TypeError, match="no value of a setting"):
        settings["rate_hz"] = 1 + 2j


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (None, "not what this setting holds"),
        (float("nan"), "must be a finite number"),
        (float("inf"), "must be a finite number"),
        (10**400, "must be a finite number"),
    ],
)
def test_what_is_no_finite_number_is_no_setting(value: object, reason: str) -> None:
    settings = SETTINGS.copy()
    with pytest.raises(ValueError, match=f"kp_v_per_mm.*{reason}"):
        settings["x/feedback/pid/kp_v_per_mm"] = value
    assert settings == SETTINGS


def test_settings_are_a_mapping_of_paths() -> None:
    assert "x/feedback/pid/kp_v_per_mm" in SETTINGS and "x/feedback/pid/kp" not in SETTINGS
    assert list(SETTINGS) == SETTINGS.paths() and len(SETTINGS) == len(SETTINGS.paths())
    assert dict(SETTINGS)["rate_hz"] == 10_000.0
    assert SETTINGS.get("x/nope", 3) == 3 and SETTINGS.get("rate_hz") == 10_000.0


def test_files_that_are_missing_are_named_in_the_subclass_of_oserror(tmp_path: Path) -> None:
    missing = tmp_path / "missing"
    reads: list[Callable[[Path], object]] = [quadrant.Settings.read, quadrant.Stage.read, files.read]
    for read in reads:
        with pytest.raises(FileNotFoundError, match="missing"):
            read(missing)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        SETTINGS.write(tmp_path / "nowhere" / "x.toml")


def test_counts_that_are_not_whole_are_refused() -> None:
    still = np.zeros(3)
    assert len(quadrant.Axis(SETTINGS).run(still, still)) == 3
    for counts in ([0.0, 0.7, 0.0], [0.0, np.nan, 0.0]):
        with pytest.raises(ValueError, match=r"counts\[1\] = .* is not a whole number"):
            quadrant.Axis(SETTINGS).run(still, counts)
    with pytest.raises(ValueError, match="shape"):
        quadrant.Axis(SETTINGS).run(still, np.zeros((3, 1)))
    axis = quadrant.Axis(SETTINGS)
    for derivatives in ({"velocity": np.nan}, {"acceleration": 1e300}):
        with pytest.raises(ValueError, match="not a finite number"):
            axis.step(0.0, 0, **derivatives)


def test_arrays_of_any_layout_and_type_are_the_same_reference() -> None:
    reference = 1.0 - np.cos(np.linspace(0.0, 3.0, 2000))
    plain = quadrant.simulate(SETTINGS, reference)
    for other in (np.repeat(reference, 2)[::2], reference.astype(">f8"), list(reference), np.ma.masked_array(reference)):
        assert np.array_equal(quadrant.simulate(SETTINGS, other).word, plain.word)
    masked = np.ma.masked_array(reference, mask=np.arange(2000) == 7)
    with pytest.raises(ValueError, match=r"reference\[7\]"):
        quadrant.simulate(SETTINGS, masked)
    for none in (reference + 0j, reference[:, None], "abc", 5.0):
        with pytest.raises(TypeError, match="a reference is"):
            quadrant.simulate(SETTINGS, none)


def test_forces_and_responses_have_the_shape_of_what_they_are_asked_for() -> None:
    grid = np.array([[1.0, -2.0], [3.0, 4.0]])
    assert SLIDING.force(grid).shape == (2, 2) and SLIDING.force(1.0).shape == ()
    assert PLANT.response(np.abs(grid)).shape == (2, 2)
    assert design.open_loop(PLANT, GAINS, np.abs(grid)).shape == (2, 2)
    gms = friction.Gms(SLIDING, np.array([[20.0, 0.5], [5.0, 0.5]]))  # type: ignore[arg-type]
    assert gms.virgin_curve(np.abs(grid)).shape == (2, 2)


def test_a_motion_that_is_none_or_lasts_too_long_is_refused() -> None:
    with pytest.raises(ValueError, match="phase_rad"):
        quadrant.Motion.sine(1.0, 1.0, phase_rad=np.nan)
    slow = SETTINGS.copy()
    with pytest.raises(ValueError, match="more than 3600 s"):
        quadrant.Motion.sine(100.0, 0.01, cycles=1.0).samples(slow, "x")
    assert quadrant.Motion.sine(1.0, 2.0) == quadrant.Motion.sine(1.0, 2.0)


def test_seeds_are_those_that_there_are() -> None:
    assert len(quadrant.simulate_many(SETTINGS, MOTION, seeds=np.int64(3), keep="error_mm").signals["error_mm"]) == 1
    for seed in (-1, 2**64):
        with pytest.raises(ValueError, match="seed = "):
            quadrant.simulate(SETTINGS, MOTION, seed=seed)
    with pytest.raises(TypeError):
        quadrant.simulate_many(SETTINGS, MOTION, seeds=[1.5])  # type: ignore[list-item]


def test_many_runs_that_all_end_in_a_fault_are_shown_without_a_warning() -> None:
    many = quadrant.simulate_many(SETTINGS, [0.0, 1e3, 0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "1 with a fault" in repr(many)


def test_a_simulated_axis_is_read_in_counts_from_where_it_stands() -> None:
    axis = quadrant.Stage().axis()
    for _ in range(1000):
        counts = axis.step(-3000)
    assert counts < 0
    assert counts * axis.resolution_mm == pytest.approx(axis.position_mm, abs=2e-3)


def test_an_unstable_loop_has_no_error_and_a_loop_without_integral_action_an_infinite_one() -> None:
    with pytest.raises(ValueError, match="unstable"):
        design.load_error(PLANT, design.PidGains(1e6, 1.0))
    assert design.load_error(PLANT, design.PidGains(1.0)) == np.inf
    # The load of 1 V turns a stable loop by the integral of exp(...) squared; with the integral alone varied it falls.
    assert design.load_error(PLANT, GAINS) > design.load_error(PLANT, design.PidGains(1.0, 10.0, 5e-3, 1e-4)) > 0


@pytest.mark.parametrize(
    "call",
    [
        lambda: design.pid(PLANT, derivative_filter_s=-1.0),
        lambda: design.pid(PLANT, derivative_filter_s=np.nan),
        lambda: design.popov(PLANT, GAINS, rate_hz=0.0),
        lambda: design.npid(PLANT, GAINS, range_mm=np.nan),
        lambda: design.npid(PLANT, GAINS, breakaway_v=-1.0),
        lambda: design.npid(PLANT, GAINS, largest=np.nan),
        lambda: identify.Plant(1.0, modes=(identify.Mode(-100.0, 0.1),)).response(1.0),
        lambda: identify.frf(np.zeros(100), np.zeros(100), 0.0, nperseg=20),
        lambda: identify.motor_constant(np.zeros(9), np.zeros(9), 1e3, resolution_mm=0.0),
        lambda: friction.Dahl(SLIDING, 10.0, exponent=0.5).force(None, [0.0, 1.0]),
        lambda: friction.SmoothedGms(SLIDING, width=50.0).force(None, [0.0, 1.0]),
        lambda: friction.fit_runs([1.0], [1.0], -1.0),
        lambda: friction.Gms(SLIDING).loop(frequency_hz=0.0),
    ],
)
def test_numbers_outside_their_range_are_refused(call: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match="above|zero or more|it is"):
        call()


def test_signals_without_excitation_give_no_response() -> None:
    noise = np.random.default_rng(1).normal(size=4000)
    with pytest.raises(ValueError, match="nothing excites the axis"):
        identify.frf(noise, np.zeros(4000), 1e3, nperseg=500)
    with pytest.raises(ValueError, match="voltage has 3999 samples"):
        identify.frf(noise, noise[1:], 1e3, nperseg=500)
    with pytest.raises(TypeError, match="complex"):
        identify.frf(noise + 0j, noise, 1e3, nperseg=500)


def test_a_response_that_is_no_number_is_refused_and_one_of_single_precision_is_fitted() -> None:
    hz = np.geomspace(3.0, 600.0, 160)
    ones = np.ones(160)
    response = PLANT.response(hz)
    for value in (np.nan, 0.0, np.inf):
        broken = response.copy()
        broken[5] = value
        with pytest.raises(ValueError, match=r"response\[5\]"):
            identify.fit_tf(identify.Frf(hz, broken, 0.99 * ones, 1e-3 * ones))
    single = identify.fit_tf(identify.Frf(hz, response.astype(np.complex64), 0.99 * ones, 1e-3 * ones))
    assert single.plant.gain_mm_per_v_s2 == pytest.approx(69_390.0, rel=1e-3)


def test_a_system_of_python_control_is_told_from_a_response() -> None:
    control = pytest.importorskip("control")
    with pytest.raises(TypeError, match="control.frd"):
        design.pid(PLANT.to_control())
    hz = np.geomspace(3.0, 600.0, 160)
    assert design.pid(control.frd(PLANT.to_control(), 2 * np.pi * hz)).margins.sensitivity_peak <= 1.7 + 1e-6
    both = np.tile(PLANT.response(hz), (2, 2, 1))
    with pytest.raises(ValueError, match="one output and one input"):
        identify.fit_tf(control.frd(both, 2 * np.pi * hz))
    with pytest.raises(TypeError, match="PidGains"):
        design.margins(PLANT, (1.0, 2.0, 3.0, 4.0))  # type: ignore[arg-type]


def test_a_force_that_does_not_oppose_the_motion_is_no_friction() -> None:
    x = 0.2 * np.sin(2 * np.pi * 0.1 * np.arange(40_000) * 1e-3)
    force = friction.Gms(SLIDING).force(None, x, 1e-3)
    for wrong in (-force, 0 * force):
        with pytest.raises(ValueError, match="signs"):
            friction.fit_hysteresis(x, wrong, 1e-3)
    with pytest.raises(ValueError, match="voltage is zero"):
        identify.motion(40 * x, 0 * x, 1e-3)


def test_results_go_to_csv_and_variables_of_mat_files_are_equally_long(tmp_path: Path) -> None:
    pytest.importorskip("scipy")
    run = quadrant.simulate(SETTINGS, MOTION)
    files.to_csv(run, tmp_path / "run.csv")
    again = files.read(tmp_path / "run.csv")
    assert np.array_equal(again.position_mm, run.measured_mm) and np.array_equal(again.voltage_v, run.output_v)
    files.to_mat({"t": [0.0, 1.0, 2.0], "x": [0.0, 1.0], "u": [1.0]}, tmp_path / "short.mat")
    with pytest.raises(ValueError, match="as many"):
        files.read_mat(tmp_path / "short.mat", time="t", position="x", voltage="u")


def test_commissioning_refuses_what_it_would_leave_out() -> None:
    with pytest.raises(ValueError, match="Stage\\(travel_mm"):
        quadrant.commission(quadrant.Stage(), travel_mm=(-5.0, 5.0))
    with pytest.raises(TypeError, match="Stage or a quadrant.Machine"):
        quadrant.commission(SETTINGS)  # type: ignore[arg-type]


def test_another_thread_stops_or_closes_a_machine_that_is_waited_for() -> None:
    machine = quadrant.Machine("simulated:commissioned")
    machine.enable()
    for end in (machine.stop, machine.close):
        machine.run({"x": quadrant.Motion.sine(5.0, 20.0, cycles=1e5)})
        timer = threading.Timer(0.3, end)
        start = time.monotonic()
        timer.start()
        with pytest.raises((RuntimeError, ConnectionError)):
            machine.sleep(1e7)
        timer.join()
        assert time.monotonic() - start < 3.0
        if end == machine.stop:
            assert machine.wait()["x"]["mode"] == "hold"


def test_a_machine_that_is_left_twice_is_left_once_and_one_channel_is_a_name() -> None:
    pytest.importorskip("pandas")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with quadrant.Machine("simulated:commissioned") as machine:
            assert list(machine.record("x.error", 0.05).columns) == ["x.error"]
            with pytest.raises(ValueError, match="every_s"):
                next(machine.watch("x.error", 1.0, every_s=0.0))
            machine.close()
        machine.close()


def test_a_machine_that_nobody_closes_is_disabled_when_nothing_refers_to_it() -> None:
    machine = quadrant.Machine("simulated:commissioned")
    machine.enable()
    session, orders = machine._session, []

    class Watched:
        def disable(self) -> None:
            session.disable()
            orders.append(session.status()["state"])

        def close(self) -> None:
            session.close()

    finalizer = weakref.finalize(machine, _forget, Watched())  # type: ignore[arg-type]
    finalizer()
    assert orders == ["disabled"]
    del machine
    gc.collect()
    with pytest.raises(ConnectionError, match="closed"):
        session.status()


def test_progress_cannot_wait_for_the_machine_that_is_commissioned() -> None:
    with quadrant.Machine("simulated:commissioned") as machine:
        with pytest.raises(RuntimeError, match="busy"):
            quadrant.commission(machine, progress=lambda step, share: machine.status())


def _errors(first: int) -> float:
    many = quadrant.simulate_many(SETTINGS, MOTION, seeds=range(first, first + 3))
    return float(many.rms_error_mm.sum())


def test_a_forked_process_runs_on_its_own_threads() -> None:
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork")
    here = _errors(0)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(_errors, (0,)).get(timeout=20) == here


def _status_of_parents(machine: quadrant.Machine) -> str:
    try:
        machine.status()
    except ConnectionError as error:
        return str(error)
    return ""


def test_a_machine_of_the_parent_is_refused_in_a_forked_process() -> None:
    if "fork" not in multiprocessing.get_all_start_methods():
        pytest.skip("no fork")
    context = multiprocessing.get_context("fork")
    with quadrant.Machine("simulated") as machine:
        answers = context.SimpleQueue()
        child = context.Process(target=lambda: answers.put(_status_of_parents(machine)))
        child.start()
        child.join(10)
        assert "another process" in answers.get()


def _interrupted_after_s(call: Callable[[], object]) -> float:
    start = time.monotonic()
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        call()
    timer.join()
    return time.monotonic() - start - 0.3


def test_ctrl_c_ends_fits_designs_and_long_motions_at_once() -> None:
    rng = np.random.default_rng(1)
    noise = rng.normal(size=5_000_000)
    far = identify.Plant(69_390.0, 144.8, 0.0, 1.2e-3)
    t = np.arange(0.0, 60.0, 1e-4)
    x = 8 * np.sin(2 * np.pi * 0.4 * t) + 2 * np.sin(2 * np.pi * 1.1 * t)
    force = SLIDING.force(np.gradient(x, t)) + rng.normal(0.0, 1e-3, len(x))
    for call in (
        lambda: design.pid(far, computation_delay_s=10.0),
        lambda: quadrant.Motion.sine(5.0, 20.0, cycles=2000.0).samples(SETTINGS, "x"),
        lambda: [identify.frf(noise, noise, 1e4) for _ in range(5)],
        lambda: identify.motion(x, force, 1e-4),
    ):
        assert _interrupted_after_s(call) < 1.0


def test_settings_that_were_copied_are_changed_alone() -> None:
    other = copy.copy(SETTINGS)
    other["rate_hz"] = 8000.0
    assert SETTINGS["rate_hz"] == 10_000.0


def test_a_package_that_is_missing_is_named_before_anything_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    run = quadrant.simulate(SETTINGS, MOTION)
    for package in ("control", "pandas", "matplotlib"):
        monkeypatch.setitem(sys.modules, package, None)
    calls: list[Callable[[], object]] = [run.plot, run.to_pandas, PLANT.to_control]
    for call in calls:
        with pytest.raises(ModuleNotFoundError, match="pip install"):
            call()
    with pytest.raises(ModuleNotFoundError, match="control"):
        identify.measure_frf(quadrant.Stage(), settings=SETTINGS, progress=lambda step, share: pytest.fail(step))
