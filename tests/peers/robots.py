"""The robots of feed.py, and what they mill."""

import tomllib

import numpy as np

from driven import SCENARIO

RATE_HZ = 2000.0
# Per scenario: poses, rad; direction of the lines, base axes; feed axis of the cutter, TCP axes; spindle speeds, rpm.
EXPERIMENTS = {
    3: [
        ([0.00, -0.45, 0.95], [1.0, 0.0, 0.0], "x", [600, 4200]),
        ([0.70, -1.10, 1.90], [-0.6, 0.8, 0.0], "y", [900, 5400]),
        ([-0.60, -0.20, 0.45], [0.0, 0.0, -1.0], "z", [600, 3000]),
    ],
    6: [
        ([0.00, -0.35, 0.70, 0.20, 0.75, -0.30], [1.0, 0.0, 0.0], "x", [600, 4200]),
        ([0.70, -0.60, 1.05, -0.80, 0.90, 0.60], [-0.6, 0.8, 0.0], "y", [900, 5400]),
        ([-0.60, 0.25, 0.10, 0.50, -0.85, 1.20], [0.0, 0.0, -1.0], "z", [600, 3000]),
    ],
}


def loaded(joints):
    """The model of so many joints, and its scenario."""
    read = lambda name: tomllib.loads((SCENARIO / name).read_text())
    return read(f"mill{joints}-model.toml"), read(f"mill{joints}.toml")


def truth(scenario, number):
    """Parameters of a robot: a row a joint, six stiffnesses, then six dampings."""
    own = np.array([one["stiffness"] + one["damping"] for one in scenario["truth"]])
    draw = np.random.default_rng(number).uniform(-1.0, 1.0, own.shape)
    return own if number == 0 else own * 2.0**draw
