#!/usr/bin/env python3
"""Masses from meshes against those that the maker verified: tests/proof/mesh_masses.py CHECKOUT [FLEXID]

CHECKOUT is a checkout of github.com/kroshu/kuka_robot_descriptions (Apache-2.0), FLEXID the program (flexid). Each robot whose README says that
its inertial values are verified is imported without them, with `flexid model import --total-mass` of their sum, and compared link by link.
Python 3.11, no packages.
"""
import math
import pathlib
import re
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree

# Median of a link's mass, and of nine in ten of them, as factors.
MEDIAN, NINE_IN_TEN = 1.2, 1.6
# Root mean squares that `model import` states: of a mass, of an inertia beside it, of a centre over the arm's length (host-tools/src/urdf/meshes.rs).
STATED = 0.3, 0.4, 0.035
# Verified robots of the checkout.
ROBOTS = 30
# One-sided quantile of the normal distribution: one run in twenty is beyond it by chance.
QUANTILE = 1.645
# Part of a link's mean mass below which a mass is a placeholder.
PLACEHOLDER = 0.01


def verified(readme):
    """Names of the robots whose inertial values are verified."""
    table = readme.split("## What is verified?")[1].split("\n## ")[0]
    rows = [[cell.strip() for cell in line.split("|")] for line in table.splitlines()]
    column = next(row for row in rows if "Inertial values" in row).index("Inertial values")
    return [row[1] for row in rows if len(row) > column and row[column] == "✓"]


def expanded(macro, package):
    """The links and joints of a macro as a robot."""
    number = lambda own: str(eval(own[1], {"__builtins__": {}}, {"pi": math.pi, "radians": math.radians}))
    text = macro.read_text().replace("${prefix}", "").replace("${package_name}", package)
    text = re.sub(r"\$\{([-+*/.()0-9pi\s]*|radians\([-0-9. ]*\))\}", number, text).replace("--", "")
    text = re.sub(r"<!.*?>", "", text, flags=re.S)
    body = next(own for own in ElementTree.fromstring(text) if own.tag.endswith("macro"))
    links = {own.get("name"): own for own in body.findall("link")}
    ends = lambda joint: [joint.find(end).get("link") for end in ("parent", "child")]
    joints = [own for own in body.findall("joint") if all(end in links for end in ends(own))]
    for own in [part for all in (*links.values(), *joints) for part in all.iter()]:
        for block in [block for block in own if "xacro" in block.tag]:
            own.remove(block)
    robot = ElementTree.Element("robot", name=macro.name.removesuffix("_macro.xacro"))
    robot.extend([*links.values(), *joints])
    return robot


def turn(angles):
    """Rows of the rotation by roll, pitch and yaw about fixed axes."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(own), math.cos(own)) for own in angles)
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


def bodies(robot):
    """Mass, centre and moments about the link's axes of each link, taken out of it."""
    found = {}
    for link in robot.findall("link"):
        own = link.find("inertial")
        if own is None:
            continue
        link.remove(own)
        numbers = lambda name: [float(n) for n in own.find("origin").get(name, "0 0 0").split()]
        r = turn(numbers("rpy"))
        get = lambda name: float(own.find("inertia").get(name))
        tensor = [[get("ixx"), get("ixy"), get("ixz")], [get("ixy"), get("iyy"), get("iyz")], [get("ixz"), get("iyz"), get("izz")]]
        moments = [sum(r[k][i] * tensor[i][j] * r[k][j] for i in range(3) for j in range(3)) for k in range(3)]
        found[link.get("name")] = float(own.find("mass").get("value")), numbers("xyz"), moments
    return found


def compared(robot, truth, flexid, folder):
    """For each link of a robot but the last, and for the last: errors of mass, centre and moments."""
    urdf = folder / f"{robot.get('name')}.urdf"
    urdf.write_text(ElementTree.tostring(robot, encoding="unicode"))
    model = urdf.with_suffix(".toml")
    total = sum(mass for mass, *_ in truth.values())
    try:
        options = ["--tcp", "tool0", "--total-mass", str(total), "-o", model]
        subprocess.run([flexid, "model", "import", urdf, *options], check=True, capture_output=True, text=True)
    except subprocess.CalledProcessError as error:
        print(f"{robot.get('name')}: {error.stderr.strip()}")
        return [], []
    finally:
        urdf.unlink()
    found = tomllib.loads(model.read_text())
    model.unlink()
    child = {own.get("name"): own.find("child").get("link") for own in robot.findall("joint")}
    arm = sum(math.dist(joint["origin_xyz_m"], [0, 0, 0]) for joint in found["joint"][1:])
    errors = []
    for joint in found["joint"]:
        mass, centre, moments = truth[child[joint["name"]]]
        own = joint["mass_kg"]
        if mass < PLACEHOLDER * total / len(truth):
            errors.append(None)
            continue
        off = [(a - b) / arm for a, b in zip(centre, joint["centre_of_mass_m"])]
        inertia = [math.log(a / mass * own / b) for a, b in zip(moments, joint["inertia_kg_m2"])]
        errors.append((math.log(mass / own), mass / own - 1, off, inertia))
    print(f"{robot.get('name'):20} {total:7.1f} kg", *("     -" if e is None else f"{math.exp(e[0]):6.2f}" for e in errors))
    return [own for own in errors[:-1] if own], [own for own in errors if own]


def quantile(values, part):
    values = sorted(values)
    return values[min(len(values) - 1, int(part * len(values)))]


def root_mean_square(values):
    values = list(values)
    return math.sqrt(sum(own * own for own in values) / len(values))


def main(checkout, flexid="flexid"):
    checkout = pathlib.Path(checkout).resolve()
    counting, every, robots = [], [], 0
    print("true mass over that from the mesh, from the first link to the last")
    for name in verified((checkout / "README.md").read_text()):
        for macro in checkout.glob(f"*/urdf/{name}_macro.xacro"):
            package = macro.parent.parent
            robot = expanded(macro, package.name)
            truth = bodies(robot)
            own, last = compared(robot, truth, flexid, macro.parent)
            counting, every, robots = counting + own, every + last, robots + bool(own)
    masses = [abs(own[0]) for own in counting]
    median, nine = math.exp(quantile(masses, 0.5)), math.exp(quantile(masses, 0.9))
    print(f"{robots} robots, {len(counting)} links but the last: factor {median:.2f} (median), {nine:.2f} (90 %)")
    print(f"all {len(every)} links: factor {math.exp(quantile([abs(o[0]) for o in every], 0.5)):.2f}, {math.exp(quantile([abs(o[0]) for o in every], 0.9)):.2f}")
    mass = root_mean_square(own[1] for own in counting)
    inertia = root_mean_square(n for own in counting for n in own[3])
    centre = root_mean_square(n for own in counting for n in own[2])
    print(f"root mean square: mass {mass:.2f}, inertia beside mass {inertia:.2f}, centre {centre:.3f} of the arm along an axis")
    # A root mean square of n numbers is off by 1 / sqrt(2 n) of itself. Links of one robot go together.
    chance = 1 + QUANTILE / math.sqrt(2 * ROBOTS)
    is_stated = all(own <= chance * stated for own, stated in zip((mass, inertia, centre), STATED))
    return 0 if robots == ROBOTS and median <= MEDIAN and nine <= NINE_IN_TEN and is_stated else 1


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
