"""The reference scenario's robot as MuJoCo sees it: six joints in a row with spring and damper are a bushing."""

import pathlib
import tomllib

import mujoco
import numpy as np
from mujoco import rollout

SCENARIO = pathlib.Path(__file__).parents[2] / "host-tools/scenario"
MODEL = tomllib.loads((SCENARIO / "mill3-model.toml").read_text())
TRUTH = tomllib.loads((SCENARIO / "mill3.toml").read_text())
RATE = TRUTH["measurement"]["rate_hz"]
BAND = TRUTH["measurement"]["band_hz"]
DURATION = TRUTH["measurement"]["duration_s"]
SAMPLES = round(RATE * DURATION)
JOINTS = [joint["name"] for joint in MODEL["joint"]]
DOFS = ["tx", "ty", "tz", "rx", "ry", "rz"]

# Per joint: six stiffnesses, then six dampings.
TRUE = np.array([one["stiffness"] + one["damping"] for one in TRUTH["truth"]])


def bounds():
    """Lowest and highest value of every parameter, in the order of TRUE."""
    ranges = TRUTH["bounds"]
    kinds = [
        "stiffness_translation_n_per_m",
        "stiffness_rotation_nm_per_rad",
        "damping_translation_ns_per_m",
        "damping_rotation_nms_per_rad",
    ]
    one = np.repeat([ranges[kind] for kind in kinds], 3, axis=0).T
    return tuple(np.tile(limit, (len(JOINTS), 1)) for limit in one)


def parameter_deviation(found):
    """Mean error, each by the range of its bounds."""
    lower, upper = bounds()
    return np.mean(np.abs(found - TRUE) / (upper - lower))


def text(numbers):
    return " ".join(repr(float(number)) for number in numbers)


def xml(pose, parameters, integrator, step, sensor="", actuator=""):
    """The robot at rest at `pose`: every drive turned, every bushing relaxed, nothing else computed."""
    # xfrc_applied acts at the centre of mass: the TCP is a body of (almost) no mass.
    speck = '<inertial mass="1e-9" pos="0 0 0" diaginertia="1e-9 1e-9 1e-9"/>'
    place = text(MODEL["tcp"]["xyz_m"])
    body = f'<body name="tcp" pos="{place}">{speck}<site name="tcp"/></body>'
    assert not any(MODEL["tcp"]["rpy_rad"]), "a tcp that is turned"
    for joint, angle, values in list(zip(MODEL["joint"], pose, parameters))[::-1]:
        assert joint["kind"] == "revolute" and not any(joint["origin_rpy_rad"]), joint["name"]
        turn = np.zeros(4)
        mujoco.mju_axisAngle2Quat(turn, np.array(joint["axis"]), angle)
        bushing = ""
        for dof, name in enumerate(DOFS):
            bushing += (
                f'<joint name="{joint["name"]}_{name}" type="{"slide" if dof < 3 else "hinge"}" '
                f'axis="{text(np.eye(3)[dof % 3])}" '
                f'stiffness="{float(values[dof])!r}" damping="{float(values[6 + dof])!r}"/>'
            )
        inertial = (
            f'<inertial mass="{joint["mass_kg"]!r}" pos="{text(joint["centre_of_mass_m"])}" '
            f'fullinertia="{text(joint["inertia_kg_m2"])}"/>'
        )
        body = (
            f'<body name="{joint["name"]}" pos="{text(joint["origin_xyz_m"])}" quat="{text(turn)}">'
            f"{inertial}{bushing}{body}</body>"
        )
    return (
        f'<mujoco><compiler angle="radian"/>'
        f'<option gravity="0 0 0" integrator="{integrator}" timestep="{step!r}">'
        f'<flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{body}</worldbody><sensor>{sensor}</sensor><actuator>{actuator}</actuator></mujoco>"
    )


class Robot:
    """The robot at one pose, ready to be moved by a force on the TCP."""

    def __init__(self, pose, parameters, integrator, step):
        sensor = '<framelinacc objtype="site" objname="tcp"/>' if step < 1e-4 else ""
        self.model = mujoco.MjModel.from_xml_string(xml(pose, parameters, integrator, step, sensor))
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        # Displacements are so small that the Jacobian at rest tells them.
        self.axes = self.data.site("tcp").xmat.reshape(3, 3).copy()
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, jacobian, None, 0)
        self.jacobian = self.axes.T @ jacobian
        state = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.rest = np.zeros((1, mujoco.mj_stateSize(self.model, state)))

    def control(self, force):
        """What `states` takes, of forces along the TCP's axes, one row a step."""
        control = np.zeros((1, len(force), 6 * self.model.nbody))
        control[0, :, -6:-3] = force @ self.axes.T
        return control

    def states(self, control):
        """mj_step after mj_step from rest, in MuJoCo's own loop: time, positions, velocities after each."""
        applied = mujoco.mjtState.mjSTATE_XFRC_APPLIED
        states, _ = rollout.rollout(
            self.model, self.data, self.rest, control, control_spec=applied
        )
        return states[0]

    def displacement(self, states):
        """Of the TCP, along its axes, one row a state."""
        return states[:, 1 : 1 + self.model.nq] @ self.jacobian.T

    def acceleration(self, states, force):
        """Of the TCP, along its axes, in each of `states` under the force of the same row; needs the sensor."""
        model, data, found = self.model, self.data, np.zeros((len(states), 3))
        for row, (state, push) in enumerate(zip(states, force)):
            data.qpos[:] = state[1 : 1 + model.nq]
            data.qvel[:] = state[1 + model.nq : 1 + model.nq + model.nv]
            data.xfrc_applied[-1, :3] = self.axes @ push
            mujoco.mj_forward(model, data)
            found[row] = self.axes.T @ data.sensordata
        return found
