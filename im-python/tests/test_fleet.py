import os
import signal
import threading
import time

import pytest

import imkit
from conftest import SCENARIO
from imkit import fleet


@pytest.fixture(scope="module")
def plant(tmp_path_factory, bare, motor):
    """Seven motors of one type: one has iron loss, one a broken file."""
    folder = tmp_path_factory.mktemp("plant")
    for k in range(7):
        unit = folder / f"m{k}"
        unit.mkdir()
        bare.write(unit / "motor.toml")
        recording = imkit.simulate(motor if k == 3 else bare, SCENARIO, seed=10 + k)[0]
        recording.write_csv(unit / "run.csv")
    (folder / "m5" / "run.csv").write_text("t_s,oops\n")
    return folder


def files(out):
    return {name: (out / name).read_bytes() for name in ("verdicts.csv", "parameters.csv", "fleet.json", "fleet.html")}


@pytest.fixture(scope="module")
def alone(plant, tmp_path_factory):
    out = tmp_path_factory.mktemp("alone")
    return fleet.run(plant, out, workers=1), files(out)


def test_what_is_wrong_is_found_and_a_bad_file_is_a_row(alone):
    table = alone[0].verdicts().set_index("unit")
    assert table.loc["m3", "effects"] == "iron_loss" and table.loc["m3", "status"] == "diagnosed"
    assert table.loc["m5", "status"] == "failed" and "run.csv" in table.loc["m5", "error"]
    rest = table.drop(["m3", "m5"])
    assert set(rest["verdict"]) == {"adequate"} and set(rest["status"]) == {"screened"}
    assert os.path.exists(os.path.join(alone[0].folder, table.loc["m3", "report"]))


def test_engines_and_shards_make_the_same_table(plant, alone, tmp_path):
    fleet.run(plant, tmp_path / "two", workers=2)
    assert files(tmp_path / "two") == alone[1]
    first = fleet.run(plant, tmp_path / "shards", workers=1, shard="1/2")
    second = fleet.run(plant, tmp_path / "shards", workers=1, shard="2/2")
    assert first.open == second.made > 0 and second.found == first.made and second.open == 0
    assert files(tmp_path / "shards") == alone[1]
    again = fleet.run(plant, tmp_path / "shards", workers=1)
    assert (again.made, again.found) == (0, 7)


def kill_a_worker(named):
    """Ends the first process of that name, by its id."""
    for _ in range(400):
        for process in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{process}/stat") as stat, open(f"/proc/{process}/cmdline") as command:
                    parent, words = int(stat.read().rsplit(")", 1)[1].split()[1]), command.read()
            except OSError:
                continue
            if parent == os.getpid() and named in words:
                time.sleep(0.7)
                os.kill(int(process), signal.SIGKILL)
                return
        time.sleep(0.01)


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="finds its workers in /proc")
def test_a_worker_that_dies_loses_nothing(plant, alone, tmp_path):
    killer = threading.Thread(target=kill_a_worker, args=("spawn_main",))
    killer.start()
    table = fleet.run(plant, tmp_path / "killed", workers=2)
    killer.join()
    assert files(tmp_path / "killed") == alone[1] and len(table) == 7


def test_a_job_that_kills_every_worker_is_a_row(plant, tmp_path, monkeypatch):
    class Dying:
        def hire(self):
            return object()

        def give(self, worker, job):
            self.worker = worker

        def next_done(self, busy):
            return busy[0], None

        def dismiss(self, worker):
            pass

    monkeypatch.setattr(fleet, "_Processes", Dying)
    table = fleet.run(plant, tmp_path, workers=2, retries=2)
    assert len(table) == 7 and all("died 3 times" in row["error"] for row in table._rows)
    # That is kept nowhere: the next run tries again.
    monkeypatch.undo()
    assert fleet.run(plant, tmp_path, workers=1).made == 7


def test_on_ray(plant, alone, tmp_path, monkeypatch):
    ray = pytest.importorskip("ray")
    # By default its workers give way to everything else on the machine.
    monkeypatch.setenv("RAY_worker_niceness", "0")
    ray.init(num_cpus=2, log_to_driver=False, include_dashboard=False)
    try:
        fleet.run(plant, tmp_path / "ray", engine="ray", workers=2)
    finally:
        ray.shutdown()
    assert files(tmp_path / "ray") == alone[1]


def test_what_is_wrong_is_said(plant, tmp_path):
    for wrong in ({"shard": "3/2"}, {"engine": "parrot"}):
        with pytest.raises(imkit.InputError):
            fleet.run(plant, tmp_path, **wrong)
    with pytest.raises(imkit.InputError, match="no motors"):
        fleet.run(tmp_path, tmp_path / "out")
