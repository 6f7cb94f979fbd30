"""MAT files in and out, by SciPy, those of version 7.3 by h5py (``pip install scipy h5py``)."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _frames, _native


def columns_of(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """The columns of a MAT file: its vectors by name, and the fields of its structs (``data.ia``); those as long as the longest."""
    path = os.fspath(path)
    read = _read_hdf5 if _is_hdf5(path) else _read
    found: dict[str, np.ndarray] = {}
    for name, values in read(path):
        if np.iscomplexobj(values):
            found[f"{name}.re"], found[f"{name}.im"] = _frames.numbers(values.real), _frames.numbers(values.imag)
        else:
            found[name] = _frames.numbers(values)
    if not found:
        raise _native.InputError(f"{path}: holds no vectors of numbers")
    rows = max(len(x) for x in found.values())
    return {name: x for name, x in found.items() if len(x) == rows}


def write(path: str | os.PathLike[str], columns: Any) -> None:
    """Writes the columns of a data frame, a recording or a dict as a MAT file of column vectors (version 5).

    Columns of words are left out; in names what MATLAB does not take becomes an underscore.
    """
    from ._recording import Recording

    if isinstance(columns, Recording):
        columns = columns.columns or {}
    data = {re.sub(r"\W", "_", name): values.reshape(-1, 1) for name, values in _frames.columns_of(columns).items()}
    _scipy().savemat(os.fspath(path), data, oned_as="column")


def _vector(values: np.ndarray) -> bool:
    return values.ndim == 1 and np.issubdtype(values.dtype, np.number) and len(values) > 1


def _read(path: str) -> list[tuple[str, np.ndarray]]:
    """Vectors of a file up to version 7."""
    scipy = _scipy()
    try:
        content = scipy.loadmat(path, squeeze_me=True, struct_as_record=True)
    except OSError:
        raise
    except Exception as e:  # SciPy says in many ways that it cannot read a file.
        raise _native.InputError(f"{path}: no MAT file that can be read: {e}") from e
    found: list[tuple[str, np.ndarray]] = []
    _collect("", content, found)
    return found


def _collect(prefix: str, value: Any, found: list[tuple[str, np.ndarray]]) -> None:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            if not name.startswith("__"):
                _collect(f"{prefix}{name}", inner, found)
    elif isinstance(value, np.ndarray) and value.dtype.names:
        for name in value.dtype.names:
            inner = value[name]
            _collect(f"{prefix}.{name}", inner.item() if inner.dtype == object and inner.ndim == 0 else inner, found)
    elif isinstance(value, np.ndarray) and _vector(value):
        found.append((prefix, value))


def _is_hdf5(path: str) -> bool:
    """Version 7.3: HDF5 behind a header of 512 bytes."""
    with open(path, "rb") as file:
        head = file.read(520)
    return b"\x89HDF\r\n\x1a\n" in (head[:8], head[512:520])


def _read_hdf5(path: str) -> list[tuple[str, np.ndarray]]:
    """Vectors of a file of version 7.3: a struct is a group, a complex number two fields, a column a row."""
    try:
        import h5py
    except ImportError as e:
        raise ImportError(f"{path}: MAT version 7.3, which needs h5py: pip install h5py, or save(..., '-v7') in MATLAB") from e
    found: list[tuple[str, np.ndarray]] = []

    def take(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#") or item.attrs.get("MATLAB_class") in (b"char", b"cell"):
            return
        values = np.squeeze(item[()])
        if values.dtype.names == ("real", "imag"):
            values = values["real"] + 1j * values["imag"]
        if _vector(values):
            found.append((name.replace("/", "."), values))

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def _scipy() -> Any:
    try:
        import scipy.io
    except ImportError as e:
        raise ImportError("MAT files need SciPy: pip install scipy") from e
    return scipy.io
