"""Friction models and their fits."""

from __future__ import annotations

import numpy as np
import pytest

import quadrant
from quadrant import friction

SLIDING = friction.Stribeck.of(0.12, 0.15, stribeck_velocity=1.0, viscous=1e-3)
ELEMENTS = ((21.4, 0.30), (7.5, 0.30), (2.66, 0.25), (0.75, 0.15))


def test_the_static_model_is_its_formula() -> None:
    v = np.array([-30.0, -0.5, 0.0, 0.5, 30.0])
    level = 0.12 + 0.03 * np.exp(-np.abs(v))
    assert np.allclose(SLIDING.force(v), np.sign(v) * level + 1e-3 * v, atol=1e-12)
    with pytest.raises(ValueError, match="coulomb = -1"):
        friction.Stribeck.of(-1.0, 0.1).force([1.0])


def test_gms_follows_its_virgin_curve_and_closes_its_loops() -> None:
    gms = friction.Gms(friction.Stribeck.of(0.15, 0.15), ELEMENTS, attraction=1e4)
    x = np.linspace(0.0, 0.05, 2001)
    stiffness, weight = np.array(ELEMENTS).T
    expected = np.minimum(stiffness * x[:, None], 0.15 * weight).sum(axis=1)
    assert np.allclose(gms.virgin_curve(x), expected)
    assert np.allclose(gms.force(None, x), expected, atol=2e-3)
    x, force = gms.loop(0.02, cycles=3.25)
    period = round(1 / 0.5 / 1e-4)
    assert np.allclose(force[-period], force[-1], atol=1e-3)


@pytest.mark.parametrize(
    "model",
    [
        friction.Gms(SLIDING, ELEMENTS),
        friction.SmoothedGms(SLIDING, ELEMENTS, width=0.25),
        friction.Dahl(SLIDING, stiffness=20.0, exponent=1.0),
        friction.LuGre(SLIDING, stiffness=20.0, damping=1e-4),
    ],
)
def test_every_model_slides_at_its_level_both_ways(model: friction.Gms | friction.Dahl | friction.LuGre) -> None:
    x = np.concatenate((np.linspace(0.0, 10.0, 5000), np.linspace(10.0, 0.0, 5000)))
    force = model.force(None, x, 1e-4)
    speed = 10.0 / 5000 / 1e-4
    level = 0.12 + 1e-3 * speed
    assert force[4900] == pytest.approx(level, rel=0.02)
    assert force[-1] == pytest.approx(-level, rel=0.02)


def test_hysteresis_gives_the_elements_back_with_standard_errors() -> None:
    truth = friction.Gms(friction.Stribeck.of(0.15, 0.15), ELEMENTS, attraction=5.0)
    step_s = 1e-3
    time_s = np.arange(40_000) * step_s
    x = 0.2 * np.sin(2 * np.pi * 0.1 * time_s)
    noise = np.random.default_rng(1).normal(0.0, 5e-4, len(x))
    fit = friction.fit_hysteresis(x, truth.force(None, x, step_s) + noise, step_s, elements=4)
    places = np.linspace(0.001, 0.04, 40)
    assert np.max(np.abs(fit.model.virgin_curve(places) - truth.virgin_curve(places))) < 0.05 * 0.15
    assert fit.relative_error < 0.03
    # Nothing on a level surface depends on the attraction rate.
    errors = {name: error for name, (_, error) in fit.parameters.items()}
    assert errors.pop("ln C") == np.inf
    assert all(0 < error < 1 for error in errors.values())
    with pytest.raises(ValueError, match="turned round"):
        friction.fit_hysteresis(x[:100], x[:100], step_s)


def test_runs_at_constant_velocity_give_the_static_model_back() -> None:
    speeds = np.concatenate([sign * np.geomspace(0.1, 40.0, 14) for sign in (-1.0, 1.0)])
    noise = np.random.default_rng(2).normal(0.0, 1e-4, len(speeds))
    fit = friction.fit_runs(speeds, SLIDING.force(speeds) + noise, 1e-4)
    for curve in (fit.model.positive, fit.model.negative):
        assert curve is not None
        assert curve.coulomb == pytest.approx(0.12, rel=0.02)
        assert curve.breakaway == pytest.approx(0.15, rel=0.03)
        assert curve.viscous == pytest.approx(1e-3, rel=0.05)
    value, error = fit.parameters["Fc, positive"]
    assert abs(value - 0.12) < 5 * error and fit.relative_error < 0.01
    assert "Fc, positive" in str(fit)


@pytest.mark.parametrize("model", [friction.Stribeck, friction.Gms, friction.Dahl, friction.LuGre])
def test_a_motion_gives_friction_and_inertia_with_withheld_validation(model: type) -> None:
    settings = quadrant.Settings.simulated()
    stage = quadrant.Stage(offset_mv=0, ripple_n=0)
    time_s = np.arange(0, 16.0, 1e-4)
    lead = np.minimum(1.0, time_s)
    reference = lead * (12.0 * np.sin(2 * np.pi * 1.5 * time_s) + 6.0 * np.sin(2 * np.pi * 0.45 * time_s))
    run = quadrant.simulate(settings, reference, stage)
    fit = friction.fit_motion(run.measured_mm, run.output_v, 1e-4, model=model, dead_time_s=1.25e-3)
    assert fit.validation_error is not None and fit.validation_error < 0.15
    truth = stage.truth_of("x")
    assert fit.details.plant.gain_mm_per_v_s2 == pytest.approx(truth["gain_mm_per_v_s2"], rel=0.1)
    sliding = fit.model if model is friction.Stribeck else fit.model.sliding
    assert sliding.positive.coulomb == pytest.approx(truth["positive"]["coulomb_v"], rel=0.1)
    value, error = fit.parameters["M'"]
    assert 0 < error < 0.2 * value
