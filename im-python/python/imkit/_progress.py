"""That long work lives, where somebody sees it: on a terminal or in a notebook."""

from __future__ import annotations

import sys
import time
from typing import Any

_PATIENCE_S = 0.8
"""Shorter work says nothing."""


class Life:
    """What is being done, for how long; gone when it is over."""

    silent = False
    """Set in workers, whose master speaks for them."""

    def __init__(self, what: str) -> None:
        self._what, self._begun, self._shown = what, time.monotonic(), ""
        self._output = None if Life.silent else _output()

    def show(self, what: str | None = None) -> None:
        """Called now and then meanwhile."""
        self._what = what or self._what
        elapsed = time.monotonic() - self._begun
        if elapsed > _PATIENCE_S:
            self._say(f"{self._what}, {elapsed:.0f} s")

    def end(self) -> None:
        """Takes away what was shown."""
        self._say("")

    def _say(self, text: str) -> None:
        if self._output is not None and text != self._shown:
            self._output.say(text)
            self._shown = text


class _Terminal:
    def say(self, text: str) -> None:
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()


class _Notebook:
    _display: Any = None

    def say(self, text: str) -> None:
        from IPython.display import display

        data = {"text/plain": text}
        if self._display is None:
            self._display = display(data, raw=True, display_id=True)
        else:
            self._display.update(data, raw=True)


def _output() -> _Terminal | _Notebook | None:
    """If nobody can see it, nothing is said."""
    if sys.stderr is not None and sys.stderr.isatty():
        return _Terminal()
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return _Notebook() if hasattr(shell, "kernel") else None
