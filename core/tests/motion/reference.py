"""Writes reference.rs: how MuJoCo moves robots with six-axis bushings, for the tests of the equation of motion.

    pip install mujoco==4.0.0 numpy==2.4.6
    python reference.py > reference.rs

Accelerations of random chains at bushing angles of up to a radian, with gravity and a force on the TCP, and two
motions of one second: Runge and Kutta's method (order 4) with a step of 10 µs, here, over MuJoCo's accelerations,
because MuJoCo's own holds the force while a step lasts. All numbers in double precision, SI units.
"""

import textwrap

import mujoco
import numpy as np

rng = np.random.default_rng(2025)
STEP = 1e-5
DURATION = 1.0
GRAVITY = [0.8, -1.1, -9.7]


def quaternion():
    """w x y z, evenly distributed."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def matrix(quaternion):
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, quaternion)
    return flat.reshape(3, 3)


def draw_joint():
    """A drive, its bushing and its link; masses of a desktop robot, bushings so soft that everything counts."""
    points = rng.uniform(-0.1, 0.1, size=(6, 3))
    mass = rng.uniform(1, 10)
    inertia = sum((np.dot(p, p) * np.eye(3) - np.outer(p, p)) for p in points) * mass / 6
    moments, axes = np.linalg.eigh(inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    principal = np.zeros(4)
    mujoco.mju_mat2Quat(principal, axes.flatten())
    axis = rng.normal(size=3)
    return dict(
        origin=rng.uniform(-0.5, 0.5, 3),
        turn=quaternion(),
        axis=axis / np.linalg.norm(axis),
        revolute=rng.uniform() < 0.8,
        angle=rng.uniform(-2, 2),
        mass=mass,
        centre=rng.uniform(-0.2, 0.2, 3),
        moments=moments,
        principal=principal,
        stiffness=np.concatenate([rng.uniform(1e3, 1e4, 3), rng.uniform(3e2, 3e3, 3)]),
        damping=np.concatenate([rng.uniform(1, 100, 3), rng.uniform(0.1, 10, 3)]),
    )


def text(numbers):
    return " ".join(repr(float(x)) for x in numbers)


class Robot:
    """A chain of drawn joints, and MuJoCo's model of it."""

    def __init__(self, joints):
        self.joints = [draw_joint() for _ in range(joints)]
        self.tcp = (rng.uniform(-0.5, 0.5, 3), quaternion())
        body = f'<site name="tcp" pos="{text(self.tcp[0])}" quat="{text(self.tcp[1])}"/>'
        for joint in reversed(self.joints):
            # The drive turns or slides the joint frame; MuJoCo sees where it ends.
            drive, slide = np.array([1.0, 0, 0, 0]), np.zeros(3)
            if joint["revolute"]:
                mujoco.mju_axisAngle2Quat(drive, joint["axis"], joint["angle"])
            else:
                slide = joint["axis"] * joint["angle"]
            turn = np.zeros(4)
            mujoco.mju_mulQuat(turn, joint["turn"], drive)
            origin = joint["origin"] + matrix(joint["turn"]) @ slide
            bushing = ""
            for dof in range(6):
                axis = text(np.eye(3)[dof % 3])
                kind = "slide" if dof < 3 else "hinge"
                k, d = float(joint["stiffness"][dof]), float(joint["damping"][dof])
                bushing += f'<joint type="{kind}" axis="{axis}" stiffness="{k!r}" damping="{d!r}"/>'
            inertial = (
                f'<inertial mass="{joint["mass"]!r}" pos="{text(joint["centre"])}" '
                f'quat="{text(joint["principal"])}" diaginertia="{text(joint["moments"])}"/>'
            )
            body = f'<body pos="{text(origin)}" quat="{text(turn)}">{inertial}{bushing}{body}</body>'
        self.model = mujoco.MjModel.from_xml_string(
            f'<mujoco><compiler angle="radian"/><option gravity="{text(GRAVITY)}"/>'
            f"<worldbody>{body}</worldbody></mujoco>"
        )
        self.data = mujoco.MjData(self.model)

    def acceleration(self, q, rate, force):
        """Of the bushing coordinates; force on the TCP in base axes."""
        self.data.qpos[:], self.data.qvel[:] = q, rate
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        self.data.qfrc_applied[:] = 0
        point = self.data.site("tcp").xpos
        last = self.model.nbody - 1
        mujoco.mj_applyFT(
            self.model, self.data, force, np.zeros(3), point, last, self.data.qfrc_applied
        )
        mujoco.mj_forward(self.model, self.data)
        return self.data.qacc.copy()

    def position(self, q):
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.site("tcp").xpos.copy()

    def source(self):
        joints = ""
        for joint in self.joints:
            axes = matrix(joint["principal"])
            inertia = axes @ np.diag(joint["moments"]) @ axes.T
            inertia = (inertia + inertia.T) / 2
            joints += (
                f"Joint {{ origin: {array(joint['origin'])}, turn: {array(joint['turn'])}, "
                f"axis: {array(joint['axis'])}, revolute: {str(bool(joint['revolute'])).lower()}, "
                f"angle: {joint['angle']!r}, mass: {joint['mass']!r}, centre: {array(joint['centre'])}, "
                f"inertia: {array(inertia.flatten())}, stiffness: {array(joint['stiffness'])}, "
                f"damping: {array(joint['damping'])} }},"
            )
        return f"Robot {{ joints: &[{joints}], tcp: {array(self.tcp[0])}, tcp_turn: {array(self.tcp[1])} }}"


def array(numbers):
    return "[" + textwrap.fill(", ".join(repr(float(x)) for x in numbers), 110) + "]"


def push(time, peak):
    return peak * np.sin(np.pi * time) ** 2 * (1 + np.sin(20 * time))


def trajectory(robot, q, rate, peak):
    state = np.concatenate([q, rate])
    n = len(q)

    def slope(time, state):
        return np.concatenate([state[n:], robot.acceleration(state[:n], state[n:], push(time, peak))])

    h = STEP
    for step in range(round(DURATION / h)):
        time = step * h
        a = slope(time, state)
        b = slope(time + h / 2, state + h / 2 * a)
        c = slope(time + h / 2, state + h / 2 * b)
        d = slope(time + h, state + h * c)
        state = state + h / 6 * (a + 2 * b + 2 * c + d)
    return state[:n], state[n:]


print("//! How MuJoCo moves robots with six-axis bushings. Written by reference.py, which has the command.")
print("use super::mujoco::{Acceleration, Joint, Motion, Robot};")
print(f"/// Base axes, m/s².\npub(crate) const GRAVITY: [f64; 3] = {array(GRAVITY)};")
print("/// Accelerations at one state each.\npub(crate) const ACCELERATIONS: &[Acceleration] = &[")
for joints in [1, 2, 3, 4, 5, 6, 7]:
    robot = Robot(joints)
    q = np.concatenate([np.r_[rng.uniform(-0.2, 0.2, 3), rng.uniform(-1, 1, 3)] for _ in range(joints)])
    rate = rng.uniform(-3, 3, 6 * joints)
    force = rng.uniform(-300, 300, 3)
    result = robot.acceleration(q, rate, force)
    print(
        f"Acceleration {{ robot: {robot.source()}, elongation: &{array(q)}, rate: &{array(rate)}, "
        f"force: {array(force)}, acceleration: &{array(result)} }},"
    )
print("];")
print(f"/// Each lasts {DURATION} s.\npub(crate) const MOTIONS: &[Motion] = &[")
for joints in [1, 3]:
    robot = Robot(joints)
    q, rate = rng.uniform(-0.1, 0.1, 6 * joints), rng.uniform(-1, 1, 6 * joints)
    peak = rng.uniform(-200, 200, 3)
    start = robot.position(q)
    end, end_rate = trajectory(robot, q, rate, peak)
    moved = robot.position(end) - start
    print(
        f"Motion {{ robot: {robot.source()}, elongation: &{array(q)}, rate: &{array(rate)}, "
        f"peak: {array(peak)}, end: &{array(end)}, end_rate: &{array(end_rate)}, tcp: {array(moved)} }},"
    )
print("];")
