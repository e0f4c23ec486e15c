"""flexid beside MuJoCo: one evaluation of the loss, and the whole identification. `run` has the rest.

    compare.py PEERS FOLDER MINUTES

PEERS is flexid's side, a program; FOLDER takes the records; an identification of mujoco.sysid ends after MINUTES.
"""

import json
import os
import pathlib
import subprocess
import sys

# One processor for both sides, before numpy starts its threads.
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")

import mujoco
import numpy as np

from evaluation import ENGINES, Evaluation
from identification import Identification, starts
from reference import Experiment
from robot import TRUE, TRUTH

# Interleaved timings, of which the best counts; and identifications by flexid, of which the median does.
ROUNDS = 10


def main(peers, folder, minutes):
    folder = pathlib.Path(folder)
    # RK4 is not stable at some guesses of mujoco.sysid, which then tries a smaller step.
    mujoco.set_mju_user_warning(lambda _: None)

    def flexid(command):
        done = subprocess.run([peers, command, folder], check=True, stdout=subprocess.PIPE)
        return json.loads(done.stdout)

    steps = flexid("cut")["steps_a_sample"]
    rng = np.random.default_rng(1)
    experiments = [
        Experiment(index, folder, steps, rng) for index in range(len(TRUTH["experiment"]))
    ]
    evaluations(flexid, experiments)
    identifications(flexid, experiments, 60 * float(minutes))


def evaluations(flexid, experiments):
    """Prints what one evaluation costs on either side."""
    ours = flexid("evaluate")
    guess = TRUE.copy()
    guess[:, :6] *= ours["guess"]
    theirs = [Evaluation(engine, experiments, guess) for engine in ENGINES]
    rounds = []
    for _ in range(ROUNDS):
        rounds.append(flexid("evaluate")["seconds"])
        for one in theirs:
            one.time()
    ours["seconds"] = {level: min(one[level] for one in rounds) for level in rounds[0]}
    print(f"\nOne evaluation of the loss: three experiments of 4.096 s, {ours['bins']} bins in all. One")
    print(f"thread, best of {ROUNDS} interleaved rounds; in each, flexid's is the shortest of 300 tries, by the clock, that")
    print(f"of MuJoCo {mujoco.__version__} one pass of mj_step alone, processor time. The loss is of one guess; the error is")
    print("the displacement's in the band, median over directions and experiments; alone, without what")
    print("holding the force for a step adds.\n")
    levels = list(ours["seconds"])
    times = "".join(f"{'by ' + level:>12}" for level in levels)
    print(f"{'':<42}{'ms':>10}{times}{'error':>10}{'alone':>10}{'loss':>8}")
    for level, seconds in ours["seconds"].items():
        row(f"flexid, {level}", seconds, ours, f"{'':>20}{ours['loss']:>8.4f}")
    for one in theirs:
        told = f"{one.error:>10.1e}{one.alone:>10.1e}{one.loss:>8.4f}"
        row(f"{one.engine.name}, MuJoCo's own loop", one.in_loop, ours, told)
        row(f"{one.engine.name}, called from Python", one.from_python, ours, told)


def row(what, seconds, ours, told):
    ratios = "".join(f"{seconds / one:>12.1f}" for one in ours["seconds"].values())
    print(f"{what:<42}{1e3 * seconds:>10.3f}{ratios}{told}", flush=True)


def identifications(flexid, experiments, limit_s):
    """Prints what the whole identification costs on either side."""
    ours = sorted((flexid("identify") for _ in range(ROUNDS)), key=lambda one: one["seconds"])
    ours = ours[ROUNDS // 2]
    print("\nThe identification: 36 parameters from the records in memory. One thread. flexid: median of")
    print(f"{ROUNDS} runs, by the clock. mujoco.sysid: one run, processor time; logarithms of the")
    print("parameters within the same bounds, its own optimiser, finite differences;", end=" ")
    print(f"stopped after {limit_s / 60:g} min.\n")
    head = f"{'s':>10}{'by flexid':>11}{'iterations':>12}{'evaluations':>13}{'parameter deviation':>21}"
    print(f"{'':<50}{head}")
    print(
        f"{'flexid, from the bounds':<50}{ours['seconds']:>10.3f}{1:>11.0f}"
        f"{ours['refine_iterations']:>12}{ours['search_evaluations']:>13}"
        f"{ours['parameter_deviation']:>21.5f}",
        flush=True,
    )
    for engine in ENGINES:
        for place, start in starts(np.random.default_rng(2)):
            one = Identification(engine, experiments, start, limit_s)
            print(
                f"{f'{engine.name}, from {place}':<50}{one.seconds:>10.1f}"
                f"{one.seconds / ours['seconds']:>11.0f}{one.iterations:>12}{one.evaluations:>13}"
                f"{one.deviation:>21.5f}{'' if one.settled else '  stopped'}",
                flush=True,
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
