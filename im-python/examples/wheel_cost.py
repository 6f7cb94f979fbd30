"""What a diagnosis costs in the wheel over the program: user time of the same work, files written, in turns.

wheel_cost.py IM FOLDER [TURNS]      FOLDER: motor.toml, train1.csv, train2.csv, holdout.csv, as `im demo --save-data FOLDER` writes them
"""

import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import imkit


def spent(who):
    return resource.getrusage(who).ru_utime


def main(im, folder, turns="9"):
    motor, *recordings = [str(Path(folder) / name) for name in ("motor.toml", "train1.csv", "train2.csv", "holdout.csv")]
    program, wheel = [], []
    with tempfile.TemporaryDirectory() as out:
        arguments = ["--motor", motor, "--train", recordings[0], "--train", recordings[1], "--holdout", recordings[2], "--out", f"{out}/program"]
        for _ in range(int(turns)):
            before = spent(resource.RUSAGE_CHILDREN)
            subprocess.run([im, "diagnose", *arguments], check=True, stdout=subprocess.DEVNULL)
            program.append(spent(resource.RUSAGE_CHILDREN) - before)
            before = spent(resource.RUSAGE_SELF)
            found = imkit.diagnose(imkit.Motor.read(motor), recordings[:2], holdout=recordings[2])
            found.write(f"{out}/wheel")
            wheel.append(spent(resource.RUSAGE_SELF) - before)
            print(f"program {program[-1]:.2f} s, wheel {wheel[-1]:.2f} s")
    for name, of in (("medians", statistics.median), ("least", min)):
        print(f"wheel over program, {name}: {of(wheel) / of(program):.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
