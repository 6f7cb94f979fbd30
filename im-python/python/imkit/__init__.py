"""Induction-machine models against measurements: compare, fit, find the missing physical effect, design and run observers and controllers.

SI units; space vectors are complex, amplitude-invariant (peak value) and star-equivalent; numbers carry their unit in the name. Errors in
what is given are :class:`InputError`, with the program's message. Long calls let other Python threads run, and stop on Ctrl-C.

>>> import imkit
>>> motor = imkit.Motor.read("motor.toml")                                       # doctest: +SKIP
>>> found = imkit.diagnose(motor, ["a.csv", "b.csv"], holdout="c.csv")           # doctest: +SKIP
>>> found.verdict, found.named                                                   # doctest: +SKIP
('missing_effects', ['inverter_nonlinearity'])
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from . import _frames, _native, fleet, mat
from ._motor import Motor, motor_of as _motor
from ._native import CONTROLLERS, DESIGNS, OBSERVERS, InputError, __version__
from ._recording import Recording, read_text
from ._results import Comparison, Diagnosis, Fit, NextTest, Validation
from ._step import Certificate, Controller, Observer

__all__ = [
    "CONTROLLERS",
    "DESIGNS",
    "OBSERVERS",
    "Certificate",
    "Comparison",
    "Controller",
    "Diagnosis",
    "Fit",
    "InputError",
    "Motor",
    "NextTest",
    "Observer",
    "Recording",
    "Validation",
    "__version__",
    "check",
    "compare",
    "design",
    "diagnose",
    "effects",
    "example_region",
    "fit",
    "fleet",
    "learn",
    "mat",
    "next_test",
    "simulate",
    "validate",
]


def simulate(motor: Motor, scenario: str | os.PathLike[str], *, seed: int | None = None) -> tuple[Recording, Any]:
    """Runs a motor through a scenario: a file, or the text of one.

    Gives the recording that the sensors show, and a DataFrame of what no sensor shows: torque, fluxes, speed; of a refined motor also
    ``i_band_A`` and ``omega_band_rad_s``, half widths of the bands around the prediction that hold 95 % of readings.
    """
    text, label, folder = _scenario(scenario)
    native, inside = _native.simulate(_motor(motor)._native, text, label, folder, seed)
    return Recording._simulated(native), _frames.frame(inside)


def compare(motor: Motor, data: Any, *, anyway: bool = False, threads: int = 0) -> Comparison:
    """Where a motor and recordings disagree, without changing anything.

    ``data`` is a recording or several: :class:`Recording`, files, or data frames in canonical columns. ``threads`` is how many to use,
    0 for one for each processor.
    """
    recordings = _recordings(data)
    if not recordings:
        raise InputError("no recording is given: does a pattern match nothing?")
    return Comparison(_native.compare(_motor(motor)._native, recordings, anyway, _count(threads)))


def fit(
    motor: Motor,
    train: Any = (),
    *,
    holdout: Any = None,
    tables: Any = (),
    fix: Iterable[str] = (),
    anyway: bool = False,
    threads: int = 0,
) -> Fit:
    """Fits the parameters of a motor, and of the effects that it has, to all recordings and tables at once."""
    recordings, tables = _evidence(train, tables)
    return Fit(_native.fit(_motor(motor)._native, recordings, _one(holdout), tables, _names(fix), anyway, _count(threads)))


def diagnose(
    motor: Motor,
    train: Any = (),
    *,
    holdout: Any = None,
    tables: Any = (),
    fix: Iterable[str] = (),
    anyway: bool = False,
    significance: float = 0.01,
    learn: bool = False,
    threads: int = 0,
) -> Diagnosis:
    """Fits the motor, finds the physical effect that it lacks, adds it, and checks it on the held-out recording.

    ``fix`` names parameters that are held (``"inertia_kg_m2"``, ``"iron_loss.conductance_s"``); ``anyway`` goes on where what was
    noticed about the data makes the answer meaningless; ``significance`` is the chance of a false alarm over the whole library;
    ``learn`` learns as a curve what the library leaves unexplained.
    """
    learning = "unexplained" if learn else "never"
    return _diagnosed(motor, train, holdout, tables, fix, anyway, significance, learning, threads)


def learn(
    motor: Motor,
    train: Any = (),
    *,
    holdout: Any = None,
    tables: Any = (),
    fix: Iterable[str] = (),
    anyway: bool = False,
    significance: float = 0.01,
    unexplained: bool = False,
    threads: int = 0,
) -> Diagnosis:
    """:func:`diagnose` with curves that nobody wrote among the candidates: a torque over speed, a resistance over time.

    An effect of the library that explains as much wins. :meth:`Diagnosis.learned` gives the curves with their bands,
    :meth:`Diagnosis.formulas` what they look like, :meth:`Diagnosis.rust` the nearest formula as an effect of one's own. ``unexplained``
    learns only where the library leaves something unexplained; the rest is as in :func:`diagnose`.
    """
    learning = "unexplained" if unexplained else "always"
    return _diagnosed(motor, train, holdout, tables, fix, anyway, significance, learning, threads)


def validate(before: Motor, after: Motor, data: Any, *, anyway: bool = False) -> Validation:
    """Compares a motor before and after on a recording that neither has seen."""
    recordings = _recordings(data)
    if len(recordings) != 1:
        raise InputError(f"validate takes one recording, and here are {len(recordings)}: call it once for each")
    return Validation(_native.validate(_motor(before)._native, _motor(after)._native, recordings[0], anyway))


def next_test(
    motor: Motor,
    diagnosis: Diagnosis | None = None,
    *,
    effects: Iterable[str] = (),
    mains: bool | None = None,
    max_current: float | None = None,
    max_speed: float = 1.1,
    max_torque: float = 0.8,
) -> NextTest:
    """The manoeuvre that best settles what a diagnosis left open, or the effects in question.

    ``mains`` says that the mains feed the machine, not a drive; ``None``: as in the recordings of the diagnosis, else a drive. Limits are over
    the rated current (2.5 on a drive and 12 on the mains where nothing is said), the synchronous speed and the rated torque.
    """
    text = None if diagnosis is None else diagnosis._json
    return NextTest(_native.next_test(_motor(motor)._native, _names(effects), text, mains, (max_current, max_speed, max_torque)))


def design(kind: str, motor: Motor, region: str | os.PathLike[str] | None = None, *, period: float | str | None = None) -> Certificate:
    """Makes gains and proves them over a region: a ``region.toml``, its text, or the example's where nothing is said.

    ``kind`` is one of :data:`DESIGNS`; ``period`` is a sampling period in seconds, or ``"largest"``.
    """
    text = example_region(kind) if region is None else _text(region)
    return Certificate(_native.design(kind, _motor(motor)._native, text, None if period is None else str(period)))


def example_region(kind: str) -> str:
    """A commented region file for a design."""
    return _native.example_region(kind)


def check(certificate: Certificate | str | os.PathLike[str]) -> Certificate:
    """Decides a certificate again in exact arithmetic: a file, its text, or what :func:`design` gave. A false or altered one is refused."""
    if isinstance(certificate, Certificate):
        return Certificate(_native.check(certificate.text, "the certificate"))
    label = "the certificate" if "\n" in str(certificate) else os.fspath(certificate)
    return Certificate(_native.check(_text(certificate), label))


def effects() -> Any:
    """The library of physical effects: what each is, how it shows, which test excites it."""
    rows = [dict(row) for row in _native.effects()]
    keys = ["effect", "title", "what", "shows", "test", "parameters"]
    return _frames.frame({key: [row[key] for row in rows] for key in keys}, index="effect")


def _diagnosed(
    motor: Motor,
    train: Any,
    holdout: Any,
    tables: Any,
    fix: Iterable[str],
    anyway: bool,
    significance: float,
    learning: str,
    threads: int,
) -> Diagnosis:
    recordings, tables = _evidence(train, tables)
    native = _native.diagnose(
        _motor(motor)._native, recordings, _one(holdout), tables, _names(fix), anyway, significance, learning, _count(threads)
    )
    return Diagnosis(native)


def _recording(data: Any, name: str = "data frame") -> _native.Recording:
    if isinstance(data, Recording):
        return data._native
    if isinstance(data, (str, os.PathLike)):
        return Recording.from_file(data)._native
    return Recording.from_frame(data, name=name)._native


def _recordings(data: Any) -> list[_native.Recording]:
    several = isinstance(data, (list, tuple)) or (isinstance(data, Iterable) and not _is_one(data))
    return _told_apart([_recording(one, f"data frame {k}") for k, one in enumerate(data, 1)]) if several else [_recording(data)]


def _told_apart(recordings: list[_native.Recording]) -> list[_native.Recording]:
    """Those in memory that have one name are numbered, so that messages and reports say which is meant."""
    names = [r.name for r in recordings]
    alike = [names.count(name) > 1 for name in names]
    return [r.renamed(f"{r.name} {k}") if several else r for k, (r, several) in enumerate(zip(recordings, alike), 1)]


def _is_one(data: Any) -> bool:
    return isinstance(data, (Recording, str, os.PathLike, Mapping)) or hasattr(data, "columns") or hasattr(data, "dtype")


def _one(data: Any) -> _native.Recording | None:
    if isinstance(data, (list, tuple)):
        raise InputError("holdout is one recording, not a list of them")
    return None if data is None else _recording(data, "held-out data frame")


def _evidence(train: Any, tables: Any) -> tuple[list[_native.Recording], list[tuple[str, str | None]]]:
    recordings, files = _recordings(train), _tables(tables)
    if not recordings and not files:
        raise InputError("no recording and no table is given: does a pattern match nothing?")
    return recordings, files


def _names(names: str | Iterable[str]) -> list[str]:
    """One name stands for a list of one."""
    return [names] if isinstance(names, str) else list(names)


def _count(threads: int) -> int:
    if threads < 0:
        raise InputError(f"threads = {threads}: expected a number of threads, or 0 for one for each processor")
    return threads


def _tables(tables: Any) -> list[tuple[str, str | None]]:
    """Files, or pairs of a file and the mapping of its columns."""
    if isinstance(tables, (str, os.PathLike)):
        tables = [tables]
    if hasattr(tables, "columns") or hasattr(tables, "dtype"):
        raise InputError("tables are files, or pairs of a file and the mapping of its columns; write this one with to_csv()")
    pairs = [t if isinstance(t, tuple) else (t, None) for t in tables]
    return [(os.fspath(path), None if mapping is None else os.fspath(mapping)) for path, mapping in pairs]


def _text(given: str | os.PathLike[str]) -> str:
    """The text of a file, or what is a text already."""
    if isinstance(given, str) and "\n" in given:
        return given
    return read_text(given)


def _scenario(scenario: str | os.PathLike[str]) -> tuple[str, str, str]:
    if isinstance(scenario, str) and "\n" in scenario:
        return scenario, "the scenario", ""
    path = os.fspath(scenario)
    return _text(path), path, os.path.dirname(path)


def __dir__() -> list[str]:
    return __all__
