#!/usr/bin/env python3
"""Robots with the masses that the maker verified, identified with masses from meshes: tests/proof/mesh_coverage.py CHECKOUT [FLEXID [ROBOTS]]

CHECKOUT and FLEXID are those of mesh_masses.py. Each of the first ROBOTS (10) verified robots of six joints carries a spindle of a twentieth of its mass,
and mills the cuts of `flexid new`. `flexid identify` has a model whose links have their masses from meshes, with the accuracies that `model import` states.
Counts the 95 % intervals of identified parameters that hold the truth. Exit status: 0 if each robot is identified, and as many hold as 95 in a hundred
less two standard deviations. Python 3.11, no packages.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

from mesh_masses import bodies, expanded, verified

# Part of the robot's mass that the spindle has, and the place of the TCP from the flange, m.
SPINDLE, TCP = 0.05, (0.1, 0.0, 0.25)


def with_spindle(robot, mass):
    """Adds a link `tip` with the spindle, fixed to the flange."""
    x, y, z = TCP
    moment = mass * z * z / 12
    robot.append(ElementTree.fromstring(
        f'<link name="tip"><inertial><origin xyz="{-x / 2} {-y / 2} {-z / 2}"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    ))
    robot.append(ElementTree.fromstring(
        f'<joint name="spindle" type="fixed"><origin xyz="{x} {y} {z}"/><parent link="tool0"/><child link="tip"/></joint>'
    ))


def held(macro, flexid):
    """Numbers of intervals that hold, and of identified parameters."""
    run = lambda *words: subprocess.run([flexid, *map(str, words)], check=True, capture_output=True, text=True).stdout
    robot, bare = (expanded(macro, macro.parent.parent.name) for _ in range(2))
    total = sum(mass for mass, *_ in bodies(bare).values())
    for own in (robot, bare):
        with_spindle(own, SPINDLE * total)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        urdf = macro.with_suffix(".urdf")
        files = folder / "robot"
        try:
            urdf.write_text(ElementTree.tostring(robot, encoding="unicode"))
            run("new", urdf, "--tcp", "tip", "--out", files)
            config, log, truth = files / "edge.toml", folder / "cut.log", folder / "truth.json"
            run("simulate", "--config", config, "--candump", log, "--truth-json", truth)
            urdf.write_text(ElementTree.tostring(bare, encoding="unicode"))
            run("model", "import", urdf, "--tcp", "tip", "--total-mass", total, "-o", files / "model.toml")
        finally:
            urdf.unlink()
        said = run("identify", "--config", config, log, "--truth", truth)
    return tuple(int(number) for number in re.search(r"^truth: (\d+) of (\d+) intervals", said, re.M).groups()), said


def main(checkout, flexid="flexid", robots=10):
    checkout = pathlib.Path(checkout).resolve()
    names = verified((checkout / "README.md").read_text())
    macros = [macro for name in names for macro in sorted(checkout.glob(f"*/urdf/{name}_macro.xacro"))]
    hold = identified = failed = 0
    for macro in macros[: int(robots)]:
        name = macro.name.removesuffix("_macro.xacro")
        try:
            own, said = held(macro, flexid)
        except subprocess.CalledProcessError as error:
            print(f"{name}: {error.stderr.strip()}")
            failed += 1
            continue
        verdict = re.search(r"^(consistent|MODEL SUSPECT|not settled).*?;", said, re.M)
        print(f"{name:20} {own[0]:3} of {own[1]:3} hold; {verdict and verdict[0]}", flush=True)
        hold, identified = hold + own[0], identified + own[1]
    print(f"{hold} of {identified} intervals hold: {100 * hold / max(identified, 1):.1f} %")
    least = 0.95 * identified - 2 * (0.95 * 0.05 * identified) ** 0.5
    return failed == 0 and identified > 0 and hold >= least


if __name__ == "__main__":
    if not 2 <= len(sys.argv) <= 4:
        sys.exit(__doc__)
    sys.exit(not main(*sys.argv[1:]))
