"""The recording."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _frames, _native
from ._motor import Motor


class Recording:
    """A recording of one run: a file that is read when it is compared with a motor, or columns in memory.

    Canonical columns are ``t_s``, ``u_alpha_V``, ``u_beta_V``, ``i_alpha_A``, ``i_beta_A``, ``omega_m_rad_s`` and, where it is
    known, ``tau_load_Nm``; the voltage is the average from its row to the next. What other columns mean a mapping says:
    the content of a ``recording.toml``.
    """

    __slots__ = ("_file", "_native", "_origin")

    def __init__(self, native: _native.Recording, origin: tuple[Any, ...]) -> None:
        self._native = native
        self._origin = origin
        self._file: dict[str, np.ndarray] | None = None

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], mapping: Mapping[str, Any] | str | os.PathLike[str] | None = None) -> Recording:
        """Any file that the program reads (CSV, Parquet, a ``recording.toml``), ``.mat`` too (with SciPy).

        ``mapping`` says what the columns mean instead of the ``recording.toml`` beside the file: a dict of its tables, its text, or the file.
        """
        path = os.fspath(path)
        if not os.path.isfile(path):
            raise _native.InputError(f"{path}: cannot read it: {'it is a folder' if os.path.isdir(path) else 'there is no such file'}")
        if path.lower().endswith(".mat"):
            from . import mat

            return cls._of_columns(os.path.basename(path), mat.columns_of(path), mapping)
        file = _file_of(mapping)
        if mapping is None or file is not None:
            return cls(_native.Recording.file(path, file), ("file", path, file))
        columns = _native.Recording.file(path, None).read().arrays() or {}
        return cls._of_columns(os.path.basename(path), columns, mapping)

    @classmethod
    def from_frame(
        cls, frame: Any, mapping: Mapping[str, Any] | str | os.PathLike[str] | None = None, name: str = "data frame"
    ) -> Recording:
        """A data frame (pandas, Polars, Arrow), a structured array or a dict of arrays.

        ``mapping`` says what the columns mean, in the words of a ``recording.toml``: a dict of its tables, its text, or the file.

        >>> Recording.from_frame(df, {"time": {"column": "t", "unit": "ms"},
        ...                           "voltage": {"a": "ua", "b": "ub", "c": "uc"},
        ...                           "current": {"a": "ia", "b": "ib", "c": "ic"},
        ...                           "speed": {"column": "n", "unit": "rpm"}})  # doctest: +SKIP
        """
        return cls._of_columns(name, _frames.columns_of(frame), mapping)

    @classmethod
    def from_arrays(
        cls,
        *,
        t_s: Any,
        u_s: Any,
        i_s: Any,
        omega_m_rad_s: Any = None,
        tau_load_nm: Any = None,
        name: str = "arrays",
    ) -> Recording:
        """From arrays: time, space vectors of voltage and current (complex, peak value), speed where measured, and the load torque where known.

        A number stands for the whole of speed or load torque.
        """
        t, u, i = _frames.numbers(t_s, "t_s"), _frames.vectors(u_s, "u_s"), _frames.vectors(i_s, "i_s")
        columns = {"t_s": t, "u_alpha_V": u.real, "u_beta_V": u.imag, "i_alpha_A": i.real, "i_beta_A": i.imag}
        for key, values in (("omega_m_rad_s", omega_m_rad_s), ("tau_load_Nm", tau_load_nm)):
            if values is not None:
                columns[key] = _frames.numbers(_frames.whole(values, t.shape), key)
        return cls._of_columns(name, columns, None if "omega_m_rad_s" in columns else _without_speed("tau_load_Nm" in columns))

    @classmethod
    def _of_columns(
        cls, name: str, columns: Mapping[str, np.ndarray], mapping: Mapping[str, Any] | str | os.PathLike[str] | None
    ) -> Recording:
        pairs = [(column, _frames.numbers(values, column)) for column, values in columns.items()]
        # Of a dict nobody has seen the lines of its text: messages name its keys.
        native = _native.Recording.columns(name, pairs, _text(mapping), isinstance(mapping, Mapping))
        return cls(native, ("columns", name, mapping))

    @classmethod
    def _simulated(cls, native: _native.Recording) -> Recording:
        return cls(native, ("columns", native.name, None))

    @property
    def name(self) -> str:
        """What the recording is called in messages and reports."""
        return self._native.name

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """The columns as they stand in memory or in the file, which is read for it once; a field that is no number is NaN."""
        held = self._native.arrays()
        if held is not None:
            return held
        if self._file is None:
            self._file = self._native.read().arrays() or {}
        return dict(self._file)

    @property
    def u_s(self) -> np.ndarray:
        """Voltage as space vectors, V, of canonical columns."""
        return self._vector("u_alpha_V", "u_beta_V")

    @property
    def i_s(self) -> np.ndarray:
        """Current as space vectors, A, of canonical columns."""
        return self._vector("i_alpha_A", "i_beta_A")

    def _vector(self, alpha: str, beta: str) -> np.ndarray:
        columns = self.columns
        if alpha not in columns or beta not in columns:
            raise _native.InputError(
                f"{self.name}: has no columns {alpha}, {beta}, and a mapping is not applied here: give a frame with these columns"
            )
        return columns[alpha] + 1j * columns[beta]

    def _rows(self, motor: Motor) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
        """Time, voltage, current and speed as a drive would have seen them: canonical columns as they stand, others by their mapping."""
        # Of a file the checks say which rows count.
        columns = self._native.arrays() or {}
        if self._origin[-1] is None and {"t_s", "u_alpha_V", "u_beta_V", "i_alpha_A", "i_beta_A"} <= columns.keys():
            return columns["t_s"], self.u_s, self.i_s, columns.get("omega_m_rad_s")
        return self._native.replay(motor._native)

    def to_frame(self) -> Any:
        """The columns as a DataFrame."""
        return _frames.frame(self.columns)

    def write_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the columns as a CSV file that the program reads."""
        columns = self._native.arrays()
        if columns is None:
            raise _native.InputError(f"{self.name}: is a file already")
        np.savetxt(path, np.column_stack(list(columns.values())), fmt="%.17g", delimiter=",", header=",".join(columns), comments="")

    def check(self, motor: Motor) -> list[str]:
        """What the checks of the intake notice about the data, a sentence each."""
        return self._native.check(motor._native)[0]

    def draft(self, motor: Motor) -> str | None:
        """A first ``recording.toml`` for columns that nobody has said the meaning of; ``None`` where none is needed."""
        return self._native.check(motor._native)[1]

    def __reduce__(self) -> Any:
        kind, name, *rest = self._origin
        # What it computes with, not what has become of the arrays that it was made from.
        return _again, (kind, name, *([self.columns] if kind == "columns" else []), *rest)

    def __repr__(self) -> str:
        columns = self._native.arrays()
        if columns is None:
            return f"Recording({self.name!r})"
        rows = len(next(iter(columns.values())))
        return f"Recording({self.name!r}, {rows} rows: {', '.join(columns)})"


def _again(kind: str, *rest: Any) -> Recording:
    """A recording in another process."""
    if kind == "file":
        return Recording.from_file(*rest)
    return Recording._of_columns(*rest)


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file."""
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except OSError as e:
        raise _native.InputError(f"{os.fspath(path)}: cannot read it: {e.strerror}") from e


_COLUMNS = ("time", "speed", "load")


def _without_speed(has_load: bool) -> dict[str, Any]:
    """Canonical columns of a recording whose speed was not measured."""
    return {
        "time": "t_s",
        "voltage": {"alpha": "u_alpha_V", "beta": "u_beta_V", "instant": "held_from_row"},
        "current": {"alpha": "i_alpha_A", "beta": "i_beta_A"},
        "load": "tau_load_Nm" if has_load else {"unknown": True},
    }


def _file_of(mapping: Mapping[str, Any] | str | os.PathLike[str] | None) -> str | None:
    """The name of a file that holds the mapping: a path, or a text without a line's end and without an equals sign."""
    if isinstance(mapping, os.PathLike):
        return os.fspath(mapping)
    return mapping if isinstance(mapping, str) and mapping != "" and not any(c in mapping for c in "\n=") else None


def _text(mapping: Mapping[str, Any] | str | os.PathLike[str] | None) -> str | None:
    """The text of a ``recording.toml``."""
    if mapping is None:
        return None
    if isinstance(mapping, (str, os.PathLike)):
        file = _file_of(mapping)
        return str(mapping) if file is None else read_text(file)
    # One column may stand for its table: "speed": "n".
    whole = {key: {"column": value} if key in _COLUMNS and isinstance(value, str) else value for key, value in mapping.items()}
    return "".join(f"{key} = {_value(value)}\n" for key, value in whole.items())


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(v)}" for key, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    try:
        return repr(value if isinstance(value, int) else float(value))
    except (TypeError, ValueError) as e:
        raise _native.InputError(f"mapping: {value!r} is no text, number, list or table of a recording.toml; leave the key out where nothing is meant") from e
