"""Fleets: motors × recordings in, one table of verdicts out; on processes of this machine, or on Ray.

A folder holds a folder for each motor, with ``motor.toml`` and its recordings; a table (CSV) has a line for each recording. Every job stands
for itself and is known by a hash of its content, so that the table does not depend on the engine, the number of workers, or how often a run
was begun: what is done is not done again.

>>> from imkit import fleet
>>> table = fleet.run("plant", "plant-out", workers=4)                  # doctest: +SKIP
>>> table = fleet.run("plant", "plant-out", engine="ray", workers=64)   # doctest: +SKIP
"""

from __future__ import annotations

import csv
import json
import multiprocessing
import os
from collections import deque
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from typing import Any, Literal, NamedTuple, Protocol, cast

from . import _native
from ._progress import Life

__all__ = ["FleetTable", "run"]


_WORDS = "key unit type date recordings status verdict effects rivals suspicion sizes report error parameter".split()
"""Columns of the tables that hold words."""


class _Job(NamedTuple):
    key: str
    text: str
    out: str
    settings: tuple[float, bool, bool, bool]
    threads: int


class FleetTable:
    """The rows of a fleet and its statistics; the files lie in :attr:`folder`."""

    def __init__(self, folder: str, rows: list[str], summary: str, made: int, found: int, open_: int) -> None:
        self.folder = folder
        self.made, self.found, self.open = made, found, open_
        self._rows = [json.loads(row) for row in rows]
        self.summary: dict[str, Any] = json.loads(summary)

    def verdicts(self) -> Any:
        """``verdicts.csv`` as a DataFrame; without pandas its columns as text."""
        return self._frame("verdicts.csv")

    def parameters(self) -> Any:
        """``parameters.csv``: each motor's own values, and with what it borrows from its type."""
        return self._frame("parameters.csv")

    def _frame(self, name: str) -> Any:
        path = os.path.join(self.folder, name)
        try:
            import pandas
        except ImportError:
            with open(path, newline="", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
            return {column: [row[column] for row in rows] for column in (rows[0] if rows else [])}
        table = pandas.read_csv(path, dtype={column: str for column in _WORDS})
        words = [column for column in _WORDS if column in table]
        table[words] = table[words].fillna("")
        return table

    def __len__(self) -> int:
        return len(self._rows)

    def __repr__(self) -> str:
        s = self.summary
        return (
            f"FleetTable({len(self)} rows: {s['screened']} screened and let pass, {s['diagnosed']} diagnosed, {s['failed']} could not be judged; "
            f"{s['flagged']} flagged, {len(s['odd'])} odd parameters; {self.open} left to other shards)"
        )

    def _repr_html_(self) -> str:
        from ._results import _framed

        with open(os.path.join(self.folder, "fleet.html"), encoding="utf-8") as file:
            return _framed(file.read())


def run(
    fleet: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    engine: Literal["processes", "ray"] = "processes",
    workers: int | None = None,
    shard: str = "1/1",
    retries: int = 3,
    memory_bytes: int | None = None,
    all: bool = False,
    significance: float = 0.01,
    anyway: bool = False,
    reports: bool = True,
) -> FleetTable:
    """Judges a fleet, and writes ``verdicts.csv``, ``verdicts.parquet``, ``parameters.csv``, ``fleet.json`` and ``fleet.html`` into ``out``.

    ``workers`` is the number of processes, or of Ray actors (of one CPU and ``memory_bytes`` each); 1 process is this one. A job whose worker
    dies is tried again ``retries`` times; then its row says so, and the next run tries again. A script that runs processes does so under
    ``if __name__ == "__main__":``. ``shard`` "k/N" does a part of the jobs. With Ray over several machines ``out``
    and the fleet lie where all of them see them under the same path.
    """
    fleet, out = os.fspath(fleet), os.fspath(out)
    settings = (significance, all, anyway, reports)
    jobs = _native.fleet_jobs(fleet, settings, shard)
    kept = dict(zip([key for key, _, _ in jobs], _native.fleet_kept(out, [key for key, _, _ in jobs])))
    found = sum(row is not None for row in kept.values())
    mine = [_Job(key, text, out, settings, 1) for key, text, mine in jobs if mine and kept[key] is None]
    workers = workers or os.cpu_count() or 1
    if engine not in ("processes", "ray"):
        raise _native.InputError(f"there is no engine {engine!r}: processes or ray")
    if engine == "processes" and workers == 1:
        made: Iterator[tuple[_Job, str | None]] = ((job, _row(job)) for job in mine)
    else:
        made = _judged(_RayActors(memory_bytes) if engine == "ray" else _Processes(), mine, workers, retries)
    for job, row in made:
        if row is None:
            # Another run, with more memory perhaps, tries it again.
            row = _lost(job, retries + 1)
        else:
            _native.fleet_keep(out, row)
        kept[job.key] = row
    rows = [row for row in kept.values() if row is not None]
    title = os.path.splitext(os.path.basename(os.path.normpath(fleet)))[0]
    summary = _native.fleet_write(out, title, rows)
    return FleetTable(out, rows, summary, len(mine), found, len(kept) - len(rows))


def _row(job: _Job) -> str:
    return _native.fleet_row(job.text, job.key, job.out, job.settings, job.threads)


def _lost(job: _Job, tries: int) -> str:
    why = "too little memory, or a script that calls fleet.run outside of 'if __name__ == \"__main__\":', as processes need it"
    return _native.fleet_failed_row(job.text, job.key, f"its worker died {tries} times: {why}")


def _judged(crew: _Crew, jobs: list[_Job], workers: int, retries: int) -> Iterator[tuple[_Job, str | None]]:
    """Every worker takes the next job when it is done with one; one that dies is replaced, and its job tried again; in the end it has no row."""
    queue = deque((job, 0) for job in jobs)
    idle = [crew.hire() for _ in range(min(workers, len(jobs)))]
    busy: dict[Any, tuple[_Job, int]] = {}
    life, over = Life("judging"), 0
    try:
        while queue or busy:
            while queue and idle:
                worker, (job, tried) = idle.pop(), queue.popleft()
                busy[worker] = (job, tried + 1)
                crew.give(worker, job)
            worker, row = crew.next_done(list(busy))
            job, tried = busy.pop(worker)
            idle.append(crew.hire() if row is None else worker)
            if row is None and tried <= retries:
                queue.append((job, tried))
            else:
                over += 1
                life.show(f"judging, {over} of {len(jobs)} done")
                yield job, row
    finally:
        life.end()
        for worker in [*idle, *busy]:
            crew.dismiss(worker)


class _Crew(Protocol):
    """Workers of some kind."""

    def hire(self) -> Any: ...
    def give(self, worker: Any, job: _Job) -> None: ...
    def next_done(self, busy: list[Any]) -> tuple[Any, str | None]:
        """A worker that is done, with its row; ``None`` if it died."""
        ...

    def dismiss(self, worker: Any) -> None: ...


class _Processes:
    """Processes of this machine."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._process: dict[Connection, Any] = {}

    def hire(self) -> Connection:
        here, there = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(there,), daemon=True)
        process.start()
        there.close()
        self._process[here] = process
        return here

    def give(self, worker: Connection, job: _Job) -> None:
        try:
            worker.send(job)
        except OSError:
            pass  # It is dead, which the next look at it shows.

    def next_done(self, busy: list[Connection]) -> tuple[Connection, str | None]:
        worker = cast(Connection, wait(busy)[0])
        try:
            row = worker.recv()
        except (EOFError, OSError):
            self.dismiss(worker)
            return worker, None
        if isinstance(row, BaseException):
            raise row
        return worker, row

    def dismiss(self, worker: Connection) -> None:
        process = self._process.pop(worker, None)
        if process is not None:
            process.terminate()
            process.join()
            worker.close()


def _serve(jobs: Connection) -> None:
    """What a process does until nobody asks any more."""
    Life.silent = True
    while True:
        try:
            job = jobs.recv()
        except (EOFError, KeyboardInterrupt):
            return
        try:
            jobs.send(_row(job))
        except BaseException as e:  # Nothing is lost in silence: whoever asked raises it.
            jobs.send(e)


class _RayActors:
    """Actors of a Ray cluster."""

    def __init__(self, memory_bytes: int | None) -> None:
        try:
            import ray
        except ImportError as e:
            raise ImportError("the engine ray needs Ray: pip install ray") from e
        if not ray.is_initialized():
            ray.init(log_to_driver=False)
        self._ray = ray
        options: dict[str, Any] = {"num_cpus": 1} if memory_bytes is None else {"num_cpus": 1, "memory": memory_bytes}
        self._actor = ray.remote(**options)(_Actor)
        self._task: dict[Any, Any] = {}

    def hire(self) -> Any:
        return self._actor.remote()

    def give(self, worker: Any, job: _Job) -> None:
        self._task[worker] = worker.row.remote(tuple(job))

    def next_done(self, busy: list[Any]) -> tuple[Any, str | None]:
        tasks = {self._task[worker]: worker for worker in busy}
        done, _ = self._ray.wait(list(tasks), num_returns=1)
        worker = tasks[done[0]]
        try:
            return worker, self._ray.get(done[0])
        except self._ray.exceptions.RayActorError:
            return worker, None

    def dismiss(self, worker: Any) -> None:
        self._ray.kill(worker)


class _Actor:
    """What an actor does."""

    def row(self, job: tuple[Any, ...]) -> str:
        return _row(_Job(*job))
