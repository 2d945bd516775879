"""Exports read back with NumPy, the standard library and the columns of the trajectory.

Usage: export_test.py PROGRAM SCENES WORK
"""

import csv
import os
import pathlib
import shutil
import subprocess
import sys
import xml.etree.ElementTree as tree

import numpy

PROGRAM, SCENES, WORK = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
SINGLE = 1e-6  # cables, radius, VTK's points


def mantle(*arguments, status=0, path=None):
    environment = {**os.environ, "PATH": path} if path else None
    done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=WORK, capture_output=True, text=True, env=environment)
    assert done.returncode == status, (arguments, done.returncode, done.stderr)
    return done.stderr if status else done.stdout


def table(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], rows[1:]


def columns(path):
    titles, rows = table(path)
    return {title: numpy.array([float(row[i]) for row in rows]) for i, title in enumerate(titles)}


def check_npz(run):
    mantle("export", "run", "--format", "npz")
    with numpy.load(WORK / "run.npz") as data:
        shapes = len(run["time_s"])
        assert data["time_s"].shape == (shapes,)
        assert data["arm_position_m"].shape == (shapes, 21, 3)
        assert data["arm_stress"].shape == (shapes, 20, 6)
        assert data["mantle_profile"].shape[0] == shapes
        for k, axis in enumerate("xyz"):
            # Two outputs of one run agree to the bit.
            assert (data["arm_position_m"][:, -1, k] == run[f"arm_tip_{axis}_m"]).all()
            assert (data["root_position_m"][:, k] == run[f"root_{axis}_m"]).all()
            assert (data["trajectory_root_x_m"] == run["root_x_m"]).all()
        tension = data["cable_mantle_squeeze_tension_n"]
        assert numpy.abs(tension - run["mantle_squeeze_tension_n"]).max() < SINGLE
        # Volume of the mantle from its meridian, as the plant computes it: pi r^2 dz by frusta.
        r, z = data["mantle_profile"][-1, :, 0], data["mantle_profile"][-1, :, 1]
        volume = -numpy.pi / 3 * ((r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2) * numpy.diff(z)).sum()
        assert abs(volume / run["volume_m3"][-1] - 1) < 1e-12, volume


def check_vtk(run):
    mantle("export", "run", "--format", "vtk", "--shapes", "3", "--out", "vtk")
    series = tree.parse(WORK / "vtk/shapes.pvd").findall("Collection/DataSet")
    assert [float(s.get("timestep")) for s in series][::2] == [0.0, run["time_s"][-1]]
    piece = tree.parse(WORK / "vtk" / series[-1].get("file")).find("PolyData/Piece")
    points = int(piece.get("NumberOfPoints"))

    def array(path):
        node = piece.find(path)
        return numpy.array(node.text.split(), dtype=float)

    xyz = array("Points/DataArray").reshape(-1, 3)
    assert len(xyz) == points
    for kind, cells in (("Polys", int(piece.get("NumberOfPolys"))), ("Lines", int(piece.get("NumberOfLines")))):
        connectivity = array(f"{kind}/DataArray[@Name='connectivity']")
        offsets = array(f"{kind}/DataArray[@Name='offsets']")
        assert len(offsets) == cells and offsets[-1] == len(connectivity)
        assert connectivity.min() >= 0 and connectivity.max() < points
    body = array("PointData/DataArray[@Name='body']")
    tip = [run[f"arm_tip_{axis}_m"][-1] for axis in "xyz"]
    # The last ring of the arm lies the tip's radius, 6 mm, around the tip.
    ring = xyz[body == 1][-16:]
    assert numpy.abs(numpy.linalg.norm(ring - tip, axis=1) - 0.006).max() < SINGLE
    hoop = array("PointData/DataArray[@Name='hoop_strain']")
    assert numpy.isfinite(hoop[body == 0]).all() and numpy.isnan(hoop[body != 0]).all()


def check_csv(run):
    mantle("export", "run", "--format", "csv")
    titles, nodes = table(WORK / "run_csv/nodes.csv")
    assert len(nodes) == 21 * len(run["time_s"])
    assert float(nodes[-1][titles.index("x_m")]) == run["arm_tip_x_m"][-1]
    for name, of in (("spans", 20), ("mantle_spans", 32), ("cables", 4 * 21 + 16), ("root", 1), ("mantle_nodes", 33)):
        titles, rows = table(WORK / f"run_csv/{name}.csv")
        assert len(rows) == of * len(run["time_s"]), (name, len(rows))
        assert all(len(row) == len(titles) for row in rows), name


def check_refusals():
    assert "is there already" in mantle("export", "run", "--format", "csv", status=2)
    assert "there is no such folder" in mantle("export", "nowhere", "--format", "npz", status=2)
    assert "--format" in mantle("export", "run", "--format", "xls", status=2)
    mantle("run", SCENES / "arm_dynamic.toml", "--set", "time.duration=0.1", "--shape-every", "0", "--out", "bare")
    assert "has no shapes to export as vtk" in mantle("export", "bare", "--format", "vtk", status=2)
    assert "must be WIDTHxHEIGHT" in mantle("export", "run", "--format", "mp4", "--picture", "321x240", status=2)
    assert "chromium is not in PATH: must be installed" in mantle("export", "run", "--format", "mp4", status=2, path="/nowhere")
    assert not (WORK / "run.mp4").exists()
    assert not (WORK / "bare_vtk").exists() and not (WORK / "bare_vtk.partial").exists()


def main():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    mantle("run", SCENES / "vehicle.toml", "--set", "time.duration=0.4", "--out", "run")
    run = columns(WORK / "run/trajectory.csv")
    check_npz(run)
    check_vtk(run)
    check_csv(run)
    check_refusals()
    print("npz, vtk and csv agree with the trajectory")


main()
