import copy
import pickle
import threading
import time

import numpy as np
import pytest

import imkit


@pytest.mark.parametrize("name", imkit.OBSERVERS)
def test_observers_find_the_speed(motor, recording, name):
    t = recording.columns["t_s"]
    observer = imkit.Observer(name, motor, t[1] - t[0])
    seen = observer.run(recording)
    late = (t > 1.0) & (t < 1.35)
    true = recording.columns["omega_m_rad_s"][late]
    assert np.mean(np.abs(seen["omega_m_rad_s"][late] - true)) < 0.05 * np.mean(true)
    # In two parts it is the same: the state goes on.
    observer.reset()
    half = len(t) // 2
    u = np.concatenate([[0], recording.u_s[:-1]])
    parts = [observer.step(u[s], recording.i_s[s], recording.columns["omega_m_rad_s"][s]) for s in (slice(half), slice(half, None))]
    assert np.array_equal(np.concatenate([p["omega_m_rad_s"] for p in parts]), seen["omega_m_rad_s"])


def test_designed_gains_go_into_an_observer(motor, recording):
    certificate = imkit.design("kubota", motor)
    assert min(certificate.margins.values()) > 0
    again = imkit.check(certificate)
    assert again.gains == certificate.gains and not again.differences(motor)
    t = recording.columns["t_s"]
    observer = imkit.Observer("kubota", motor, t[1] - t[0], gains=certificate)
    # What it takes beside the certificate is said; of its own, it is no addition.
    assert set(observer.gains_not_given).isdisjoint(certificate.gains) and observer.gains_not_given
    assert not imkit.Observer("kubota", motor, t[1] - t[0]).gains_not_given
    assert observer.run(recording)["valid"].mean() > 0.5
    with pytest.raises(imkit.InputError, match="refused"):
        imkit.check(certificate.text.replace("digest = \"", "digest = \"0", 1))


@pytest.mark.parametrize("kind", ["observer", "controller"])
def test_other_threads_run_while_arrays_are_stepped_over(motor, kind):
    n = 1_000_000
    i, w = np.ones(n) * (2 + 1j), np.full(n, 100.0)
    if kind == "observer":
        steps = imkit.Observer("kubota", motor, 1e-4)
        work = threading.Thread(target=steps.step, args=(i, i))
    else:
        steps = imkit.Controller("kenne", motor, 1e-4)
        work = threading.Thread(target=steps.step, args=(i, w, i))
    ticks = 0
    work.start()
    while work.is_alive():
        time.sleep(0.001)
        ticks += 1
    assert ticks > 10


DRIVE = """
[scenario]
name = "drive"
duration_s = 1.0
sample_time_s = 1e-4
[controller]
name = "indirect_field_orientation"
rotor_flux_vs = 0.9
speed_rad_s = [[0, 0], [0.2, 0], [0.2, 80]]
[inverter]
kind = "averaged"
dc_voltage_v = 560
"""


def test_a_controller_gives_what_it_gives_in_a_simulation(bare):
    """What the simulated controller saw, given to one of ones own: the same commands."""
    recording = imkit.simulate(bare, DRIVE)[0]
    c, u = recording.columns, recording.u_s
    controller = imkit.Controller("indirect_field_orientation", bare, 1e-4, dc_voltage_v=560)
    wanted = np.where(c["t_s"] < 0.2 - 1e-9, 0.0, 80.0)
    before = np.concatenate([[0], u[:-1]])
    command = controller.step(recording.i_s, c["omega_m_rad_s"], before, omega_m_ref_rad_s=wanted, rotor_flux_ref_vs=0.9)
    assert c["omega_m_rad_s"][-1] == pytest.approx(80, rel=0.02)
    assert np.abs(command["u_s_V"] - u).max() < 1e-6 * np.abs(u).max()


def test_an_observer_takes_frames_and_refuses_rows_of_another_time(motor, recording):
    t = recording.columns["t_s"]
    seen = imkit.Observer("full-order", motor, t[1] - t[0]).run(recording.columns)
    assert np.array_equal(seen["omega_m_rad_s"], imkit.Observer("full-order", motor, t[1] - t[0]).run(recording)["omega_m_rad_s"])
    with pytest.raises(imkit.InputError, match="a row every 0.0002 s"):
        imkit.Observer("full-order", motor, 1e-4).run(recording)


def test_an_observer_takes_a_mapped_recording_and_a_file_as_their_mapping_says(motor, recording, tmp_path):
    from test_recording import MAPPING, foreign

    t = recording.columns["t_s"]
    wanted = imkit.Observer("full-order", motor, t[1] - t[0]).run(recording)["omega_m_rad_s"]
    recording.write_csv(tmp_path / "run.csv")
    for given in [imkit.Recording.from_frame(foreign(recording), MAPPING), imkit.Recording.from_file(tmp_path / "run.csv"), tmp_path / "run.csv"]:
        seen = imkit.Observer("full-order", motor, t[1] - t[0]).run(given)
        assert np.allclose(seen["t_s"], t) and np.allclose(seen["omega_m_rad_s"], wanted, atol=1e-6)
    with pytest.raises(imkit.InputError, match="no mapping says what its columns mean"):
        imkit.Observer("full-order", motor, t[1] - t[0]).run(foreign(recording))


def test_a_copy_of_an_observer_goes_its_own_way(motor, recording):
    t, u, i = recording.columns["t_s"], recording.u_s, recording.i_s
    whole = imkit.Observer("kubota", motor, t[1] - t[0]).step(u, i)["omega_m_rad_s"]
    first = imkit.Observer("kubota", motor, t[1] - t[0])
    first.step(u[:4000], i[:4000])
    for again in (copy.copy(first), copy.deepcopy(first)):
        assert np.array_equal(again.step(u[4000:], i[4000:])["omega_m_rad_s"], whole[4000:])
    assert np.array_equal(first.step(u[4000:], i[4000:])["omega_m_rad_s"], whole[4000:])
    with pytest.raises(TypeError, match="is not pickled: make one"):
        pickle.dumps(first)
    with pytest.raises(TypeError, match="neither copied nor pickled"):
        copy.copy(imkit.Controller("kenne", motor, 1e-4))


def test_a_certificate_can_be_sent_to_another_process(motor):
    certificate = imkit.design("kubota", motor)
    assert pickle.loads(pickle.dumps(certificate)).gains == certificate.gains


def test_what_is_wrong_is_said(motor):
    for make in (lambda: imkit.Observer("parrot", motor, 1e-4), lambda: imkit.Controller("parrot", motor, 1e-4), lambda: imkit.design("parrot", motor)):
        with pytest.raises(imkit.InputError, match="parrot"):
            make()
    with pytest.raises(imkit.InputError, match="as many"):
        imkit.Observer("kubota", motor, 1e-4).step(np.zeros(3), np.zeros(4))


def test_gains_come_as_certificate_file_or_text_and_of_another_machine_with_a_warning(motor, recording, tmp_path):
    certificate = imkit.design("kubota", motor)
    certificate.write(tmp_path / "gains.toml")
    motor.write(tmp_path / "motor.toml")
    step = float(np.diff(recording.columns["t_s"][:2])[0])
    given = (certificate, certificate.text, tmp_path / "gains.toml", str(tmp_path / "gains.toml"))
    speeds = [imkit.Observer("kubota", tmp_path / "motor.toml", step, gains=g).run(recording)["omega_m_rad_s"] for g in given]
    assert all(np.array_equal(s, speeds[0]) for s in speeds)
    other = imkit.Motor.from_nameplate(power_w=4000, voltage_v=400, current_a=8.1, speed_rpm=1440, power_factor=0.83)
    with pytest.warns(UserWarning, match="of another machine"):
        imkit.Observer("kubota", other, step, gains=certificate)
    assert "kubota" in repr(imkit.Observer("kubota", motor, step))
