"""MAT files in and out, by SciPy (``pip install 'imkit[mat]'``)."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _frames


def columns_of(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """The columns of a MAT file up to version 7: its vectors by name, and the fields of its structs (``data.ia``); those as long as the
    longest."""
    found: dict[str, np.ndarray] = {}
    _collect("", _io().loadmat(os.fspath(path), squeeze_me=True, struct_as_record=True), found)
    if not found:
        raise ValueError(f"{os.fspath(path)}: holds no vectors of numbers")
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
    _io().savemat(os.fspath(path), data, oned_as="column")


def _collect(prefix: str, value: Any, found: dict[str, np.ndarray]) -> None:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            if not name.startswith("__"):
                _collect(f"{prefix}{name}", inner, found)
    elif isinstance(value, np.ndarray) and value.dtype.names:
        for name in value.dtype.names:
            inner = value[name]
            _collect(f"{prefix}.{name}", inner.item() if inner.dtype == object and inner.ndim == 0 else inner, found)
    elif isinstance(value, np.ndarray) and value.ndim == 1 and np.issubdtype(value.dtype, np.number) and len(value) > 1:
        if np.iscomplexobj(value):
            found[f"{prefix}.re"], found[f"{prefix}.im"] = _frames.numbers(value.real), _frames.numbers(value.imag)
        else:
            found[prefix] = _frames.numbers(value)


def _io() -> Any:
    try:
        import scipy.io
    except ImportError as e:
        raise ImportError("MAT files need SciPy: pip install 'imkit[mat]'") from e
    return scipy.io
