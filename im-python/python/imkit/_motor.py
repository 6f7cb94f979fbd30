"""The motor."""

from __future__ import annotations

import html
import os
from typing import Any

from . import _frames, _native, _pictures


class Motor:
    """A motor: its T circuit and mechanics, pole pairs, rating, physical effects, and what is known of its parameters.

    Star-equivalent, per phase, SI units. Made by :meth:`read`, :meth:`parse`, :meth:`from_nameplate`, :meth:`from_t`,
    :meth:`from_gamma` or :meth:`from_inverse_gamma`; it never changes.

    >>> motor = Motor.from_nameplate(power_w=4000, voltage_v=400, current_a=8.1, speed_rpm=1440, power_factor=0.83)
    >>> motor.pole_pairs
    2
    """

    __slots__ = ("_native",)

    def __init__(self, native: _native.Motor) -> None:
        if not isinstance(native, _native.Motor):
            raise TypeError("a motor is made by Motor.read(file), Motor.parse(text) or Motor.from_…(), not by Motor(…)")
        self._native = native

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Motor:
        """Reads a ``motor.toml``."""
        return cls(_native.Motor.read(os.fspath(path)))

    @classmethod
    def parse(cls, text: str, label: str = "motor.toml") -> Motor:
        """Reads the text of a ``motor.toml``; ``label`` names it in messages."""
        return cls(_native.Motor.parse(text, label))

    @classmethod
    def from_nameplate(
        cls,
        *,
        power_w: float,
        voltage_v: float,
        current_a: float,
        speed_rpm: float,
        power_factor: float,
        frequency_hz: float = 50.0,
        locked_current: float | None = None,
        breakdown_torque: float | None = None,
        design: str | None = None,
        terminal_resistance_ohm: float | None = None,
        resistance_at_c: float | None = None,
        name: str = "motor",
    ) -> Motor:
        """A first motor from its nameplate, every parameter with the tolerance of such a guess, which fits respect.

        Voltage and current are line-to-line and line values, rms. ``locked_current`` is the locked-rotor over the rated
        current, ``breakdown_torque`` the breakdown over the rated torque; ``design`` (A, B, C, D, N, H or "wound") shares
        the leakage between stator and rotor. ``terminal_resistance_ohm``, measured between two terminals with direct
        current at a winding of ``resistance_at_c``, replaces a guess.
        """
        return cls(
            _native.Motor.from_nameplate(
                name,
                power_w,
                voltage_v,
                current_a,
                speed_rpm,
                power_factor,
                frequency_hz,
                locked_current,
                breakdown_torque,
                design,
                terminal_resistance_ohm,
                resistance_at_c,
            )
        )

    @classmethod
    def from_t(
        cls,
        *,
        pole_pairs: int,
        stator_resistance_ohm: float,
        rotor_resistance_ohm: float,
        stator_leakage_inductance_h: float,
        rotor_leakage_inductance_h: float,
        magnetizing_inductance_h: float,
        inertia_kg_m2: float,
        viscous_friction_nm_s_per_rad: float,
        name: str = "motor",
    ) -> Motor:
        """From the T circuit; the rating is guessed."""
        values = [
            stator_resistance_ohm,
            rotor_resistance_ohm,
            stator_leakage_inductance_h,
            rotor_leakage_inductance_h,
            magnetizing_inductance_h,
            inertia_kg_m2,
            viscous_friction_nm_s_per_rad,
        ]
        return cls(_native.Motor.from_t(name, pole_pairs, values))

    @classmethod
    def from_gamma(
        cls,
        *,
        pole_pairs: int,
        stator_resistance_ohm: float,
        rotor_resistance_ohm: float,
        leakage_inductance_h: float,
        stator_inductance_h: float,
        inertia_kg_m2: float,
        viscous_friction_nm_s_per_rad: float,
        leakage_ratio: float = 1.0,
        name: str = "motor",
    ) -> Motor:
        """From the Γ circuit; ``leakage_ratio`` is L_ls/L_lr of the T circuit, which the Γ circuit does not hold."""
        values = [stator_resistance_ohm, rotor_resistance_ohm, leakage_inductance_h, stator_inductance_h]
        mechanics = [inertia_kg_m2, viscous_friction_nm_s_per_rad]
        return cls(_native.Motor.from_gamma(name, pole_pairs, values, leakage_ratio, mechanics))

    @classmethod
    def from_inverse_gamma(
        cls,
        *,
        pole_pairs: int,
        stator_resistance_ohm: float,
        rotor_resistance_ohm: float,
        leakage_inductance_h: float,
        magnetizing_inductance_h: float,
        inertia_kg_m2: float,
        viscous_friction_nm_s_per_rad: float,
        leakage_ratio: float = 1.0,
        name: str = "motor",
    ) -> Motor:
        """From the inverse-Γ circuit; ``leakage_ratio`` is L_ls/L_lr of the T circuit, which this circuit does not hold."""
        values = [stator_resistance_ohm, rotor_resistance_ohm, leakage_inductance_h, magnetizing_inductance_h]
        mechanics = [inertia_kg_m2, viscous_friction_nm_s_per_rad]
        return cls(_native.Motor.from_inverse_gamma(name, pole_pairs, values, leakage_ratio, mechanics))

    @property
    def name(self) -> str:
        """What the motor is called."""
        return self._native.name

    @property
    def pole_pairs(self) -> int:
        """Pole pairs."""
        return self._native.pole_pairs

    @property
    def parameters(self) -> dict[str, float]:
        """The T circuit and the mechanics, by the keys of a ``motor.toml``."""
        return self._native.parameters()

    @property
    def gamma(self) -> dict[str, float]:
        """The Γ circuit."""
        return self._native.gamma()

    @property
    def inverse_gamma(self) -> dict[str, float]:
        """The inverse-Γ circuit: what currents and voltages determine."""
        return self._native.inverse_gamma()

    @property
    def rating(self) -> dict[str, float]:
        """What the motor is built for."""
        return self._native.rating()

    @property
    def effects(self) -> dict[str, dict[str, float]]:
        """The physical effects that are on, each with its parameters."""
        return self._native.effects()

    def to_toml(self) -> str:
        """The text of a ``motor.toml``."""
        return self._native.to_toml()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a ``motor.toml``; every command of the program takes it as ``--motor``."""
        self._native.write(os.fspath(path))

    def torque_speed(
        self, *, phase_voltage_peak_v: float | None = None, frequency_hz: float | None = None, points: int = 200
    ) -> Any:
        """The static torque-speed curve on a sinusoidal supply, rated where nothing is said: ``omega_m_rad_s``, ``torque_Nm`` and the
        peak current ``i_s_A``."""
        speed, torque, current = self._native.torque_speed(phase_voltage_peak_v, frequency_hz, points)
        return _frames.frame({"omega_m_rad_s": speed, "torque_Nm": torque, "i_s_A": current})

    def plot(self, ax: Any = None) -> Any:
        """The static torque-speed curve; an array of one Matplotlib axes, as every ``plot()`` gives an array."""
        curve = self.torque_speed()
        return _pictures.curves(ax, [(self.name, curve)], "omega_m_rad_s", "torque_Nm")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Motor) and self._native == other._native

    def __hash__(self) -> int:
        return hash(self.to_toml())

    def __reduce__(self) -> Any:
        return Motor, (self._native,)

    def __repr__(self) -> str:
        values = ", ".join(f"{key}={value:.4g}" for key, value in self.parameters.items())
        effects = f", effects={sorted(self.effects)}" if self.effects else ""
        return f"Motor({self.name!r}, pole_pairs={self.pole_pairs}, {values}{effects})"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{html.escape(k)}</td><td>{v:.4g}</td></tr>" for k, v in self.parameters.items())
        on = html.escape(", ".join(sorted(self.effects)) or "none")
        return f"<b>{html.escape(self.name)}</b>, {self.pole_pairs} pole pairs<table>{rows}</table>effects: {on}"


def motor_of(motor: Any) -> Motor:
    """A motor, or the file of one."""
    return motor if isinstance(motor, Motor) else Motor.read(motor)
