import pickle

import numpy as np
import pytest

import imkit


def test_circuits_are_one_machine(motor):
    """From the Γ and the inverse-Γ circuit with the ratio of the leakages the T circuit comes back."""
    t = motor.parameters
    mechanics = {key: t[key] for key in ("inertia_kg_m2", "viscous_friction_nm_s_per_rad")}
    ratio = t["stator_leakage_inductance_h"] / t["rotor_leakage_inductance_h"]
    for make, circuit in [(imkit.Motor.from_gamma, motor.gamma), (imkit.Motor.from_inverse_gamma, motor.inverse_gamma)]:
        again = make(pole_pairs=motor.pole_pairs, leakage_ratio=ratio, **circuit, **mechanics)
        assert again.parameters == pytest.approx(t, rel=1e-9)


def test_a_nameplate_gives_a_motor_that_pulls_its_load():
    motor = imkit.Motor.from_nameplate(power_w=4000, voltage_v=400, current_a=8.1, speed_rpm=1440, power_factor=0.83)
    assert motor.pole_pairs == 2
    curve = motor.torque_speed()
    rated = 4000 / (1440 * 2 * np.pi / 60)
    assert np.max(curve["torque_Nm"]) > 1.5 * rated
    # Without load it runs at synchronous speed.
    assert np.interp(50 * np.pi, curve["omega_m_rad_s"], curve["torque_Nm"]) == pytest.approx(0, abs=0.05 * rated)


def test_a_motor_is_its_file(motor, tmp_path):
    motor.write(tmp_path / "m.toml")
    assert imkit.Motor.read(tmp_path / "m.toml") == motor
    assert pickle.loads(pickle.dumps(motor)) == motor
    assert motor.effects["iron_loss"]["conductance_s"] == 0.001
    assert "4 kW" in motor._repr_html_()


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (lambda m: imkit.Motor.read("no.toml"), "no.toml"),
        (lambda m: imkit.Motor.parse(m.to_toml().replace("pole_pairs = 2", "pole_pairs = 0")), "pole_pairs"),
        (lambda m: imkit.Motor.from_nameplate(power_w=-1, voltage_v=400, current_a=8, speed_rpm=1440, power_factor=0.8), "power_w"),
    ],
)
def test_what_is_wrong_is_said(motor, wrong, says):
    with pytest.raises(imkit.InputError, match=says):
        wrong(motor)


def test_the_library_of_effects():
    library = imkit.effects()
    assert {"iron_loss", "rotor_asymmetry", "main_flux_saturation"} <= set(library.index)
