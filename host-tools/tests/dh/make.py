"""Writes the Denavit-Hartenberg tables of this folder: `python3 make.py` (numpy).

The parameters are those that KUKA's users publish of the LBR iiwa 14 R820 (d1 = 360, d3 = 420, d5 = 400, d7 = 126 mm; no a). The masses are those of
../urdf/kuka_iiwa14.urdf, taken into the frames of each convention by forward kinematics of both, written here anew.
"""
import os
import xml.etree.ElementTree as ElementTree

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def turn(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] = np.eye(3) + s * k + (1 - c) * k @ k
    return pose


def move(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


X, Z = (1, 0, 0), (0, 0, 1)


def origin(element):
    own = element.find("origin")
    if own is None:
        return np.eye(4)
    r, p, y = map(float, own.get("rpy", "0 0 0").split())
    return move(*map(float, own.get("xyz", "0 0 0").split())) @ turn(Z, y) @ turn((0, 1, 0), p) @ turn(X, r)


robot = ElementTree.parse(os.path.join(HERE, "../urdf/kuka_iiwa14.urdf")).getroot()
joints = [j for j in robot.findall("joint") if j.get("type") == "revolute"]
links = {link.get("name"): link for link in robot.findall("link")}
tip = next(j for j in robot.findall("joint") if j.find("child").get("link") == "iiwa_link_ee_kuka")


def of_urdf(q):
    poses, pose = [], np.eye(4)
    for joint, angle in zip(joints, q):
        pose = pose @ origin(joint) @ turn(tuple(map(float, joint.find("axis").get("xyz").split())), angle)
        poses.append(pose)
    return poses, pose @ origin(tip)


D = [360, 0, 420, 0, 400, 0, 126]
ALPHA = [-90, 90, 90, -90, -90, 90, 0]


def of_table(q, convention):
    poses, pose = [], np.eye(4)
    for i, angle in enumerate(q):
        about_z = turn(Z, angle) @ move(0, 0, D[i] / 1e3)
        if convention == "standard":
            pose = pose @ about_z @ turn(X, np.radians(ALPHA[i]))
        else:
            pose = pose @ turn(X, np.radians(ALPHA[i - 1] if i else 0)) @ about_z
        poses.append(pose)
    return poses, pose


def table(convention):
    rng = np.random.default_rng(1)
    q = rng.uniform(-1, 1, (9, 7))
    off = max(np.abs(of_urdf(own)[1] - of_table(own, convention)[1]).max() for own in q)
    print(convention, "tip off by", off)
    lines = []
    for i, joint in enumerate(joints):
        # From the link's frame to the row's: the same in each pose.
        from_link = [np.linalg.inv(of_table(own, convention)[0][i]) @ of_urdf(own)[0][i] for own in q]
        assert max(np.abs(own - from_link[0]).max() for own in from_link) < 1e-9, (convention, i)
        inertial = links[joint.find("child").get("link")].find("inertial")
        centre = from_link[0] @ origin(inertial)
        own = inertial.find("inertia")
        xx, yy, zz, xy, xz, yz = (float(own.get(k)) for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
        r = centre[:3, :3]
        inertia = r @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ r.T
        limit = joint.find("limit")
        alpha = ALPHA[i] if convention == "standard" else (ALPHA[i - 1] if i else 0)
        numbers = [np.degrees(float(limit.get("lower"))), np.degrees(float(limit.get("upper"))), float(inertial.find("mass").get("value"))]
        numbers += [*centre[:3, 3], *np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        lines.append(f"A{i + 1},q{i + 1},{D[i]},0,{alpha}," + ",".join(f"{np.round(n, 9) + 0:.9g}" for n in numbers))
    head = "joint,theta [deg],d [mm],a [mm],alpha [deg],lower [deg],upper [deg],mass [kg],cx [m],cy [m],cz [m]"
    head += "," + ",".join(f"{k} [kg m2]" for k in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"))
    with open(os.path.join(HERE, f"iiwa14-{convention}.csv"), "w") as file:
        file.write("\n".join([head, *lines]) + "\n")


table("standard")
table("modified")
