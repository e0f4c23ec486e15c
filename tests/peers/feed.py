"""Robots that MuJoCo moves along a path while they mill, identified by flexid.

    feed.py FLEXID FOLDER [--joints 3] [--robots 5] [--first 0] [--feeds 0 10 30 100] [--line MM] [--accuracies perfect typical] [--check]

FLEXID is the program; FOLDER takes the tables of all robots, which are simulated where they are not there. Robot 0 is the
scenario's; each parameter of another is multiplied by 2^u, u uniform from -1 to 1. Three cuts of 20 s in three regions, along
lines of 200 mm (400 mm from 100 mm/s on), forth and back; `--line` is one line of another length. Prints a line for each
robot, feed and [accuracy]. `--check` first checks the motion.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import time

import numpy as np

import check
import cutter
from course import Course
from driven import SCENARIO, STEP_S, Driven
from robots import EXPERIMENTS, RATE_HZ, loaded, truth

# Readings of the joint angles, and their resolution, rad.
ANGLES_HZ = 100.0
RESOLUTION = 1e-5
CUTTING_S = 20.0
STANDARD_GRAVITY = 9.80665

ACCURACIES = {"perfect": '[accuracy]\nassume = "perfect"\n', "typical": ""}
HEADER = "time [s],Fx,Fy,Fz,ax,ay,az"


def record(robot, experiment, feed_mm_per_s, line_mm, scenario, rng):
    """One cut as its sensors read it: times, readings and joint angles, a row a sample; and how far the drives are off the path, rad."""
    pose, direction, axis, spindle_rpm = experiment
    cutting_s = CUTTING_S
    if line_mm and feed_mm_per_s:
        cutting_s = line_mm / feed_mm_per_s
    line_mm = line_mm or (200.0 if feed_mm_per_s < 100.0 else 400.0)
    points = 1e-3 * line_mm * np.array(direction)
    course = Course(robot, pose, points, 1e-3 * feed_mm_per_s, cutting_s)
    stride = round(1 / (RATE_HZ * STEP_S))
    steps = round(course.duration_s * RATE_HZ) * stride
    force = cutter.force(scenario["force"], axis, spindle_rpm, course.cut_s, STEP_S, steps, rng)
    acceleration, _, drives = robot.run(course, force, stride)
    times = STEP_S * np.arange(steps)[::stride]
    angles = course.at(times)[0]
    quality, half = scenario["measurement"], np.sqrt(RATE_HZ / 2)
    read = np.hstack([force[::stride], acceleration])
    noise = [
        quality["force_noise_n_per_sqrt_hz"] * half,
        quality["acceleration_noise_g_per_sqrt_hz"] * STANDARD_GRAVITY * half,
    ]
    read += np.repeat(noise, 3) * rng.normal(size=read.shape)
    return times, read, angles, np.abs(drives - angles).max()


def write(file, times, read, angles):
    """A cell of an angle is empty where none was read."""
    every = round(RATE_HZ / ANGLES_HZ)
    empty = "," * angles.shape[1]
    with open(file, "w") as out:
        names = "".join(f",q{1 + joint} [rad]" for joint in range(angles.shape[1]))
        out.write(f"{HEADER}{names}\n")
        for row, (second, values) in enumerate(zip(times, read)):
            cells = ",".join(f"{value:.4f}" for value in values)
            told = empty
            if row % every == 0:
                told = "".join(f",{round(angle / RESOLUTION) * RESOLUTION:.5f}" for angle in angles[row])
            out.write(f"{second:.4f},{cells}{told}\n")


def configuration(joints, bounds, accuracy):
    angles = ", ".join(f'"q{1 + joint}"' for joint in range(joints))
    limits = "".join(f"{name} = {limit}\n" for name, limit in bounds.items())
    return (
        f'[model]\nfile = "mill{joints}-model.toml"\n'
        + (f"[bounds]\n{limits}" if limits else "")
        + '[signals]\nforce = ["Fx", "Fy", "Fz"]\nacceleration = ["ax", "ay", "az"]\n'
        f"joints = [{angles}]\n[measurement]\nband_hz = [2.0, 200.0]\n{accuracy}"
    )


def simulate(folder, joints, number, feed, line_mm):
    """Writes the tables of one robot at one feed, what flexid is told, and the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(SCENARIO / f"mill{joints}-model.toml", folder)
    model, scenario = loaded(joints)
    own = truth(scenario, number)
    robot, off = Driven(model, own), 0.0
    for index, experiment in enumerate(EXPERIMENTS[joints]):
        rng = np.random.default_rng([number, index, round(feed)])
        *table, drives_off = record(robot, experiment, feed, line_mm, scenario, rng)
        write(folder / f"cut{1 + index}.csv", *table)
        off = max(off, drives_off)
    assert off < 1e-7, f"the drives are {off} rad off the path"
    names = [joint["name"] for joint in model["joint"]]
    bushings = {
        name: {"stiffness": list(values[:6]), "damping": list(values[6:])}
        for name, values in zip(names, own)
    }
    (folder / "truth.json").write_text(json.dumps({"truth": bushings, "experiments": []}))
    for name, accuracy in ACCURACIES.items():
        text = configuration(joints, scenario.get("bounds", {}), accuracy)
        (folder / f"{name}.toml").write_text(text)


def identify(flexid, folder, accuracy):
    """What flexid makes of it, as a line of the table; and its tally of intervals."""
    begun = time.monotonic()
    found = folder / f"{accuracy}.json"
    cuts = [f"cut{1 + index}.csv" for index in range(3)]
    told = ["--truth", "truth.json", "--json", found]
    command = [flexid, "identify", "--config", f"{accuracy}.toml", *cuts, *told]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    (folder / f"{accuracy}.txt").write_text(ended.stdout + ended.stderr)
    seconds = time.monotonic() - begun
    if ended.returncode:
        return f"{ended.stderr.strip()[-100:]:<40}{seconds:>7.1f} s", (0, 0, 0.0)
    found = json.loads(found.read_text())
    tallies = [found["truth"]["stiffness"], found["truth"]["damping"]]
    given = sum(one["intervals"] for one in tallies)
    hold = sum(one["hold"] for one in tallies)
    misses = [miss for one in tallies for miss in one["misses"]]
    worst = max(misses, key=lambda miss: abs(miss["deviations"]), default=None)
    told = f"{worst['deviations']:+.1f} sd, {worst['name']}" if worst else ""
    fit = found["fit"]
    line = f"{fit['acceptance']:<14}{given:>4} {hold:>4}{seconds:>7.1f} s  {fit['consistency']:.3f}  {told}"
    return line, (given, hold, abs(worst["deviations"]) if worst else 0.0)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("flexid", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--joints", type=int, default=3, choices=sorted(EXPERIMENTS))
    parser.add_argument("--robots", type=int, default=5)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--line", type=float, metavar="MM")
    parser.add_argument("--accuracies", nargs="+", default=list(ACCURACIES), choices=ACCURACIES)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--feeds", type=float, nargs="+", default=[0.0, 10.0, 30.0, 100.0])
    chosen = parser.parse_args()
    flexid = chosen.flexid.resolve()
    if chosen.check:
        check.report(chosen.joints)
    print("feed   robot accuracy  verdict   identified, hold, seconds, χ²/dof, worst miss")
    tallies = {}
    for feed in chosen.feeds:
        for number in range(chosen.first, chosen.first + chosen.robots):
            line = f"-{chosen.line:g}" if chosen.line else ""
            folder = chosen.folder / f"{chosen.joints}-{number}-{feed:g}{line}"
            if not (folder / "truth.json").exists():
                simulate(folder, chosen.joints, number, feed, chosen.line)
            for accuracy in chosen.accuracies:
                told, tally = identify(flexid, folder, accuracy)
                tallies.setdefault((feed, accuracy), []).append(tally)
                print(f"{feed:>4g} {number:>6}   {accuracy:<9} {told}", flush=True)
    print("\nfeed   accuracy  identified of all, intervals that hold, worst miss in standard deviations")
    for (feed, accuracy), own in tallies.items():
        given, hold, worst = sum(one[0] for one in own), sum(one[1] for one in own), max(one[2] for one in own)
        share = f"{100 * hold / given:.1f} %" if given else ""
        print(f"{feed:>4g}   {accuracy:<9} {given} of {12 * chosen.joints * len(own)}, {hold} {share}, {worst:.1f}")


if __name__ == "__main__":
    main()
