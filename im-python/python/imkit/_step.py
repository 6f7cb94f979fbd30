"""Observers and controllers that step over whole arrays."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np

from . import _frames, _native
from ._motor import Motor, motor_of
from ._recording import Recording


class Observer:
    """A flux and speed observer with its state: the steps of the next arrays go on where the last ones ended.

    ``name`` is one of :data:`imkit.OBSERVERS`. ``gains`` are those of a :class:`Certificate`, a certificate's or gains file, its text, or a dict of
    its tables; without, those one starts from: :attr:`gains_not_given` says which were taken so beside given ones, of which a certificate's
    proof says nothing. ``plain`` leaves out what the motor knows of saturation and inverter.
    """

    def __init__(
        self,
        name: str,
        motor: Motor | str | os.PathLike[str],
        sample_time_s: float,
        gains: Certificate | str | os.PathLike[str] | dict[str, Any] | None = None,
        plain: bool = False,
    ) -> None:
        self.name = name
        self._motor = motor_of(motor)
        self._native = _native.Observer(name, self._motor._native, sample_time_s, _gains(gains, self._motor), plain)
        self._sample_time_s = float(sample_time_s)
        self._last = 0j

    @property
    def gains_not_given(self) -> dict[str, float]:
        """Gains that the observer took beside those given, which have no such keys."""
        return self._native.gains_not_given

    def run(self, recording: Any) -> dict[str, np.ndarray]:
        """Over a recording, with its mapping where it has one, a file, or a data frame in canonical columns; ``t_s`` comes with what :meth:`step` gives.

        As in ``im observe``, rows of a mapped recording or a file that the checks leave out are lost samples.
        """
        if not isinstance(recording, Recording):
            whole = isinstance(recording, (str, os.PathLike))
            recording = Recording.from_file(recording) if whole else Recording.from_frame(recording)
        t, u, i, speed = recording._rows(self._motor)
        step = float(np.median(np.diff(t))) if len(t) > 1 else self._sample_time_s
        if not abs(step - self._sample_time_s) <= 0.01 * self._sample_time_s:
            raise _native.InputError(f"{recording.name}: a row every {step:.4g} s, but sample_time_s = {self._sample_time_s:g}: make the observer for it")
        before = np.concatenate([[self._last], u[:-1]])
        self._last = u[-1]
        return {"t_s": t, **self.step(before, i, speed)}

    def step(self, u_s: Any, i_s: Any, omega_m_rad_s: Any = None) -> dict[str, np.ndarray]:
        """Row by row: the mean voltage over the sample that ends there (V), the current then (A), and the measured speed, which only
        the current model reads.

        Gives ``omega_m_rad_s``, ``psi_r_Vs``, ``torque_Nm``, ``residual_A`` and ``valid``. A current that is NaN is a lost sample.
        """
        speed = None if omega_m_rad_s is None else _frames.numbers(omega_m_rad_s)
        return self._native.run(_frames.vectors(u_s), _frames.vectors(i_s), speed)

    def reset(self) -> None:
        """Back to standstill."""
        self._native.reset()
        self._last = 0j

    def __copy__(self) -> Observer:
        """Another observer in the same state; each goes its own way from there."""
        other = object.__new__(Observer)
        other.__dict__.update(self.__dict__)
        other._native = self._native.copied()
        return other

    def __deepcopy__(self, memo: Any) -> Observer:
        return self.__copy__()

    def __reduce__(self) -> Any:
        raise TypeError(f"{self!r} is not pickled: make one from its name, motor, sampling time and gains where it is to run")

    def __repr__(self) -> str:
        return f"Observer({self.name!r}, {self._motor.name!r}, sample_time_s={self._sample_time_s:g})"


class Controller:
    """A controller with its state, behind the limits of a drive; ``name`` is one of :data:`imkit.CONTROLLERS`.

    ``observer`` names the observer whose speed stands in for the sensor's.
    """

    def __init__(
        self,
        name: str,
        motor: Motor | str | os.PathLike[str],
        sample_time_s: float,
        *,
        dc_voltage_v: float | None = None,
        current_limit_a: float | None = None,
        observer: str | None = None,
    ) -> None:
        self.name = name
        self._dc_voltage_v = dc_voltage_v
        motor = motor_of(motor)
        self._native = _native.Controller(name, motor._native, sample_time_s, dc_voltage_v, current_limit_a, observer)
        self._shown = f"Controller({name!r}, {motor.name!r}, sample_time_s={sample_time_s:g})"

    def __reduce__(self) -> Any:
        raise TypeError(f"{self._shown} is neither copied nor pickled: make another from its name, motor and sampling time")

    def __repr__(self) -> str:
        return self._shown

    def step(
        self,
        i_s: Any,
        omega_m_rad_s: Any,
        u_s: Any,
        *,
        omega_m_ref_rad_s: Any = 0.0,
        rotor_flux_ref_vs: Any = 0.0,
        torque_ref_nm: Any = 0.0,
        dc_voltage_v: Any = None,
    ) -> dict[str, Any]:
        """Row by row: current (A) and speed at the beginning of a sample, the voltage over the one before, and what is asked for; numbers
        stand for the whole array.

        Gives the command, ``u_s_V`` or for MTPA ``i_s_A``, and ``status``.
        """
        i = _frames.vectors(i_s)

        def whole(x: Any) -> np.ndarray:
            return np.ascontiguousarray(np.broadcast_to(np.asarray(x, dtype=np.float64), i.shape))

        voltage = _frames.vectors(_frames.whole(u_s, i.shape))
        dc = dc_voltage_v if dc_voltage_v is not None else (self._dc_voltage_v or 0.0)
        return self._native.run(
            i, whole(omega_m_rad_s), voltage, whole(dc), whole(omega_m_ref_rad_s), whole(rotor_flux_ref_vs), whole(torque_ref_nm)
        )


class Certificate:
    """Gains with everything that their proof needs: made by :func:`imkit.design`, decided again by :func:`imkit.check`."""

    def __init__(self, native: _native.Certificate) -> None:
        self._native = native

    @property
    def kind(self) -> str:
        """The design: one of :data:`imkit.DESIGNS`."""
        return self._native.kind

    @property
    def gains(self) -> dict[str, float | list[float] | list[list[float]]]:
        """The gains by name, in SI units."""
        return self._native.gains()

    @property
    def margins(self) -> dict[str, float]:
        """What was decided, and by how much it holds."""
        return dict(self._native.margins())

    @property
    def text(self) -> str:
        """The file that ``im design`` writes."""
        return self._native.text

    def differences(self, motor: Motor) -> list[tuple[str, str, str]]:
        """In what the certificate's machine differs from ``motor``: key, value there, value here. Empty: it is about this motor."""
        return self._native.differences(motor._native)

    def write(self, path: Any) -> None:
        """Writes the file that ``im design`` writes."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.text)

    def __reduce__(self) -> Any:
        # Decided again where it arrives.
        return _decided, (self.text,)

    def __repr__(self) -> str:
        return f"Certificate({self.kind!r}, {len(self.margins)} obligations decided, gains={self.gains})"


def _decided(text: str) -> Certificate:
    """A certificate in another process."""
    return Certificate(_native.check(text, "certificate"))


def _gains(gains: Any, motor: Motor) -> str:
    """The gains file's text. A certificate is decided again where it comes as a file or a text; of another machine it proves nothing here."""
    from ._recording import _text

    if gains is None:
        return ""
    if not isinstance(gains, Certificate):
        text = _text(gains) or ""
        if not any(line.startswith("digest") for line in text.splitlines()):
            return text
        gains = Certificate(_native.check(text, "gains"))
    for key, there, here in gains.differences(motor):
        warnings.warn(f"the certificate is of another machine: {key} is {there} there and {here} here", stacklevel=3)
    return gains._native.gains_toml
