"""Tables of other libraries, by what they can do: columns with names, each of which NumPy can read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._native import InputError


def columns_of(frame: Any) -> dict[str, np.ndarray]:
    """The numeric columns of a data frame (pandas, Polars, Arrow, anything that gives an Arrow stream), a structured array or a mapping of
    arrays.

    Columns of words are left out. Missing values are NaN, time stamps seconds since 1970, spans of time seconds. An index with a name is a
    column, too.
    """
    index = getattr(getattr(frame, "index", None), "name", None)
    if index is not None and hasattr(frame, "reset_index") and index not in frame.columns:
        frame = frame.reset_index()
    if not isinstance(frame, Mapping) and not hasattr(frame, "columns") and hasattr(frame, "__arrow_c_stream__"):
        import pyarrow

        frame = pyarrow.table(frame)
    out = {}
    for name in _names(frame):
        column = frame[name] if not hasattr(frame, "column") else frame.column(name)
        values = _values(column)
        if np.issubdtype(values.dtype, np.datetime64):
            values = values.astype("datetime64[ns]").astype(np.int64) * 1e-9
        elif np.issubdtype(values.dtype, np.timedelta64):
            values = values / np.timedelta64(1, "s")
        elif np.issubdtype(values.dtype, np.complexfloating):
            out[f"{name}.re"], out[f"{name}.im"] = numbers(values.real), numbers(values.imag)
            continue
        try:
            out[str(name)] = numbers(values)
        except (TypeError, ValueError):
            _refuse_commas(str(name), values)
    return out


def _refuse_commas(name: str, values: np.ndarray) -> None:
    """Words are left out; numbers that were read as words are not."""
    words = (str(v) for v in values.ravel() if v is not None and str(v).strip() not in ("", "nan"))
    first = next(words, "")
    if re.fullmatch(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*", first):
        raise InputError(f"{name}: holds the text {first!r} where numbers are needed: read the file with decimal=\",\"")


def _values(column: Any) -> np.ndarray:
    """A column as an array; where it can be empty it is NaN there."""
    values = np.asarray(unmasked(column))
    if values.dtype == object and hasattr(column, "to_numpy"):
        try:
            return column.to_numpy(dtype=np.float64, na_value=np.nan)
        except (TypeError, ValueError):
            pass
    return values


def _names(frame: Any) -> list[str]:
    if isinstance(frame, Mapping):
        return list(frame)
    for attribute in ("column_names", "columns"):
        names = getattr(frame, attribute, None)
        if names is not None and not callable(names):
            return list(names)
    names = getattr(getattr(frame, "dtype", None), "names", None)
    if names:
        return list(names)
    raise TypeError(f"a {type(frame).__name__} has no columns with names: give a data frame or a dict of arrays")


def unmasked(values: Any) -> Any:
    """What a mask hides is missing: NaN."""
    if not isinstance(values, np.ma.MaskedArray):
        return values
    kind = np.complex128 if np.iscomplexobj(values) else np.float64
    return np.ma.filled(values.astype(kind), np.nan)


def numbers(values: Any, name: str = "a column") -> np.ndarray:
    """One-dimensional 64-bit numbers, in one piece."""
    array = np.asarray(unmasked(values))
    if np.iscomplexobj(array):
        raise InputError(f"{name}: complex numbers where real ones are needed")
    return _one_dimensional(array, np.float64, name)


def vectors(values: Any, name: str = "a space vector") -> np.ndarray:
    """One-dimensional space vectors; real arrays are α."""
    return _one_dimensional(unmasked(values), np.complex128, name)


def whole(values: Any, shape: tuple[int, ...]) -> Any:
    """A number stands for an array of it."""
    return np.full(shape, values) if np.ndim(values) == 0 else values


def _one_dimensional(values: Any, dtype: Any, name: str) -> np.ndarray:
    array = np.asarray(values)
    if array.ndim > 1:
        raise InputError(f"{name}: an array of {array.ndim} dimensions where one is needed")
    return np.ascontiguousarray(array, dtype=dtype)


def frame(columns: Mapping[str, Any], index: str | None = None) -> Any:
    """A pandas DataFrame; without pandas the columns as they are."""
    try:
        import pandas
    except ImportError:
        return dict(columns)
    made = pandas.DataFrame(columns)
    return made if index is None else made.set_index(index)


def stacked(parts: list[dict[str, Any]]) -> Any:
    """Recordings one below the other, as the program's `--signals` writes them."""
    names = [name for part in parts for name in part]
    names = list(dict.fromkeys(names))

    def whole(name: str) -> np.ndarray:
        def of(part: dict[str, Any]) -> np.ndarray:
            rows = len(part["t_s"])
            if name == "recording":
                return np.full(rows, part["recording"], dtype=object)
            return part.get(name, np.full(rows, np.nan))

        return np.concatenate([of(part) for part in parts])

    return frame({name: whole(name) for name in names})
