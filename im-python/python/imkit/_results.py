"""What the acts of the main job answer."""

from __future__ import annotations

import copy
import html
import json
import os
import textwrap
from typing import Any

import numpy as np

from . import _frames, _native, _pictures
from ._motor import Motor


class _Result:
    """An answer whose parts are those of the program's JSON."""

    def __init__(self, answer: str) -> None:
        self._json = answer
        self._answer: dict[str, Any] = json.loads(answer)

    def to_dict(self) -> dict[str, Any]:
        """What the program prints with ``--json``."""
        return json.loads(self._json)

    def __copy__(self) -> Any:
        # Nothing changes an answer.
        return self

    def __deepcopy__(self, memo: Any) -> Any:
        return self

    def __reduce__(self) -> Any:
        if hasattr(self, "_native"):
            kept = "to_dict()" if isinstance(self, Comparison) else "to_dict(), its refined motor, or what write(folder) writes"
            raise TypeError(f"a {type(self).__name__} holds models with every sample and is not pickled: keep {kept}")
        return _again, (type(self), self.__dict__)

    @property
    def data_quality(self) -> Any:
        """What was noticed about the recordings, one row each."""
        return _frames.frame(_columns(self._answer["data_quality"] or [], ["kind", "severity", "recording", "channel", "sentence", "advice"]))


class Comparison(_Result):
    """Where a model and recordings disagree."""

    def __init__(self, native: _native.Comparison) -> None:
        super().__init__(native.json())
        self._native = native

    @property
    def guessed(self) -> list[str]:
        """What was taken for what in recordings without a mapping: to be checked; ``recording.draft(motor)`` is it as a ``recording.toml``."""
        return self._answer["guessed"]

    @property
    def findings(self) -> list[str]:
        """What stands out, a sentence each, strongest first."""
        return self._answer["findings"]

    @property
    def rms_in_sigma(self) -> float:
        """The error over all recordings in units of the sensors' noise: 1 is as good as they can tell."""
        return self._answer["total"]["rms_in_sigma"]

    def errors(self) -> Any:
        """Root mean square error and fit per cent of each signal of each recording."""
        rows = [
            {"recording": e["recording"], "signal": name, "rmse": rmse, "fit_percent": e["fit_percent"].get(name)}
            for e in self._answer["errors"]
            for name, rmse in e["rmse"].items()
        ]
        return _frames.frame(_columns(rows, ["recording", "signal", "rmse", "fit_percent"]))

    def signals(self) -> Any:
        """Measured, modelled and residual of every sample, as ``im compare --signals`` writes them."""
        return _frames.stacked(self._native.signals())

    def residuals(self) -> Any:
        """The residuals alone."""
        return _residuals(self._native.signals())

    def localisation(self) -> Any:
        """Where the model fails, over one quantity: root mean square error beside the noise of the sensor."""
        return _localisation([self._answer["localisation"]])

    def plot(self, recording: int | str = 0, ax: Any = None) -> Any:
        """Measured and modelled signals of one recording over time: an array of Matplotlib axes, one for each signal.

        ``compared.plot()[0].figure.savefig("signals.png")`` saves it.
        """
        return _pictures.signals(self._native.signals(), recording, ax)

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page that ``im compare --out`` writes."""
        _write(path, self._native.html())

    def __str__(self) -> str:
        guesses = [textwrap.fill(g, 100, initial_indent="? ", subsequent_indent="  ") + "\n" for g in self.guessed]
        return "".join(guesses + ["\n"] * bool(guesses)) + self._native.text(100)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return _framed(self._native.html())


class Fit(_Result):
    """A motor fitted to recordings."""

    def __init__(self, native: _native.Fit) -> None:
        super().__init__(native.json())
        self.motor = Motor(native.motor)

    @property
    def rms_in_sigma(self) -> float:
        """The error on the recordings it was fitted to, in units of the sensors' noise."""
        return float(np.sqrt(self._answer["chi2_per_sample"]))

    def parameters(self) -> Any:
        """Before, after and standard deviation of each parameter; T values that follow a held ratio of leakages have none."""
        return _parameters(self._answer["parameters"])

    def covariance(self) -> Any:
        """The covariance of what the recordings determine, by parameter."""
        return _covariance(self._answer["covariance"])

    def __repr__(self) -> str:
        return f"Fit({self.motor.name!r}, error {self.rms_in_sigma:.3g} σ rms)\n{_shown(self.parameters())}"

    def _repr_html_(self) -> str:
        return f"<p>error {self.rms_in_sigma:.3g} σ rms (1 is the noise of the sensors)</p>{_table(self.parameters())}"


class Diagnosis(_Result):
    """The answer of the whole loop: a verdict, the effects found, the refined motor, and everything that led there."""

    def __init__(self, native: _native.Diagnosis) -> None:
        super().__init__(native.json())
        self._native = native
        self.refined = Motor(native.refined)
        self.given = Motor(native.given)

    @property
    def verdict(self) -> str:
        """``adequate``, ``missing_effects``, ``confounded``, ``inconclusive`` or ``unexplained``."""
        return self._answer["verdict"]

    @property
    def effects(self) -> list[str]:
        """Effects of the refined model, in order of addition."""
        return self._answer["effects"]

    @property
    def named(self) -> list[str]:
        """Effects that the machine is said to have: under ``unexplained`` those that do not imitate the unknown cause."""
        return self._answer["named"]

    @property
    def alternatives(self) -> dict[str, list[str]]:
        """For each effect, those that explain the recordings as well."""
        return self._answer["alternatives"]

    def parameters(self) -> Any:
        """Before, after, standard deviation and 95 % interval of each parameter.

        An effect that is named for sure may have an interval with zero in it: where its curve is not determined by one number alone.
        ``print(found)`` says which.
        """
        return _parameters(self._answer["parameters"])

    def covariance(self) -> Any:
        """The covariance of what the recordings determine, by parameter."""
        return _covariance(self._answer["covariance"])

    def candidates(self) -> Any:
        """Every effect of the library, best first, with its score, its threshold and the conclusion."""
        keys = ["effect", "score", "threshold", "predicted_size", "detectable_size", "unit", "explained_share", "conclusion"]
        return _frames.frame(_columns(self._answer["ranking"], keys))

    def steps(self) -> Any:
        """The error after each effect that was added: of the training recordings and of the held-out one, in σ rms."""
        rows = [
            {
                "effects": ", ".join(s["effects"]) or "base model",
                "train_rms_in_sigma": s["train"]["rms_in_sigma"],
                "holdout_rms_in_sigma": s["holdout"] and s["holdout"]["rms_in_sigma"],
            }
            for s in self._answer["steps"]
        ]
        return _frames.frame(_columns(rows, ["effects", "train_rms_in_sigma", "holdout_rms_in_sigma"]))

    def learned(self) -> Any:
        """The curves that were learned, a row for each point: value and half of the 95 % band over the variable."""
        keys = ["effect", "over", "adds", "x", "value", "half_band_95"]
        rows = [
            dict(zip(keys, (c["effect"], c["over"], c["adds"], *point))) for c in self._answer["learned"] for point in c["curve"]
        ]
        return _frames.frame(_columns(rows, keys))

    def formulas(self) -> Any:
        """What each learned curve looks like, best first: by how much of it a formula is off, and what it costs."""
        rows = [{"effect": c["effect"], **formula} for c in self._answer["learned"] for formula in c["formulas"]]
        return _frames.frame(_columns(rows, ["effect", "name", "formula", "off", "cost"]))

    def rust(self) -> str:
        """The first learned curve's nearest formula as an effect of one's own: the source of a Rust file."""
        return self._native.rust()

    def torque_speed(self) -> Any:
        """The static torque-speed curve at the rated supply, of the motor as given and as refined, with the peak current."""
        rows = [
            {"motor": name, "omega_m_rad_s": w, "torque_Nm": torque, "i_s_A": current}
            for name, curve in self._answer["torque_speed"]["curves"].items()
            for w, torque, current in curve
        ]
        return _frames.frame(_columns(rows, ["motor", "omega_m_rad_s", "torque_Nm", "i_s_A"]))

    def localisation(self) -> Any:
        """Where the base and the refined model fail, over one quantity: root mean square error beside the noise of the sensor."""
        return _localisation(self._answer["localisation"])

    def signals(self) -> Any:
        """Measured, modelled and residual of every sample, as ``im diagnose --signals`` writes them."""
        return _frames.stacked(self._native.signals())

    def residuals(self) -> Any:
        """The residuals alone."""
        return _residuals(self._native.signals())

    def plot(self, what: str = "signals", recording: int | str = 0, ax: Any = None) -> Any:
        """``"signals"``: measured and modelled; ``"residuals"``; ``"candidates"``: scores; ``"parameters"``: before and after with 95 %
        intervals; ``"torque_speed"``: the curve before and after; ``"learned"``: curves with their bands.

        An array of Matplotlib axes whatever is drawn: one for each signal or learned curve, else one.
        """
        if what == "signals":
            return _pictures.signals(self._native.signals(), recording, ax)
        if what == "candidates":
            return _pictures.scores(self._answer["ranking"], ax)
        if what == "torque_speed":
            both = [("before", self.given.torque_speed()), ("after", self.refined.torque_speed())]
            return _pictures.curves(ax, both, "omega_m_rad_s", "torque_Nm")
        if what == "residuals":
            return _pictures.signals(self._native.signals(), recording, ax, residuals=True)
        if what == "parameters":
            # What an effect that was off had before says nothing.
            new = set(self.effects) - set(self.given.effects)
            return _pictures.parameters({name: v for name, v in self._answer["parameters"].items() if name.split(".")[0] not in new}, ax)
        if what == "learned":
            if not self._answer["learned"]:
                raise _native.InputError("no curve was learned")
            return _pictures.learned(self._answer["learned"], ax)
        raise _native.InputError(
            f"there is no picture of {what!r}: signals, residuals, candidates, parameters, torque_speed or learned"
        )

    def report(self, path: str | os.PathLike[str]) -> None:
        """Writes the page ``report.html`` under a name of one's own."""
        _write(path, self._native.html)

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Writes ``report.html``, ``motor.refined.toml`` and ``diagnosis.json``, as ``im diagnose --out`` does."""
        self._native.write(os.fspath(folder))

    def __str__(self) -> str:
        return self._native.text

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return _framed(self._native.html)


class Validation(_Result):
    """A motor before and after, on a recording that neither has seen."""

    def errors(self) -> Any:
        """Error in σ rms, simulated on its own and with the speed nudged towards the measured one, then of each signal."""
        a = self._answer
        rows = [
            {"error": how, "before": a[how]["before"]["rms_in_sigma"], "after": a[how]["after"]["rms_in_sigma"]}
            for how in ("not_nudged", "speed_nudged")
        ]
        both = a["not_nudged"]
        rows += [{"error": name, "before": rms, "after": both["after"]["rmse"][name]} for name, rms in both["before"]["rmse"].items()]
        return _frames.frame(_columns(rows, ["error", "before", "after"]))

    def __repr__(self) -> str:
        return f"Validation\n{self.errors()}"

    def _repr_html_(self) -> str:
        return _table(self.errors())


class NextTest:
    """The manoeuvre that best settles what is open."""

    def __init__(self, answer: str) -> None:
        self._answer: dict[str, Any] = json.loads(answer)

    @property
    def open(self) -> list[str]:
        """The effects in question."""
        return self._answer["open"]

    @property
    def what(self) -> str | None:
        """What to do, in a sentence; ``None`` when nothing is open, or no manoeuvre stays within the limits."""
        return self._answer["test"] and self._answer["test"]["what"]

    @property
    def scenario(self) -> str | None:
        """The text of its ``scenario.toml``, for :func:`imkit.simulate`."""
        return self._answer["test"] and self._answer["test"]["scenario_toml"]

    def to_dict(self) -> dict[str, Any]:
        """What ``im next-test --json`` prints."""
        return copy.deepcopy(self._answer)

    def __repr__(self) -> str:
        if not self.open:
            return "NextTest(nothing is open: no rivals, no suspect, every effect seen)"
        return f"NextTest(open={self.open}, {self.what!r})"


def _again(kind: type[_Result], parts: dict[str, Any]) -> _Result:
    """An answer in another process."""
    result = object.__new__(kind)
    result.__dict__.update(parts)
    return result


def _shown(table: Any) -> str:
    """A table whole, whatever the width of the terminal."""
    return table.to_string() if hasattr(table, "to_string") else str(table)


def _columns(rows: list[dict[str, Any]], keys: list[str]) -> dict[str, list[Any]]:
    return {key: [row.get(key) for row in rows] for key in keys}


def _parameters(parameters: dict[str, dict[str, Any]]) -> Any:
    rows = []
    for name, values in parameters.items():
        half = None if values["std"] is None else 1.96 * values["std"]
        low, high = (None, None) if half is None else (values["after"] - half, values["after"] + half)
        rows.append({"parameter": name, **values, "low_95": low, "high_95": high})
    return _frames.frame(_columns(rows, ["parameter", "before", "after", "std", "low_95", "high_95", "unit"]), index="parameter")


def _localisation(models: list[dict[str, Any]]) -> Any:
    rows = [
        {"model": m["model"], "error": p["quantity"], "over": p["over"], **point, "noise": p["noise"]}
        for m in models
        for p in m["profiles"]
        for point in p["bins"]
    ]
    return _frames.frame(_columns(rows, ["model", "error", "over", "at", "rms", "count", "noise"]))


def _covariance(covariance: dict[str, Any]) -> Any:
    names, matrix = covariance["of"], np.array(covariance["matrix"], dtype=float)
    try:
        import pandas
    except ImportError:
        return names, matrix
    return pandas.DataFrame(matrix, index=names, columns=names)


def _residuals(parts: list[dict[str, Any]]) -> Any:
    keep = ("recording", "t_s")
    return _frames.stacked([{k: v for k, v in part.items() if k in keep or k.endswith("_residual")} for part in parts])


def _write(path: str | os.PathLike[str], text: str) -> None:
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def _framed(page: str) -> str:
    """A whole page inside a notebook."""
    return f'<iframe srcdoc="{html.escape(page)}" style="width:100%;height:640px;border:1px solid #ccc"></iframe>'


def _table(frame: Any) -> str:
    return frame.to_html() if hasattr(frame, "to_html") else f"<pre>{html.escape(str(frame))}</pre>"
