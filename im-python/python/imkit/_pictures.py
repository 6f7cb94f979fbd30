"""Pictures with Matplotlib, which is asked for only here."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._native import InputError


def axes(ax: Any, rows: int = 1, share: bool = True) -> Any:
    """The axes given, or new ones: always an array."""
    if ax is not None:
        return np.atleast_1d(ax).ravel()
    try:
        from matplotlib import pyplot
    except ImportError as e:
        raise ImportError("plot() needs Matplotlib: pip install matplotlib") from e
    size = (8, 2.2 * rows + 1)
    return pyplot.subplots(rows, 1, sharex=share, squeeze=False, figsize=size, layout="constrained")[1][:, 0]


def curves(ax: Any, named: list[tuple[str, Any]], x: str, y: str) -> Any:
    """Curves over a common axis."""
    panels = axes(ax)
    panel = panels[0]
    for name, curve in named:
        panel.plot(np.asarray(curve[x]), np.asarray(curve[y]), label=name)
    panel.set_xlabel(x)
    panel.set_ylabel(y)
    panel.legend()
    return panels


def signals(parts: list[dict[str, Any]], recording: int | str, ax: Any, residuals: bool = False) -> Any:
    """Measured and modelled over time, or what is left between them, one panel for each signal."""
    names = [part["recording"] for part in parts]
    if isinstance(recording, str) and recording not in names:
        raise InputError(f"there is no recording {recording!r}: {', '.join(map(repr, names))}")
    part = parts[names.index(recording) if isinstance(recording, str) else recording]
    channels = [name.removesuffix("_measured") for name in part if name.endswith("_measured")]
    channels = [name for name in channels if np.isfinite(part[f"{name}_modelled"]).any()]
    panels = axes(ax, len(channels))
    for panel, name in zip(panels, channels):
        if residuals:
            panel.plot(part["t_s"], part[f"{name}_residual"], linewidth=0.6, label="measured − modelled")
        else:
            # Wide and pale, so that it is seen behind a model that fits.
            panel.plot(part["t_s"], part[f"{name}_measured"], color="0.75", linewidth=3, label="measured")
            panel.plot(part["t_s"], part[f"{name}_modelled"], linewidth=1, label="modelled")
        panel.set_ylabel(name)
    panels[0].legend(loc="upper right")
    panels[0].set_title(part["recording"])
    panels[-1].set_xlabel("t_s")
    return panels


def scores(ranking: list[dict[str, Any]], ax: Any) -> Any:
    """The candidates of a diagnosis, strongest at the top, with the threshold of each."""
    panels = axes(ax)
    panel = panels[0]
    shown = [c for c in ranking if c["score"] is not None][:12][::-1]
    places = np.arange(len(shown))
    # Pale, so that the thresholds are seen on it.
    panel.barh(places, [max(c["score"], 1e-3) for c in shown], color="0.75")
    panel.plot([c["threshold"] for c in shown], places, "k|", markersize=12, label="threshold")
    panel.set_yticks(places, [c["effect"] for c in shown])
    panel.set_xscale("log")
    panel.set_xlabel("score")
    panel.legend()
    return panels


def parameters(values: dict[str, dict[str, Any]], ax: Any) -> Any:
    """What the recordings determine, after over before, with 95 % intervals."""
    panels = axes(ax)
    panel = panels[0]
    shown = {name: v for name, v in values.items() if v["std"] is not None and v["before"]}
    names = list(shown)[::-1]
    ratio = [shown[name]["after"] / shown[name]["before"] for name in names]
    half = [1.96 * shown[name]["std"] / abs(shown[name]["before"]) for name in names]
    panel.errorbar(ratio, np.arange(len(names)), xerr=half, fmt="o", capsize=3)
    panel.axvline(1, color="0.6", linewidth=1)
    panel.set_yticks(np.arange(len(names)), names)
    panel.set_xlabel("after / before, 95 % interval")
    return panels


def learned(curves: list[dict[str, Any]], ax: Any) -> Any:
    """Learned curves with their 95 % bands, one panel for each."""
    panels = axes(ax, len(curves), share=False)
    for panel, curve in zip(panels, curves):
        x, y, half = np.array(curve["curve"]).T
        panel.fill_between(x, y - half, y + half, alpha=0.3, label="95 % band")
        panel.plot(x, y)
        panel.set_xlabel(curve["over"])
        panel.set_ylabel(curve["adds"])
        panel.legend()
    return panels
