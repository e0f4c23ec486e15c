#
# It needs pydrake (tried with 1.51). `add_robot` adds the robot to a plant. The bushings are stiff: use a continuous plant
# (time_step 0) with an implicit integrator, or linearise it.

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    LinearBushingRollPitchYaw,
    RotationalInertia,
    RpyFloatingJoint,
    SpatialInertia,
)


def transform(entry):
    """Returns the pose that an entry holds."""
    rotation = RotationMatrix(np.array(entry["rotation"]))
    return RigidTransform(rotation, np.array(entry["translation"]))


def add_robot(plant):
    """Adds links and bushings to a plant that is not final, and returns the frame of the TCP.

    The frame `<joint>_drive` is the joint's frame with its drive locked, and `<joint>_link` is the link's. The coordinates of the
    floating joint `<joint>_bushing` are 0 where the springs are relaxed.
    """
    before = plant.world_frame()
    for joint in JOINTS:
        name = joint["name"]
        inertia = SpatialInertia.MakeFromCentralInertia(
            mass=joint["mass"],
            p_PScm_E=np.array(joint["centre_of_mass"]),
            I_SScm_E=RotationalInertia(*joint["inertia"]),
        )
        link = plant.AddRigidBody(name + "_link", inertia).body_frame()
        drive = plant.AddFrame(FixedOffsetFrame(name + "_drive", before, transform(joint)))
        plant.AddJoint(RpyFloatingJoint(name + "_bushing", drive, link))
        # The link's frame is A: roll, pitch and yaw are then the turns about x, the new y and the new z, negated.
        plant.AddForceElement(
            LinearBushingRollPitchYaw(
                frameA=link,
                frameC=drive,
                torque_stiffness_constants=np.array(joint["torque_stiffness"]),
                torque_damping_constants=np.array(joint["torque_damping"]),
                force_stiffness_constants=np.array(joint["force_stiffness"]),
                force_damping_constants=np.array(joint["force_damping"]),
            )
        )
        before = link
    plant.mutable_gravity_field().set_gravity_vector(np.array(GRAVITY))
    return plant.AddFrame(FixedOffsetFrame("tcp", before, transform(TCP)))


def main():
    """Builds the plant and prints what it holds."""
    plant = MultibodyPlant(time_step=0.0)
    add_robot(plant)
    plant.Finalize()
    mass = plant.CalcTotalMass(plant.CreateDefaultContext())
    print(f"{NAME}: {plant.num_positions()} coordinates, {mass:.3f} kg")
