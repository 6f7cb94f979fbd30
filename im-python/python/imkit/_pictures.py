"""Pictures with Matplotlib, which is asked for only here."""

from __future__ import annotations

from typing import Any

import numpy as np


def axes(ax: Any, rows: int = 1) -> Any:
    """The axes given, or new ones."""
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError as e:
        raise ImportError("plot() needs Matplotlib: pip install 'imkit[plot]'") from e
    return pyplot.subplots(rows, 1, sharex=True, squeeze=False, figsize=(8, 2.2 * rows + 1))[1][:, 0]


def curves(ax: Any, named: list[tuple[str, Any]], x: str, y: str) -> Any:
    """Curves over a common axis."""
    ax = axes(ax)[0] if ax is None else ax
    for name, curve in named:
        ax.plot(np.asarray(curve[x]), np.asarray(curve[y]), label=name)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.legend()
    return ax


def signals(parts: list[dict[str, Any]], recording: int | str, ax: Any) -> Any:
    """Measured and modelled over time, one panel for each signal."""
    names = [part["recording"] for part in parts]
    part = parts[names.index(recording) if isinstance(recording, str) else recording]
    channels = [name.removesuffix("_measured") for name in part if name.endswith("_measured")]
    channels = [name for name in channels if np.isfinite(part[f"{name}_modelled"]).any()]
    panels = np.atleast_1d(axes(ax, len(channels)))
    for panel, name in zip(panels, channels):
        panel.plot(part["t_s"], part[f"{name}_measured"], color="0.6", label="measured")
        panel.plot(part["t_s"], part[f"{name}_modelled"], linewidth=1, label="modelled")
        panel.set_ylabel(name)
    panels[0].legend(loc="upper right")
    panels[0].set_title(part["recording"])
    panels[-1].set_xlabel("t_s")
    return panels


def scores(ranking: list[dict[str, Any]], ax: Any) -> Any:
    """The candidates of a diagnosis, strongest at the top, with the threshold of each."""
    ax = axes(ax)[0] if ax is None else ax
    shown = [c for c in ranking if c["score"] is not None][:12][::-1]
    places = np.arange(len(shown))
    ax.barh(places, [max(c["score"], 1e-3) for c in shown])
    ax.plot([c["threshold"] for c in shown], places, "k|", markersize=12, label="threshold")
    ax.set_yticks(places, [c["effect"] for c in shown])
    ax.set_xscale("log")
    ax.set_xlabel("score")
    ax.legend()
    return ax
