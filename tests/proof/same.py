#!/usr/bin/env python3
"""Compares what two builds identify: tests/proof/same.py FLEXID OTHER [PLANTS]

FLEXID and OTHER are programs. Both identify the recordings, cuts of the scenarios, cuts of PLANTS (20) robots that are drawn, and cuts of plants with one
section of `mill3-plant.toml` each. Compares their JSON without times and origin, and prints each that differs with its first difference. FLEXID simulates.
Exit status: 0 if all are equal. Python 3.11, no packages.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[2]
# What may differ between two runs of one program.
LEFT_OUT = {"seconds", "origin"}
MISSING = "nothing"


def run(*words):
    ended = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if ended.returncode:
        sys.exit(f"{' '.join(map(str, words))}: {ended.stderr.strip()}")


def plain(own):
    """A result without what is left out."""
    if isinstance(own, dict):
        return {key: plain(value) for key, value in own.items() if key not in LEFT_OUT}
    return [plain(value) for value in own] if isinstance(own, list) else own


def difference(one, other, place=""):
    """The first place at which two results differ, and both values. `None` if they are equal."""
    if isinstance(one, dict) and isinstance(other, dict):
        keys = dict.fromkeys([*one, *other])
        pairs = ((f"{place}.{key}", one.get(key, MISSING), other.get(key, MISSING)) for key in keys)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = ((f"{place}[{index}]", *pair) for index, pair in enumerate(zip(one, other)))
    else:
        # Not a number is not itself.
        return None if one == other or repr(one) == repr(other) else f"{place}: {one!r}, {other!r}"
    return next((found for place, *pair in pairs if (found := difference(*pair, place))), None)


def errors():
    """Each section of a plant alone: its name and text."""
    plant = (ROOT / "host-tools/scenario/mill3-plant.toml").read_text()
    for text in re.split(r"(?m)^(?=\[)", plant)[1:]:
        yield text[1 : text.index("]")], text


def cuts(flexid, folder, plants):
    """Names, configurations and logs, one after the other."""
    scenario = pathlib.Path(shutil.copytree(ROOT / "host-tools/scenario", folder / "scenario"))
    for recording in sorted((ROOT / "tests/recordings").glob("*/")):
        # Its configuration names models of the scenario.
        own = shutil.copytree(scenario, folder / recording.name)
        shutil.copytree(recording, own, dirs_exist_ok=True)
        yield recording.name, own / "edge.toml", sorted(own.glob("*.log.gz"))
    log, plant = folder / "cut.log", folder / "plant.toml"
    for joints in (3, 6):
        config, typical = (scenario / f"mill{joints}-{name}.toml" for name in ("edge", "typical"))
        typical.write_text(re.sub(r"(?ms)^\[accuracy\].*?(?=^\[|\Z)", "", config.read_text()))
        run(flexid, "simulate", "--config", config, "--candump", log)
        yield f"mill{joints}", config, [log]
        yield f"mill{joints}, typical accuracies", typical, [log]
    config, typical = scenario / "mill3-edge.toml", scenario / "mill3-typical.toml"
    for seed in range(1, plants + 1):
        drawn = ["--truth", f"drawn:{seed}", "--seed", seed]
        run(flexid, "simulate", "--config", config, *drawn, "--candump", log)
        yield f"drawn robot {seed}", typical, [log]
    for name, text in errors():
        plant.write_text(text)
        run(flexid, "simulate", "--config", config, "--plant", plant, "--candump", log)
        yield f"{name} alone", typical, [log]


def main(flexid, other, plants=20):
    differ = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        found = folder / "found.json"
        for name, config, logs in cuts(flexid, folder, int(plants)):
            results = []
            for program in (flexid, other):
                run(program, "identify", "--config", config, "--json", found, *logs)
                results.append(plain(json.loads(found.read_text())))
            off = difference(*results)
            differ += off is not None
            print(f"{name:30} {off or 'equal'}", flush=True)
    print(f"{differ} differ")
    return differ == 0


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    sys.exit(not main(*sys.argv[1:]))
