#!/usr/bin/env python3
"""book_reference.py ROOT XML OUT: writes the pages of the book's reference into the folder OUT, one for every
folder of public headers. In Doxygen's XML it mends what Sphinx does not read."""

import pathlib
import re
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


def mend(text):
    """Numbers and texts in several parts, which Doxygen keeps apart or splits, in one: Sphinx reads no others."""
    text = re.sub(r"(?<=\d) (?:'|&apos;)(?=\d)", "", text)
    return re.sub(r"&quot;&quot;(?=[^\s,;)}<])", "", text)


def main():
    root, xml, out = (pathlib.Path(argument) for argument in sys.argv[1:])
    for page in xml.glob("*.xml"):
        before = page.read_text()
        after = mend(before)
        if after != before:
            page.write_text(after)
    headers = [path.relative_to(root).as_posix()
               for top in ("model", "reduced", "controller", "firmware_sim", "loop")
               for path in sorted((root / top).rglob("*.h"))]
    unknown = {header.rpartition("/")[0] for header in headers} - FOLDERS.keys()
    if unknown:
        sys.exit(f"book_reference.py: no title for the folders {', '.join(sorted(unknown))}")
    out.mkdir(parents=True, exist_ok=True)
    entries = []
    for folder, title in FOLDERS.items():
        inside = [header for header in headers if header.rpartition("/")[0] == folder]
        entries.append(folder.replace("/", "_"))
        (out / f"{entries[-1]}.md").write_text(f"# {title}\n\n" + "".join(
            f"## {header}\n\n```{{doxygenfile}} {header}\n```\n\n" for header in inside))
    (out / "index.md").write_text(
        "# C++ reference\n\nFrom the public headers. [library.md](../library.md) says what to link.\n\n"
        "```{toctree}\n:maxdepth: 2\n\n" + "\n".join(entries) + "\n```\n")


if __name__ == "__main__":
    main()
