"""Writes modal tests of the reference robot: frequency responses from a dense equation of motion, by pyuff and as a table.

    receptances.py FOLDER    pose1.uff (ASCII, m/s^2/N), pose2.uff (binary, g and lbf), pose3.csv (magnitude and phase, µm/N)

Every degree of freedom is an axis in the base frame. The noise of a response has the size that its coherence of five averages says.
"""

import sys
from pathlib import Path

import numpy as np
import pyuff

POSES = [[0.0, -0.45, 0.95], [0.7, -1.1, 1.9], [-0.6, -0.2, 0.35]]
# Origin, axis, mass, centre, moments of inertia of each link; then the TCP.
LINKS = [
    ([0.0, 0.0, 0.5], 2, 558.0, [0.18, 0.02, 0.25], [45.0, 55.0, 48.0]),
    ([0.5, 0.0, 0.545], 1, 485.0, [0.6, -0.08, 0.02], [14.0, 95.0, 92.0]),
    ([1.3, 0.0, 0.0], 1, 451.0, [0.55, 0.03, -0.02], [16.0, 88.0, 86.0]),
]
TCP = np.array([1.35, 0.0, -0.3])
STIFFNESS = [6.0e7, 6.6e7, 4.5e7, 3.2e7, 2.9e7, 2.3e6, 7.0e7, 5.2e7, 6.1e7, 4.1e7, 8.6e6, 3.7e7, 4.8e7, 5.5e7, 6.4e7, 2.6e7, 2.8e6, 2.2e7]
DAMPING = [2.1e4, 2.4e4, 1.7e4, 1.1e4, 0.9e4, 1.9e3, 2.6e4, 1.9e4, 2.2e4, 1.3e4, 3.4e3, 1.2e4, 1.5e4, 1.8e4, 2.3e4, 0.8e4, 1.2e3, 0.7e4]
FREQUENCIES = 0.25 * np.arange(8, 801)
AVERAGES = 5
NOISE = 0.01
G, LBF = 9.80665, 4.4482216152605


def turned(axis, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.eye(3)
    first, second = [(1, 2), (2, 0), (0, 1)][axis]
    turn[first, first] = turn[second, second] = cos
    turn[first, second], turn[second, first] = -sin, sin
    return turn


def responses(pose):
    """Accelerations (row) per force (column) along the axes of the TCP, at each frequency."""
    turn, origin = np.eye(3), np.zeros(3)
    axes, bodies = [], []
    for (offset, axis, mass, centre, moments), angle in zip(LINKS, pose):
        origin = origin + turn @ offset
        turn = turn @ turned(axis, angle)
        axes += [(turn[:, dof % 3], origin, dof < 3) for dof in range(6)]
        bodies.append((mass, origin + turn @ centre, turn @ np.diag(moments) @ turn.T))
    tip = origin + turn @ TCP

    def moved(place, count):
        return np.array([own if slides else np.cross(own, place - at) for own, at, slides in axes[:count]]).T

    size = len(axes)
    inertia = np.zeros((size, size))
    for link, (mass, centre, moments) in enumerate(bodies):
        count = 6 * (link + 1)
        shift = moved(centre, count)
        turns = np.array([np.zeros(3) if slides else own for own, _, slides in axes[:count]]).T
        inertia[:count, :count] += mass * shift.T @ shift + turns.T @ moments @ turns
    tool = turn.T @ moved(tip, size)
    all_responses = []
    for frequency in FREQUENCIES:
        s = 2j * np.pi * frequency
        dynamic = s * s * inertia + np.diag(np.array(STIFFNESS) + s * np.array(DAMPING))
        all_responses.append(s * s * tool @ np.linalg.solve(dynamic, tool.T))
    return np.array(all_responses)


def written(file, binary, kind, data, response, force, units):
    shared = dict(
        binary=binary, rsp_node=7, rsp_dir=response, ref_node=7, ref_dir=force, x=FREQUENCIES, id1="modal test",
        abscissa_spacing=1, abscissa_spec_data_type=18, abscissa_axis_units_lab="Hz", ordinate_spec_data_type=12,
        ordinate_axis_units_lab=units[0], orddenom_spec_data_type=13, orddenom_axis_units_lab=units[1],
    )
    pyuff.UFF(str(file)).write_sets(pyuff.prepare_58(func_type=kind, data=data, **shared), "add")


folder = Path(sys.argv[1])
random = np.random.default_rng(11)
square = 1 / (1 + 2 * AVERAGES * NOISE**2)
coherence = np.full(len(FREQUENCIES), square)
for number, pose in enumerate(POSES):
    exact = responses(pose)
    noise = random.normal(size=exact.shape) + 1j * random.normal(size=exact.shape)
    measured = exact + NOISE * np.abs(exact) * noise
    if number < 2:
        binary, units, size = [(0, ("m/s^2", "N"), 1.0), (1, ("g", "lbf"), LBF / G)][number]
        file = folder / f"pose{number + 1}.uff"
        for response in range(3):
            for force in range(3):
                own = size * measured[:, response, force]
                # A direction against its axis.
                along, own = (-3, -own) if force == 2 else (force + 1, own)
                written(file, binary, 4, own, response + 1, along, units)
                written(file, binary, 6, coherence, response + 1, along, ("NONE", "NONE"))
        continue
    names, columns = ["f [Hz]"], [FREQUENCIES]
    for response in range(3):
        for force in range(3):
            name = "H" + "xyz"[response] + "xyz"[force]
            own = 1e6 * measured[:, response, force] / (2j * np.pi * FREQUENCIES) ** 2
            names += [f"|{name}| [µm/N]", f"{name} phase [deg]", f"{name} coherence"]
            columns += [np.abs(own), np.degrees(np.angle(own)), coherence]
    table = "\n".join(",".join(f"{cell:.12e}" for cell in row) for row in np.array(columns).T)
    (folder / f"pose{number + 1}.csv").write_text(",".join(names) + "\n" + table + "\n", encoding="utf-8")
