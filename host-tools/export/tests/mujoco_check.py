"""Compares robots that MuJoCo loads with what flexid computes of them.

The argument is a JSON file with a list of cases: `mjcf`, `natural_hz`, `hz`, `receptance`. The output is a JSON list with the
deviations of each case. The Rust test beside this file explains their fields.
"""

import json
import sys

import mujoco
import numpy as np

# Step of the finite differences, m and rad. Central differences of forces that are nearly linear.
STEP = 1e-6


def residual(model, data, qpos, qvel):
    """Generalised force at this state: springs and dampers, gravity and inertia forces."""
    data.qpos[:] = qpos
    data.qvel[:] = qvel
    mujoco.mj_forward(model, data)
    return data.qfrc_passive - data.qfrc_bias


def derivative(function, at):
    """Matrix of the derivatives of a vector function, by central differences."""
    columns = []
    for place in range(at.size):
        step = np.zeros(at.size)
        step[place] = STEP
        columns.append((function(at + step) - function(at - step)) / (2 * STEP))
    return np.array(columns).T


def equilibrium(model, data, start):
    """Static equilibrium by Newton's method, and the stiffness there, gravity's included."""
    at, still = start.copy(), np.zeros(model.nv)
    for _ in range(10):
        stiffness = -derivative(lambda qpos: residual(model, data, qpos, still), at)
        change = np.linalg.solve(stiffness, residual(model, data, at, still))
        at = at + change
        if np.abs(change).max() < 1e-13:
            break
    return at, -derivative(lambda qpos: residual(model, data, qpos, still), at)


def mass_matrix(model, data):
    """Mass matrix at the state of the data."""
    columns = []
    for unit in np.eye(model.nv):
        column = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, column, unit)
        columns.append(column)
    return np.array(columns).T


def natural_hz(mass, stiffness):
    """Natural frequencies without damping, rising."""
    factor = np.linalg.inv(np.linalg.cholesky(mass))
    symmetric = (stiffness + stiffness.T) / 2
    return np.sqrt(np.linalg.eigvalsh(factor @ symmetric @ factor.T)) / (2 * np.pi)


def poles_hz(matrix):
    """Natural frequencies of the oscillating poles of a state matrix, rising."""
    poles = np.linalg.eigvals(matrix)
    return np.sort(np.abs(poles[poles.imag > 0])) / (2 * np.pi)


def state_matrix(mass, stiffness, damping):
    """Matrix of the first-order form."""
    size, inverse = len(mass), np.linalg.inv(mass)
    return np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness, -inverse @ damping]])


def stepped(model, data, at, mass, stiffness, damping, highest_hz):
    """Relative deviation of the natural frequencies in the band that the steps of time cause."""
    size = model.nv
    state = state_matrix(mass, stiffness, damping)
    data.qpos[:], data.qvel[:] = at, 0
    mujoco.mj_forward(model, data)
    steps = np.zeros((2 * size, 2 * size))
    mujoco.mjd_transitionFD(model, data, STEP, True, steps, None, None, None)
    values, vectors = np.linalg.eig(steps)
    assert np.abs(values).max() < 1, "the steps are unstable"
    exact = poles_hz(state)
    ours = np.sort(np.abs(np.log(values[values.imag > 0])) / model.opt.timestep) / (2 * np.pi)
    count = int((exact < highest_hz).sum())
    return float(np.abs(ours[:count] / exact[:count] - 1).max(initial=0))


def deviations(case):
    """Deviations of one case."""
    model = mujoco.MjModel.from_xml_path(case["mjcf"])
    data = mujoco.MjData(model)
    key = model.key("rest").qpos.copy()
    at, stiffness = equilibrium(model, data, np.zeros(model.nq))
    sag = np.abs(at).max()
    rest = np.abs(at - key).max() / (sag if sag > 0 else 1)
    damping = -derivative(lambda qvel: residual(model, data, at, qvel), np.zeros(model.nv))
    residual(model, data, at, np.zeros(model.nv))
    mass = mass_matrix(model, data)
    highest = natural_hz(mass, stiffness)[-1]
    theirs = np.array(case["natural_hz"])
    if case["is_damped"]:
        ours = poles_hz(state_matrix(mass, stiffness, damping))[: theirs.size]
    else:
        ours = natural_hz(mass, stiffness)
    assert ours.shape == theirs.shape, "another number of degrees of freedom"
    # Along the axes of the TCP.
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, model.site("tcp").id)
    jacobian = data.site("tcp").xmat.reshape(3, 3).T @ jacobian
    worst = 0.0
    for hz, packed in zip(case["hz"], case["receptance"]):
        omega = 2 * np.pi * hz
        dynamic = stiffness + 1j * omega * damping - omega**2 * mass
        receptance = jacobian @ np.linalg.solve(dynamic, jacobian.T)
        xx, yx, yy, zx, zy, zz = [complex(*element) for element in packed]
        expected = np.array([[xx, yx, zx], [yx, yy, zy], [zx, zy, zz]])
        worst = max(worst, np.abs(receptance - expected).max() / np.abs(expected).max())
    return {
        "rest": float(rest),
        "frequency": float(np.abs(ours / theirs - 1).max()),
        "receptance": float(worst),
        "stepped": stepped(model, data, at, mass, stiffness, damping, case["hz"][-1]),
        "step_angle": float(model.opt.timestep * 2 * np.pi * highest),
    }


def main():
    """Prints the deviations of the cases of a file."""
    with open(sys.argv[1], encoding="utf-8") as file:
        cases = json.load(file)
    print(json.dumps([deviations(case) for case in cases]))


main()
