"""Checks that the robots of feed.py move as prescribed."""

import mujoco
import numpy as np

import cutter
from course import Course
from driven import Driven
from robots import EXPERIMENTS, RATE_HZ, loaded, truth

SHORT_S = 1.0


def rigid(joints):
    """Largest distance of the tool from its line, m: bushings a thousand times as stiff, no gravity, no force."""
    model, scenario = loaded(joints)
    own = truth(scenario, 0) * np.repeat([1e3, 30.0], 6)
    robot = Driven(model, own, gravity=(0.0, 0.0, 0.0), step_s=1e-5)
    pose, direction, *_ = EXPERIMENTS[joints][0]
    course = Course(robot, pose, 0.01 * np.array(direction), 0.01, SHORT_S)
    times = 1e-5 * np.arange(round(course.duration_s / 1e-5))
    _, places, _ = robot.run(course, np.zeros((len(times), 3)), 1000)
    part = course.law(np.clip(times[::1000] - course.begin_s, 0.0, course.line_s))[0]
    prescribed = robot.place(pose).position + part[:, None] * np.array(direction)
    return np.abs(places - prescribed).max()


def prescribed(joints):
    """Relative error of the bushings' accelerations where the drives' are given, in states at random."""
    model, scenario = loaded(joints)
    robot, rng, worst = Driven(model, truth(scenario, 0)), np.random.default_rng(1), 0.0
    own, data, free, drives = robot.model, robot.data, robot.bushings, robot.drives
    for _ in range(20):
        data.qpos[free], data.qpos[drives] = 1e-3 * rng.normal(size=free.size), rng.normal(size=joints)
        data.qvel[:] = 0.1 * rng.normal(size=own.nv)
        data.act[:] = np.append(rng.normal(size=joints), 100 * rng.normal(size=3))
        mujoco.mj_forward(own, data)
        mass = np.zeros((own.nv, own.nv))
        mujoco.mj_fullM(own, data, mass)
        force = data.qfrc_passive - data.qfrc_bias + data.qfrc_actuator
        load = force[free] - mass[np.ix_(free, drives)] @ data.act[:joints]
        right = np.linalg.solve(mass[np.ix_(free, free)], load)
        worst = max(worst, np.linalg.norm(data.qacc[free] - right) / np.linalg.norm(right))
        worst = max(worst, np.abs(data.qacc[drives] - data.act[:joints]).max())
    return worst


def step(joints):
    """Acceleration at 0.1 ms less that at 0.05 ms, RMS over RMS from 2 to 200 Hz, the worst axis."""
    model, scenario = loaded(joints)
    pose, direction, axis, rpm = EXPERIMENTS[joints][0]
    found = []
    fine, rng = 5e-5, np.random.default_rng(1)
    for step_s in (fine, 2 * fine):
        robot = Driven(model, truth(scenario, 0), step_s=step_s)
        course = Course(robot, pose, 0.1 * np.array(direction), 0.1, 2.0)
        if step_s == fine:
            steps = round(course.duration_s * RATE_HZ) * round(1 / RATE_HZ / fine)
            force = cutter.force(scenario["force"], axis, rpm, course.cut_s, fine, steps, rng)
        own = force[:: round(step_s / fine)]
        found.append(robot.run(course, own, round(1 / RATE_HZ / step_s))[0])
    spectra = [np.fft.rfft(one - one.mean(axis=0), axis=0) for one in found]
    frequencies = np.fft.rfftfreq(len(found[0]), 1 / RATE_HZ)
    band = (frequencies >= 2.0) & (frequencies <= 200.0)
    size = lambda spectrum: np.linalg.norm(spectrum[band], axis=0)
    return (size(spectra[1] - spectra[0]) / size(spectra[0])).max()


def report(joints):
    print(f"the tool is at most {rigid(joints):.1e} m off its path while the robot is all but rigid;")
    print(f"accelerations are as prescribed to {prescribed(joints):.1e}, and those at a step of 0.1 ms to {step(joints):.1e}\n", flush=True)
