#!/usr/bin/env python3
"""Identifies robots far from the scenario's: tests/proof/far.py FLEXID [ROBOTS]

Each parameter of the robot of six joints is multiplied by e^(0.6 N(0, 1)), 20 ROBOTS by default. FLEXID simulates three cuts of each, and identifies them.
Prints acceptance, seconds, and how many 95 % intervals of identified parameters hold. Exit status: 1 if a robot is not consistent, or if fewer intervals
hold than two standard deviations of a binomial below 95 %, of which half are independent. Python 3.11, no packages.
"""
import json
import math
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

SCENARIO = pathlib.Path(__file__).parents[2] / "host-tools/scenario"
# Independent intervals per interval, as in noise-limit: those of one run rest on the same noise.
INDEPENDENT = 0.49


def scaled(text, number):
    """The scenario with robot `number`."""
    draw = random.Random(number)
    begin, end = text.index("[[truth]]"), text.index("[[experiment]]")

    def times(match):
        return f"{float(match[0]) * math.exp(0.6 * draw.gauss(0, 1)):.6e}"

    def line(match):
        return match[1] + re.sub(r"[\d.]+(e[+-]?\d+)?", times, match[2])

    truth = re.sub(r"((?:stiffness|damping) = )(\[.*?\])", line, text[begin:end], flags=re.S)
    return text[:begin] + truth + text[end:]


def run(folder, *words):
    ended = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True)
    if ended.returncode:
        sys.exit(f"{' '.join(map(str, words))}: {ended.stderr.strip()}")
    return ended.stdout


def main(flexid, robots=20):
    flexid = pathlib.Path(flexid).resolve()
    consistent, held, all_held = 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(SCENARIO, folder, dirs_exist_ok=True)
        text = (folder / "mill6.toml").read_text()
        for number in range(int(robots)):
            (folder / "mill6.toml").write_text(scaled(text, number))
            run(folder, flexid, "simulate", "--config", "mill6-edge.toml", "--experiments", 3, "--seed", number + 1, "--candump", "r.log", "--truth-json", "t.json")
            begun = time.monotonic()
            out = run(folder, flexid, "identify", "--config", "mill6-edge.toml", "r.log", "--json", "o.json", "--truth", "t.json")
            seconds = time.monotonic() - begun
            acceptance = json.loads((folder / "o.json").read_text())["fit"]["acceptance"]
            own, of = map(int, re.search(r"truth: (\d+) of (\d+) intervals hold", out).groups())
            print(f"robot {number}: {acceptance}, {own} of {of} hold, {seconds:.1f} s", flush=True)
            consistent += acceptance == "consistent"
            held, all_held = held + own, all_held + of
    share = held / max(all_held, 1)
    least = 0.95 - 2 * math.sqrt(0.95 * 0.05 / max(INDEPENDENT * all_held, 1))
    print(f"{consistent} of {robots} consistent; {held} of {all_held} intervals hold: {100 * share:.1f} % (at least {100 * least:.1f})")
    return int(consistent < int(robots) or share < least)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
