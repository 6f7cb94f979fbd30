"""One fleet by one process, by two shards, and on a local Ray cluster of two workers of which one is killed on the way: the same tables?

fleet_engines.py FLEET OUT [SECONDS UNTIL A WORKER IS KILLED]
"""

import os
import resource
import signal
import sys
import threading
import time
from hashlib import sha256
from pathlib import Path

from imkit import fleet

TABLES = ["verdicts.csv", "verdicts.parquet", "parameters.csv", "fleet.json", "fleet.html"]


def ancestors(process):
    """Of a process, its parent first."""
    while process > 1:
        try:
            process = int(Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            return
        yield process


def kill_a_worker(after_s):
    """Ends one of the actors that this program started."""
    time.sleep(after_s)
    for process in map(int, filter(str.isdigit, os.listdir("/proc"))):
        try:
            words = Path(f"/proc/{process}/cmdline").read_text()
        except OSError:
            continue
        if "_Actor" in words and os.getpid() in ancestors(process):
            print(f"killing worker {process}")
            os.kill(process, signal.SIGKILL)
            return
    print("no worker was there to kill")


def main(plant, out, after_s="60"):
    out = Path(out)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    table = fleet.run(plant, out / "one", workers=1)
    spent = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
    print(f"one process: {table}\n  {spent:.1f} s of processor time, {spent / max(table.made, 1):.3f} s for each job made")
    for shard in ("1/2", "2/2"):
        table = fleet.run(plant, out / "shards", workers=1, shard=shard)
    print(f"two shards: {table}")

    import ray

    os.environ.setdefault("RAY_worker_niceness", "0")
    ray.init(num_cpus=2, log_to_driver=False, include_dashboard=False)
    threading.Thread(target=kill_a_worker, args=(float(after_s),), daemon=True).start()
    print(f"Ray: {fleet.run(plant, out / 'ray', engine='ray', workers=2)}")
    ray.shutdown()
    same = True
    for name in TABLES:
        hashes = {sha256((out / way / name).read_bytes()).hexdigest() for way in ("one", "shards", "ray")}
        same &= len(hashes) == 1
        print(f"{name}: {'the same' if len(hashes) == 1 else 'DIFFERENT'}")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
