import copy
import json
import os
import pickle
import signal
import threading
import time

import numpy as np
import pytest

import imkit
from conftest import EXAMPLES, SCENARIO


def test_the_loop_finds_what_was_left_out(bare, motor, recording, unseen, tmp_path):
    """Iron loss is left out of the motor: it is named, its size found, and the error falls on a recording nobody has fitted."""
    found = imkit.diagnose(bare, recording, holdout=unseen)
    assert found.named == ["iron_loss"], found
    size = found.refined.effects["iron_loss"]["conductance_s"]
    assert size == pytest.approx(motor.effects["iron_loss"]["conductance_s"], rel=0.1)
    assert found.steps()["holdout_rms_in_sigma"].iloc[-1] < 1.05
    assert found.candidates().iloc[0]["effect"] == "iron_loss"
    parameters = found.parameters()
    error = parameters["after"] - [_true(motor, name) for name in parameters.index]
    determined = parameters["std"].notna() & (parameters["std"] > 0)
    assert (np.abs(error[determined]) < 4 * parameters["std"][determined]).all(), parameters
    covariance = found.covariance()
    assert np.allclose(np.sqrt(np.diag(covariance)), parameters["std"][covariance.index], rtol=1e-6)
    signals = found.signals()
    assert len(signals) == 20_000 and "i_alpha_A_residual" in signals
    assert np.allclose(signals["i_alpha_A_measured"] - signals["i_alpha_A_modelled"], signals["i_alpha_A_residual"])
    found.write(tmp_path)
    written = json.loads((tmp_path / "diagnosis.json").read_text())
    assert written == found.to_dict() and written["effects"] == ["iron_loss"]
    assert sorted(os.listdir(tmp_path)) == ["data_quality.json", "diagnosis.json", "motor.refined.toml", "report.html"]
    assert (tmp_path / "report.html").read_text().startswith("<!DOCTYPE html>")
    assert imkit.Motor.read(tmp_path / "motor.refined.toml").effects["iron_loss"] == pytest.approx(found.refined.effects["iron_loss"])
    assert "<iframe" in found._repr_html_() and "iron loss" in str(found).lower()

    checked = imkit.validate(bare, found.refined, unseen).errors().set_index("error")
    assert checked.loc["not_nudged", "after"] < 0.5 * checked.loc["not_nudged", "before"]


def test_an_answer_is_tables_and_pictures(bare, recording):
    import matplotlib.figure

    matplotlib.use("Agg")
    found = imkit.diagnose(bare, recording)
    curves = found.torque_speed().groupby("motor")["torque_Nm"].max()
    assert set(curves.index) == {"before", "after"} and (curves > 20).all()
    fails = found.localisation()
    assert {"base model", "refined model"} == set(fails["model"]) and {"flux", "speed", "slip"} <= set(fails["over"])
    rms = fails[fails["error"] == "current"].groupby("model")["rms"].mean()
    assert rms["refined model"] < rms["base model"]
    # Always an array of axes, also on axes of one's own.
    panels = {what: len(found.plot(what)) for what in ("signals", "residuals", "candidates", "parameters", "torque_speed")}
    assert panels == {"signals": 3, "residuals": 3, "candidates": 1, "parameters": 1, "torque_speed": 1}
    own = matplotlib.figure.Figure().subplots()
    assert list(found.plot("candidates", ax=own)) == [own]
    with pytest.raises(imkit.InputError, match="parrot"):
        found.plot("parrot")
    for none in (found.rust, lambda: found.plot("learned")):
        with pytest.raises(imkit.InputError, match="no curve was learned"):
            none()
    with pytest.raises(imkit.InputError, match="0.7.*between 0 and 0.5"):
        imkit.diagnose(bare, recording, significance=0.7)


def test_an_effect_that_nobody_wrote_is_learned(bare, tmp_path):
    """A brake whose torque has a peak over speed, as no effect of the library has it: learned as a curve, with its band and formula."""
    recording, true = _braked(bare)
    found = imkit.learn(bare, recording, holdout=_braked(bare, seed=9)[0])
    assert [e for e in found.effects if e.startswith("learned_")], found.effects
    curve = found.learned()
    assert set(curve["adds"]) and len(curve) > 40
    assert (np.abs(curve["value"] - true(curve["x"])) < curve["half_band_95"] + 0.05).all(), curve
    # What is in proportion to speed friction takes in part, as the wide band says: together they are the brake.
    friction = found.parameters().loc["viscous_friction_nm_s_per_rad"]
    together = curve["value"] + (friction["after"] - friction["before"]) * curve["x"]
    assert (np.abs(together - true(curve["x"])) < 0.1 * 3.0).all(), curve
    peak = found.formulas().set_index("name")["formula"].filter(like="critical value")
    assert len(peak) == 1 and "impl" in found.rust()
    assert len(found.plot("learned")) == len(found.to_dict()["learned"])
    again = imkit.Motor.parse(found.refined.to_toml())
    assert set(again.effects) == set(found.refined.effects)


def _braked(bare, seed=2):
    """The brake stands in the recording's load, of which the motor knows nothing but the rest."""
    from conftest import SCENARIO

    def true(speed):
        return 3.0 * 2 * (speed / 40) / (1 + (speed / 40) ** 2)

    # A load over time that is the brake at the speed of the run, by a fixed point of two simulations.
    recording = imkit.simulate(bare, SCENARIO, seed=seed)[0]
    for _ in range(4):
        c = recording.columns
        every = slice(None, None, 20)
        plain = np.interp(c["t_s"], [0, 0.8, 0.8001, 1.6, 1.6001], [0, 0, 15, 15, 3])
        table = [[float(t), float(x)] for t, x in zip(c["t_s"][every], (plain + true(c["omega_m_rad_s"]))[every])]
        text = SCENARIO.replace("torque_nm = [[0, 0], [0.8, 0], [0.8, 15], [1.6, 15], [1.6, 3]]", f"torque_nm = {table}")
        recording = imkit.simulate(bare, text, seed=seed)[0]
    c = dict(recording.columns)
    c["tau_load_Nm"] = c["tau_load_Nm"] - true(c["omega_m_rad_s"])
    return imkit.Recording.from_frame(c), true


def _true(motor, name):
    if name.startswith("inverse_gamma."):
        return motor.inverse_gamma[name.removeprefix("inverse_gamma.")]
    if name in motor.parameters:
        return motor.parameters[name]
    effect, key = name.split(".", 1)
    return motor.effects[effect][key]


def test_a_fit_finds_the_parameters(motor, recording):
    away = imkit.Motor.parse(motor.to_toml().replace("= 0.9\n", "= 1.1\n").replace("= 1.5\n", "= 1.3\n"))
    fitted = imkit.fit(away, recording)
    assert fitted.motor.inverse_gamma == pytest.approx(motor.inverse_gamma, rel=0.02)
    assert fitted.rms_in_sigma == pytest.approx(1, abs=0.05)
    held = imkit.fit(away, recording, fix=["stator_resistance_ohm"])
    assert held.motor.parameters["stator_resistance_ohm"] == 1.3
    with pytest.raises(imkit.InputError, match="parrot"):
        imkit.fit(away, recording, fix=["parrot"])


def test_answers_are_sent_to_another_process_or_say_what_to_send(motor, recording):
    fitted = imkit.fit(motor, recording)
    again = pickle.loads(pickle.dumps(fitted))
    assert again.to_dict() == fitted.to_dict() and again.motor == fitted.motor
    compared = imkit.compare(motor, recording)
    assert copy.copy(compared) is compared
    with pytest.raises(TypeError, match=r"a Comparison holds .* keep to_dict\(\)"):
        pickle.dumps(compared)


def test_pictures_are_drawn(bare, recording):
    import matplotlib

    matplotlib.use("Agg")
    compared = imkit.compare(bare, recording)
    assert len(compared.plot()) == 3
    assert compared.findings and len(compared.errors()) == 3
    assert bare.plot()[0].lines


def test_the_next_test_is_a_scenario(bare):
    proposed = imkit.next_test(bare, effects=["iron_loss", "windage"])
    assert proposed.open == ["iron_loss", "windage"]
    recording, inside = imkit.simulate(bare, proposed.scenario)
    assert len(inside) == len(recording.columns["t_s"])
    with pytest.raises(imkit.InputError, match="parrot"):
        imkit.next_test(bare, effects=["parrot"])


def test_ctrl_c_ends_a_diagnosis(bare, motor, unseen):
    many = [imkit.simulate(motor, SCENARIO, seed=20 + k)[0] for k in range(8)]
    over, pressed = threading.Event(), []

    def press():
        # As a person would: again, if one went by before the work had begun.
        while not over.wait(0.4 if not pressed else 3.0):
            pressed.append(time.perf_counter())
            os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        try:
            imkit.diagnose(bare, many, holdout=unseen)
        finally:
            over.set()
    thread.join()
    assert time.perf_counter() - pressed[-1] < 2


def test_other_threads_run_meanwhile(bare, recording):
    ticks, over = [], threading.Event()

    def tick():
        while not over.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    begun = time.perf_counter()
    imkit.fit(bare, recording)
    took = time.perf_counter() - begun
    over.set()
    thread.join()
    during = [t for t in ticks if begun < t < begun + took]
    assert len(during) > 3 and np.max(np.diff(during)) < 0.5 * took


def test_threads_do_not_change_the_answer(bare, recording, unseen):
    answers = [imkit.diagnose(bare, recording, holdout=unseen, threads=n)._json for n in (1, 2)]
    assert answers[0] == answers[1]


def test_a_prediction_has_its_band(bare, recording, unseen):
    found = imkit.diagnose(bare, recording, holdout=unseen)
    predicted, inside = imkit.simulate(found.refined, SCENARIO)
    assert np.array_equal(np.asarray(inside["t_s"]), predicted.columns["t_s"])
    real = imkit.simulate(imkit.Motor.read(EXAMPLES / "motor.toml"), SCENARIO, seed=99)[0]
    off = np.abs(real.columns["omega_m_rad_s"] - predicted.columns["omega_m_rad_s"]) <= 2 * np.asarray(inside["omega_band_rad_s"])
    assert off.mean() > 0.9
    assert "i_band_A" not in imkit.simulate(bare, SCENARIO)[1]


def test_calls_that_cannot_be_meant_are_refused(bare, recording):
    for wrong, says in [
        (lambda: imkit.compare(bare, []), "no recording is given"),
        (lambda: imkit.diagnose(bare, []), "no recording and no table"),
        (lambda: imkit.diagnose(bare, recording, holdout=[recording]), "one recording"),
        (lambda: imkit.fit(bare, recording, tables=np.zeros(3)), "tables are files"),
        (lambda: imkit.validate(bare, bare, [recording, recording]), "takes one recording"),
        (lambda: imkit.fit(bare, [recording, recording]), "give it once"),
        (lambda: imkit.fit(bare, recording, threads=-1), "threads = -1"),
        (lambda: imkit.fit(bare, recording, fix="inertia"), "inertia"),
    ]:
        with pytest.raises(imkit.InputError, match=says):
            wrong()
    with pytest.raises(TypeError, match="Motor.read"):
        imkit.Motor("motor.toml")
    assert "Iterable" not in dir(imkit) and "Motor" in dir(imkit)
