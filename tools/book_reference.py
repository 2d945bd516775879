#!/usr/bin/env python3
"""book_reference.py ROOT OUT: writes the pages of the book's reference into the folder OUT, one for every
public header, and one for every folder that holds some."""

import pathlib
import sys

FOLDERS = {
    "model": "Mechanics: robot, loads, rod, shell, rigid body, integrators, statics",
    "reduced": "The reduced model at run time",
    "reduced/build": "Making a reduced model of a robot",
    "controller": "Plans, baselines, estimators",
    "firmware_sim/bus": "CAN buses",
    "firmware_sim/canopen": "CANopen",
    "firmware_sim/drive": "Drives",
    "firmware_sim/master": "Master of the drives",
    "loop": "The closed loop",
    "loop/plant_side": "The plant's side of the wire",
    "loop/control_side": "The controller's side of the wire",
    "loop/scene": "Scene files",
}


def toctree(entries):
    return "```{toctree}\n:maxdepth: 1\n\n" + "\n".join(entries) + "\n```\n"


def main():
    root, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    headers = [path.relative_to(root).as_posix()
               for top in ("model", "reduced", "controller", "firmware_sim", "loop")
               for path in sorted((root / top).rglob("*.h"))]
    unknown = {header.rpartition("/")[0] for header in headers} - FOLDERS.keys()
    if unknown:
        sys.exit(f"book_reference.py: no title for the folders {', '.join(sorted(unknown))}")
    folders = {folder: [h for h in headers if h.rpartition("/")[0] == folder] for folder in FOLDERS}
    for folder, inside in folders.items():
        for header in inside:
            page = out / f"{header.removesuffix('.h')}.md"
            page.parent.mkdir(parents=True, exist_ok=True)
            page.write_text(f"# `{header}`\n\n```{{doxygenfile}} {header}\n```\n")
        entries = [f"{header.rpartition('/')[2].removesuffix('.h')}" for header in inside]
        (out / folder / "index.md").write_text(f"# {FOLDERS[folder]}\n\n" + toctree(entries))
    (out / "index.md").write_text(
        "# C++ reference\n\nFrom the headers. [library.md](../library.md) says what to link.\n\n"
        + toctree(f"{folder}/index" for folder in folders if folders[folder]))


if __name__ == "__main__":
    main()
