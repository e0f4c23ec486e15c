"""A robot of which MuJoCo turns the drives exactly as prescribed, with a bushing of six joints behind each drive.

A drive is a hinge with an armature of 1e15 kg m², which an actuator accelerates as prescribed. Reactions of 1e5 Nm change
that by 1e-10 rad/s², and an armature adds no other term to the equation of motion. An actuator's activation is the
integral of its control: between two steps RK4 sees drives and force on straight lines.
"""

import pathlib
import tomllib

import mujoco
import numpy as np
from mujoco import rollout

from cutter import knots

SCENARIO = pathlib.Path(__file__).parents[2] / "host-tools/scenario"
DOFS = ["tx", "ty", "tz", "rx", "ry", "rz"]
ARMATURE = 1e15
# MuJoCo gives a body six joints at most: that of a drive is one of (almost) no mass.
SPECK = '<inertial mass="1e-9" pos="0 0 0" diaginertia="1e-9 1e-9 1e-9"/>'
STEP_S = 1e-4
GRAVITY = (0.0, 0.0, -9.80665)


def text(numbers):
    return " ".join(repr(float(number)) for number in numbers)


def xml(model, parameters, gravity, step_s):
    """`parameters`: a row a joint, six stiffnesses, then six dampings."""
    tcp = model["tcp"]
    body = f'<site name="tcp" pos="{text(tcp["xyz_m"])}" euler="{text(tcp["rpy_rad"])}"/>'
    actuators = ""
    for joint, values in list(zip(model["joint"], parameters))[::-1]:
        name = joint["name"]
        bushing = "".join(
            f'<joint name="{name}_{dof}" type="{"slide" if index < 3 else "hinge"}" '
            f'axis="{text(np.eye(3)[index % 3])}" '
            f'stiffness="{float(values[index])!r}" damping="{float(values[6 + index])!r}"/>'
            for index, dof in enumerate(DOFS)
        )
        body = (
            f'<body pos="{text(joint["origin_xyz_m"])}" euler="{text(joint["origin_rpy_rad"])}">'
            f'<joint name="{name}" axis="{text(joint["axis"])}" armature="{ARMATURE!r}"/>{SPECK}'
            f'<body><inertial mass="{joint["mass_kg"]!r}" pos="{text(joint["centre_of_mass_m"])}" '
            f'fullinertia="{text(joint["inertia_kg_m2"])}"/>{bushing}{body}</body></body>'
        )
        actuators = (
            f'<general joint="{name}" dyntype="integrator" gear="{ARMATURE!r}"/>{actuators}'
        )
    for axis in np.eye(3):
        actuators += f'<general site="tcp" dyntype="integrator" gear="{text(axis)} 0 0 0"/>'
    return (
        '<mujoco><compiler angle="radian" eulerseq="XYZ"/>'
        f'<option gravity="{text(gravity)}" integrator="RK4" timestep="{step_s!r}">'
        '<flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{body}</worldbody><actuator>{actuators}</actuator>"
        '<sensor><accelerometer site="tcp"/><framepos objtype="site" objname="tcp"/></sensor>'
        "</mujoco>"
    )


class Place:
    """Where the TCP is: position, m, and axes, base axes."""

    def __init__(self, position, axes):
        self.position, self.axes = position, axes

    def moved(self, by):
        return Place(self.position + by, self.axes)


class Driven:
    """The robot of a model file of flexid."""

    def __init__(self, model, parameters, gravity=GRAVITY, step_s=STEP_S):
        self.model = mujoco.MjModel.from_xml_string(xml(model, parameters, gravity, step_s))
        self.data, self.step_s = mujoco.MjData(self.model), step_s
        self.joints = len(model["joint"])
        self.drives = 7 * np.arange(self.joints)
        self.bushings = np.setdiff1d(np.arange(7 * self.joints), self.drives)
        self.stiffness = self.model.jnt_stiffness[self.bushings].reshape(-1)

    def place(self, angles):
        """Where the TCP is while nothing gives way."""
        self.data.qpos[:] = 0.0
        self.data.qpos[self.drives] = angles
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        tcp = self.data.site("tcp")
        return Place(tcp.xpos.copy(), tcp.xmat.reshape(3, 3).copy())

    def angles(self, place, near):
        """Angles at which the TCP is at `place`; with six drives also its axes are."""
        angles = np.array(near, dtype=float)
        for _ in range(50):
            now = self.place(angles)
            moves, turns = np.zeros((2, 3, self.model.nv))
            mujoco.mj_jacSite(self.model, self.data, moves, turns, 0)
            off, slopes = place.position - now.position, moves[:, self.drives]
            if self.joints >= 6:
                across = np.sum(np.cross(now.axes, place.axes, axis=0), axis=1) / 2
                off, slopes = np.append(off, across), np.vstack([slopes, turns[:, self.drives]])
            if np.linalg.norm(off) < 1e-13:
                return angles
            angles += np.linalg.lstsq(slopes, off, rcond=None)[0]
            if np.linalg.norm(off) < 1e-9:
                return angles
        raise ValueError("the path leaves the reach of the robot")

    def rest(self, pose):
        """The state of a robot that stands and gives way under gravity."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[self.drives] = pose
        for _ in range(30):
            mujoco.mj_forward(model, data)
            data.qpos[self.bushings] = -data.qfrc_bias[self.bushings] / self.stiffness
        state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        return state

    def run(self, course, force, stride):
        """Accelerometer, TCP (base axes) and drives, a row each `stride` steps: m/s², m, rad.

        `force`, N, a row a step, acts along the axes of the tool. The accelerometer turns with it and feels gravity.
        """
        times = self.step_s * np.arange(len(force))
        accelerations = course.at(times)[2]
        inputs = np.hstack([accelerations, knots(force, self.step_s)])
        start = self.rest(course.pose)
        start[-inputs.shape[1] :] = inputs[0]
        control = np.diff(inputs, axis=0, append=inputs[-1:])[None] / self.step_s
        states, _ = rollout.rollout(self.model, self.data, start[None], control)
        states = np.vstack([start, states[0][:-1]])[::stride]
        # What is sensed in each state, under the force itself.
        states[:, -inputs.shape[1] :] = np.hstack([accelerations, force])[::stride]
        still = np.zeros((len(states), 1, inputs.shape[1]))
        _, sensed = rollout.rollout(self.model, self.data, states, still)
        return sensed[:, 0, :3], sensed[:, 0, 3:], states[:, 1 + self.drives]
