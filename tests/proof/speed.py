#!/usr/bin/env python3
"""How long `flexid identify` takes, in turn with another build: tests/proof/speed.py FLEXID OTHER [SEEDS]

FLEXID and OTHER are programs. Both identify the same logs of the scenarios, cut with seeds 1 to SEEDS (12), one after the other: whole runs, from the
start of the program to its end. Prints the median of each, and of the ratios. Python 3.11, no packages.
"""
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

SCENARIO = pathlib.Path(__file__).parents[2] / "host-tools/scenario"
# Joints, cuts, whether accuracies are typical.
CASES = [(3, 3, False), (6, 3, False), (6, 8, False), (6, 3, True)]


def seconds(program, config, log):
    begun = time.perf_counter()
    subprocess.run([program, "identify", "--config", config, log], check=True, capture_output=True)
    return time.perf_counter() - begun


def main(programs, seeds):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(shutil.copytree(SCENARIO, pathlib.Path(folder) / "scenario"))
        print("| joints | cuts | accuracies | this program | the other | ratio |")
        print("| ------ | ---- | ---------- | ------------ | --------- | ----- |")
        for joints, cuts, is_typical in CASES:
            config = folder / f"mill{joints}-edge.toml"
            log = folder / "cut.log"
            taken = []
            for seed in range(1, seeds + 1):
                cut = ["--seed", str(seed), "--experiments", str(cuts), "--candump", log]
                subprocess.run([programs[0], "simulate", "--config", config, *cut], check=True, capture_output=True)
                own = folder / f"mill{joints}-timed.toml"
                text = config.read_text()
                own.write_text(re.sub(r"(?ms)^\[accuracy\].*?(?=^\[|\Z)", "", text) if is_typical else text)
                taken.append([seconds(program, own, log) for program in programs])
            this, other = (statistics.median(column) for column in zip(*taken))
            ratio = statistics.median(other / this for this, other in taken)
            kind = "typical" if is_typical else "perfect"
            print(f"| {joints} | {cuts} | {kind} | {this:.2f} s | {other:.2f} s | {ratio:.1f} |", flush=True)


if __name__ == "__main__":
    programs = [shutil.which(program) for program in sys.argv[1:3]]
    if len(programs) < 2 or None in programs:
        sys.exit(__doc__)
    os.sched_setaffinity(0, {0})
    main(programs, int(sys.argv[3]) if len(sys.argv) > 3 else 12)
