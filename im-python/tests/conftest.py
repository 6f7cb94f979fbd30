"""What the tests share: the motor of the examples, and recordings of it."""

from pathlib import Path

import pytest

import imkit

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

SCENARIO = """
[scenario]
name = "ramp, load step, slow down"
duration_s = 2.0
sample_time_s = 2e-4
[volts_per_hertz]
voltage_peak_v = 326.6
frequency_hz = 50
boost_v = 12
ramp_hz_per_s = 80
reference_hz = [[0, 40], [1.4, 40], [1.4, 15]]
[load]
torque_nm = [[0, 0], [0.8, 0], [0.8, 15], [1.6, 15], [1.6, 3]]
[sensors]
current_noise_a = 0.05
speed_noise_rad_s = 0.1
seed = 2
"""


@pytest.fixture(scope="session")
def motor() -> imkit.Motor:
    """The motor of the examples, with iron loss."""
    return imkit.Motor.read(EXAMPLES / "motor.toml")


@pytest.fixture(scope="session")
def bare(motor) -> imkit.Motor:
    """The same without its effect."""
    return imkit.Motor.parse(motor.to_toml().split("[effects")[0])


@pytest.fixture(scope="session")
def recording(motor) -> imkit.Recording:
    return imkit.simulate(motor, SCENARIO)[0]


@pytest.fixture(scope="session")
def unseen(motor) -> imkit.Recording:
    return imkit.simulate(motor, SCENARIO.replace("40]", "35]"), seed=7)[0]
