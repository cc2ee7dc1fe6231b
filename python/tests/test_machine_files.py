"""Machines and files."""

from __future__ import annotations

import os
import shutil
import signal
import threading
from pathlib import Path

import numpy as np
import pytest

import quadrant
from quadrant import files

pandas = pytest.importorskip("pandas")


def test_a_machine_runs_a_motion_and_is_recorded() -> None:
    with quadrant.Machine("simulated:commissioned") as machine:
        assert machine.identity["rate_hz"] == 10_000.0
        machine.enable()
        machine.run({"x": quadrant.Motion.sine(5.0, 20.0, cycles=0.25, lead_s=0.2)})
        frame = machine.record(["x.error", "x.position", "x.output"], 0.5)
        assert frame.index.name == "t_s" and frame.attrs["lost"] == 0
        assert 0.4 < frame.index[-1] < 0.6 and len(frame) > 300
        assert frame["x.position"].abs().max() > 1.0
        assert frame["x.error"].abs().max() < 0.05
        machine.wait()
        assert machine.status()["state"] == "enabled"
        machine.home("y")
        machine.move("y", 3.0, 20.0)
        machine.jog("z", 5.0)
        machine.sleep(0.3)
        machine.stop()
        status = machine.wait()
        assert status["y"]["position_mm"] == pytest.approx(3.0, abs=0.01)
        assert status["z"]["position_mm"] > 0.5


def test_settings_of_a_machine_are_read_changed_and_loaded() -> None:
    with quadrant.Machine("simulated:commissioned") as machine:
        kp = machine.get("x/feedback/pid/kp_v_per_mm")
        machine.set("x/feedback/pid/kp_v_per_mm", 0.9 * kp)
        assert machine.settings()["x/feedback/pid/kp_v_per_mm"] == kp
        machine.apply()
        assert machine.settings()["x/feedback/pid/kp_v_per_mm"] == pytest.approx(0.9 * kp)
        with pytest.raises(RuntimeError, match="kp_v_per_mm"):
            machine.set("x/feedback/pid/kp_v_per_mm", -1.0)
            machine.apply()
        machine.set("x/feedback/pid/kp_v_per_mm", 0.9 * kp)
        other = quadrant.Settings.simulated()
        other["x/feedforward/kind"] = "none"
        machine.load(other)
        assert machine.get("x/feedforward/kind") == "none"
        with pytest.raises(RuntimeError, match="kpp"):
            machine.get("x/feedback/pid/kpp")


def test_a_fault_is_raised_with_code_axis_cause_and_remedy() -> None:
    stage = quadrant.Stage(coulomb_n=3000.0)
    with quadrant.Machine("simulated", stage=stage, settings=quadrant.Settings.simulated()) as machine:
        machine.enable()
        with pytest.raises(quadrant.Fault) as found:
            machine.run({"x": quadrant.Motion.sine(5.0, 50.0)})
            machine.wait()
        assert found.value.axis == "x" and found.value.code in (1, 7, 11, 28)
        assert found.value.remedy
        latched = machine.fault()
        assert isinstance(latched, quadrant.Fault) and latched.code == found.value.code
        machine.reset()
        assert machine.fault() is None


def test_leaving_a_machine_disables_it_whatever_happens(tmp_path: Path) -> None:
    machine = quadrant.Machine("simulated:commissioned")
    with pytest.raises(ZeroDivisionError), machine:
        machine.enable()
        1 / 0
    with pytest.raises(ConnectionError, match="closed"):
        machine.status()


def test_ctrl_c_stops_the_axes() -> None:
    with quadrant.Machine("simulated:commissioned") as machine:
        machine.enable()
        machine.run({"x": quadrant.Motion.sine(5.0, 20.0, cycles=1e5)})
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            machine.sleep(1e6)
        status = machine.wait()
        assert status["state"] == "enabled" and status["x"]["mode"] == "hold"


def test_places_that_are_none_are_refused() -> None:
    with pytest.raises(ValueError, match="ttyACM0"):
        quadrant.Machine("somewhere")
    with pytest.raises(ConnectionError, match="cannot be opened"):
        quadrant.Machine("/dev/there-is-no-such-port")
    with pytest.raises(ValueError, match="stage, settings and flash"):
        quadrant.Machine("tcp:127.0.0.1:1", stage=quadrant.Stage())


def test_recordings_go_through_csv_parquet_and_mat(tmp_path: Path) -> None:
    run = quadrant.simulate(quadrant.Settings.simulated(), quadrant.Motion.sine(5.0, 20.0, cycles=0.5, lead_s=0.2))
    recording = files.Recording(
        1e-4, run.measured_mm, run.output_v.astype(float), run.reference_mm, np.zeros(len(run))
    )
    files.to_csv(recording, tmp_path / "run.csv")
    again = files.read(tmp_path / "run.csv")
    assert np.array_equal(again.position_mm, recording.position_mm)
    assert again.sample_time_s == pytest.approx(1e-4)
    files.to_parquet(run, tmp_path / "run.parquet")
    frame = pandas.read_parquet(tmp_path / "run.parquet")
    assert np.array_equal(frame["word"], run.word)
    files.to_mat(recording, tmp_path / "run.mat")
    from_mat = files.read_mat(tmp_path / "run.mat", time="t_s", position="position_mm", voltage="voltage_v")
    assert np.array_equal(from_mat.voltage_v, recording.voltage_v)
    with pytest.raises(KeyError, match="there are"):
        files.read_mat(tmp_path / "run.mat", time="t", position="position_mm", voltage="voltage_v")
    files.to_parquet(recording.to_pandas(), tmp_path / "frame.parquet")


def test_a_file_of_another_program_is_read_by_its_columns_and_units(tmp_path: Path) -> None:
    time_s = np.arange(2000) * 1e-3
    position = 5.0 * np.sin(2 * np.pi * time_s)
    lines = ["Zeit;Istposition;Spannung"]
    lines += [f"{1e3 * t:.3f};{1e3 * x:.4f};{100 * np.cos(6 * t):.4f}".replace(".", ",") for t, x in zip(time_s, position)]
    path = tmp_path / "export.csv"
    path.write_text("\n".join(lines))
    found = files.read(path, "time=Zeit:ms,position=Istposition:um,voltage=Spannung:mV")
    assert np.allclose(found.position_mm, position, atol=1e-6)
    assert found.voltage_v[0] == pytest.approx(0.1)
    with pytest.raises(ValueError, match="columns"):
        files.read(path, "nonsense")
    with pytest.raises(OSError, match="missing.csv"):
        files.read(tmp_path / "missing.csv")


IMAGE = Path(__file__).parents[2] / "target/images/mps2-f32.elf"


@pytest.mark.skipif(not IMAGE.exists() or shutil.which("qemu-system-arm") is None, reason="no image, or no QEMU")
def test_the_image_in_qemu_is_a_machine_too() -> None:
    with quadrant.Machine(f"emulated:{IMAGE}") as machine:
        assert machine.identity["board"] == "mps2"
        machine.load(quadrant.Settings.simulated())
        machine.enable()
        machine.run({"x": quadrant.Motion.sine(2.0, 20.0, cycles=0.25, lead_s=0.1)})
        status = machine.wait()
        assert status["state"] == "enabled" and abs(status["x"]["position_mm"]) > 0.1
