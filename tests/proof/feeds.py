#!/usr/bin/env python3
"""Identifies robots that feed: tests/proof/feeds.py FLEXID [--perfect] [--robots 5] [--first 1] [--feeds 0,10,30,100] [--seconds 20] [--friction 0]

Each parameter of the robot of three joints is multiplied by 2^u, u uniform from -1 to 1. Its plant has every error at once, drawn from the typical accuracies
(`flexid simulate --plant`); with --perfect it has none. It mills lines of 200 mm forth and back in three regions, for so many seconds each, at each FEED, mm/s;
at 0 it stands. The fit has typical accuracies; with --perfect, perfect ones, too. FRICTION acts in each joint, Nm. Prints each run, and a row a feed: how many
95 % intervals of identified parameters hold, the worst miss and the root mean square in standard deviations, and seconds (median, most). A robot that gives
way is left out. Exit status: 1 if fewer intervals hold than two standard deviations of a binomial below 95 %, of which half are independent, or if one in a
thousand misses by 5. Python 3.11, no packages.
"""
import argparse
import json
import math
import pathlib
import random
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib

from far import INDEPENDENT, SCENARIO

LENGTH_MM = 200.0
RAMP_MM_PER_S2 = 1000.0
# Middle of the band, at which the parameters of a joint with hysteresis are defined.
MIDDLE_HZ = 20.0


def joints_of(scenario, draw):
    """Parameters of a drawn robot: six stiffnesses and six dampings a joint."""
    return [[value * 2.0 ** draw.uniform(-1, 1) for value in one["stiffness"] + one["damping"]] for one in scenario["truth"]]


def softened(joints, draw):
    """The joints in series with links that give way by 1e-10 m/N and rad/Nm, but for the first."""
    softer = [joints[0]]
    for joint in joints[1:]:
        times = [1.0 + 1e-10 * abs(draw.gauss(0, 1)) * stiffness for stiffness in joint[:6]]
        softer.append([own / by for own, by in zip(joint[:6], times)] + [own / by**2 for own, by in zip(joint[6:], times)])
    return softer


def plant(joints, draw, friction):
    """Every error of a plant, each one standard deviation times a normal number; sources: `ENTRIES` in core/src/imperfection/accuracies.rs."""
    normal = lambda deviation: deviation * draw.gauss(0, 1)
    three = lambda deviation: [normal(deviation) for _ in range(3)]
    each = lambda value: [value() for _ in range(joints)]
    ground = [1.0 / max(abs(normal(5e-10 if dof < 3 else 1e-9)), 1e-13) for dof in range(6)]
    sensor = lambda angle, gain: {
        "angle_rad": three(angle),
        "gain": [math.exp(own) for own in three(gain)],
        "crosstalk": normal(0.01),
        "resonance_hz": 3000.0 / math.sqrt(abs(draw.gauss(0, 1))),
        "high_pass_hz": max(abs(normal(0.1)), 0.01),
    }
    return {
        "force_sensor": sensor(1.7e-3, 0.005),
        "accelerometer": sensor(5e-3, 0.01) | {"offset_m": three(2e-3)},
        "accelerometer.clock": {"late_s": normal(20e-6), "late_spread_s": 5e-6, "ppm": normal(2.0)},
        "tool": {"angle_rad": three(1.7e-3), "tcp_m": three(1e-3)},
        "robot": {
            "mass": each(lambda: math.exp(normal(0.02))),
            "centre_of_mass_m": each(lambda: three(5e-3)),
            "joint_angle_rad": each(lambda: normal(1e-3)),
            "elastic_centre_m": each(lambda: three(0.01)),
        },
        "joints": {
            "hysteretic": min(abs(normal(0.3)), 1.0),
            "hysteretic_at_hz": MIDDLE_HZ,
            "servo": abs(normal(0.05)),
            "loaded_per_knm": abs(normal(0.01)),
            "warm_up_per_cut": normal(1e-3),
            "friction": friction,
        },
        "pedestal": {"mass_kg": 200.0, "stiffness": ground, "damping": [1e-4 * abs(draw.gauss(0, 1)) * own for own in ground]},
        "hose": {"stiffness_n_per_m": abs(normal(1e3)), "damping_ns_per_m": abs(normal(20.0))},
    }


def toml(sections):
    return "".join(f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in own.items()) for name, own in sections.items())


def milled(text, joints, feed, seconds):
    """The scenario `text` with these joints and this feed."""
    truth = "".join(f'[[truth]]\njoint = "joint_{place}"\nstiffness = {own[:6]}\ndamping = {own[6:]}\n' for place, own in enumerate(joints, 1))
    begin = text.index("[[truth]]")
    text = text[:begin] + truth + text[text.index("[[experiment]]", begin) :]
    passes = max(1, round(seconds * feed / LENGTH_MM))

    def path(match):
        end = [float(value) for value in match[1].split(",")]
        points = [end if index % 2 == 0 else [0.0] * 3 for index in range(passes)]
        return f"path_mm = {points}"

    text = re.sub(r"path_mm = \[\[(.*?)\]\]", path, text)
    text = re.sub(r"feed_mm_per_s = .*", f"feed_mm_per_s = {feed}\nacceleration_mm_per_s2 = {RAMP_MM_PER_S2}", text)
    text = re.sub(r"(name = .*\n(?:.*\n)*?)duration_s = .*", rf"\g<1>duration_s = {seconds + 2.0}", text)
    if feed == 0.0:
        text = re.sub(r"(path_mm|feed_mm_per_s|acceleration_mm_per_s2) = .*\n", "", text)
    return text


def scores(result, joints):
    """Errors of the identified parameters, in standard deviations of their logarithms."""
    found = []
    for own, truth in zip(result["joints"], joints):
        for kind, true in (("stiffness", truth[:6]), ("damping", truth[6:])):
            for value, deviation, verdict, exact in zip(own[kind], own[f"{kind}_std"], own[f"{kind}_verdict"], true):
                if verdict == "identified":
                    found.append(math.log(value / exact) * value / deviation)
    return found


class Feeding:
    def __init__(self, flexid, folder, arguments):
        self.flexid, self.folder, self.arguments = flexid, folder, arguments
        shutil.copytree(SCENARIO, folder, dirs_exist_ok=True)
        self.text = (folder / "mill3-feed.toml").read_text()
        config = (folder / "mill3-edge.toml").read_text().replace('"mill3.toml"', '"own.toml"')
        assumed = "perfect" if arguments.perfect else "typical"
        config = re.sub(r"(?ms)^\[accuracy\].*?(?=^\[|\Z)", "", config) + f'\n[accuracy]\nassume = "{assumed}"\n'
        (folder / "own-edge.toml").write_text(config)

    def run(self, *words):
        words = [str(word) for word in (self.flexid, *words, "--config", "own-edge.toml")]
        return subprocess.run(words, cwd=self.folder, capture_output=True, text=True)

    def one(self, number, feed):
        """Acceptance, scores and seconds of a robot at a feed. None of a robot that gives way."""
        draw = random.Random(number)
        joints = joints_of(tomllib.loads(self.text), draw)
        simulated, own = joints, []
        if not self.arguments.perfect:
            simulated = softened(joints, draw)
            errors = plant(len(joints), draw, self.arguments.friction)
            if feed > 0.0:
                del errors["hose"]  # the simulator has one of a robot that stands
            (self.folder / "plant.toml").write_text(toml(errors))
            own = ["--plant", "plant.toml"]
        (self.folder / "own.toml").write_text(milled(self.text, simulated, feed, self.arguments.seconds))
        cut = self.run("simulate", *own, "--seed", number, "--candump", "own.log")
        if cut.returncode:
            print(f"robot {number} at {feed:g} mm/s: {cut.stderr.strip()}", flush=True)
            return None
        begun = time.monotonic()
        ended = self.run("identify", "own.log", "--json", "own.json")
        seconds = time.monotonic() - begun
        if not (self.folder / "own.json").exists():
            print(f"robot {number} at {feed:g} mm/s: {ended.stderr.strip()}", flush=True)
            return "no finding", [], seconds
        result = json.loads((self.folder / "own.json").read_text())
        (self.folder / "own.json").unlink()
        fit, found = result["fit"], scores(result, joints)
        held, worst = sum(abs(one) < 1.96 for one in found), max(map(abs, found), default=0.0)
        print(
            f"robot {number} at {feed:g} mm/s: {fit['acceptance']}, χ²/dof {fit['consistency']:.3f}, {fit['records']} records,"
            f" {held} of {len(found)} hold, worst {worst:.1f}, {seconds:.1f} s",
            flush=True,
        )
        return fit["acceptance"], found, seconds


def main(arguments):
    flexid = pathlib.Path(arguments.flexid).resolve()
    is_right = True
    rows = ["| feed, mm/s | consistent | identified | intervals that hold | worst miss | root mean square | seconds |", "| --- | --- | --- | --- | --- | --- | --- |"]
    with tempfile.TemporaryDirectory() as name:
        feeding = Feeding(flexid, pathlib.Path(name), arguments)
        for feed in map(float, arguments.feeds.split(",")):
            numbers = range(arguments.first, arguments.first + arguments.robots)
            runs = [run for run in (feeding.one(number, feed) for number in numbers) if run]
            found = [one for _, scores, _ in runs for one in scores]
            consistent, seconds = sum(own == "consistent" for own, _, _ in runs), [own for _, _, own in runs]
            held, gross = sum(abs(one) < 1.96 for one in found), sum(abs(one) > 5 for one in found)
            least = 0.95 - 2 * math.sqrt(0.95 * 0.05 / max(INDEPENDENT * len(found), 1))
            is_right &= held >= least * len(found) and gross <= len(found) / 1000
            square = math.sqrt(sum(one * one for one in found) / max(len(found), 1))
            share = 100 * held / max(len(found), 1)
            rows.append(
                f"| {feed:g} | {consistent} of {len(runs)} | {len(found)} | {held}, {share:.1f} % (at least {100 * least:.1f}) |"
                f" {max(map(abs, found), default=0):.1f} σ | {square:.2f} σ | {statistics.median(seconds or [0]):.0f}, {max(seconds, default=0):.0f} |"
            )
    print("\n".join(rows))
    return int(not is_right)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("flexid")
    parser.add_argument("--perfect", action="store_true")
    parser.add_argument("--robots", type=int, default=5)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--feeds", default="0,10,30,100")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--friction", type=float, default=0.0)
    sys.exit(main(parser.parse_args()))
