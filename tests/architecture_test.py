#!/usr/bin/env python3
"""Holds the dependency direction of the folders and the rule that some libraries have one door."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# folder: folders it may include from; the longest folder that holds a file decides
FIRMWARE = {"firmware_sim/bus", "firmware_sim/canopen"}
MAY_USE = {
    "model": {"model"},
    "reduced": {"model", "reduced"},
    "controller": {"model", "reduced", "controller"},
    "firmware_sim/bus": {"firmware_sim/bus"},
    "firmware_sim/canopen": FIRMWARE,
    "firmware_sim/drive": FIRMWARE | {"firmware_sim/drive"},
    "firmware_sim/master": FIRMWARE | {"firmware_sim/master"},
    "loop": {"model", "reduced", "controller", "firmware_sim", "loop"},
    "loop/scene": {"model", "reduced", "controller", "loop"},
}
# header pattern: the only files that may include it
ONE_DOOR = {
    r"toml\+\+": {"loop/scene/toml_document.cc"},
    r"cvode/": {"model/cvode_stepper.cc"},
    r"IpIpopt|coin/": {"controller/ipopt_solver.cc"},
    r"lcm/|mantle/\w+_t\.hpp": {"tools/mantle/lcm_bridge.cc"},
    r"nlopt": {"tools/studies/search.cc"},
    r"linux/can": {"firmware_sim/bus/socket_can_bus.cc"},
}


def folders_of(name):
    """The folders that hold a file, the innermost first."""
    return [folder.as_posix() for folder in pathlib.PurePosixPath(name).parents]


def main():
    problems = []
    for folder in ("model", "reduced", "controller", "firmware_sim", "loop", "tools", "tests", "bench"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in (".h", ".cc"):
                continue
            name = path.relative_to(ROOT).as_posix()
            may_use = next((MAY_USE[up] for up in folders_of(name) if up in MAY_USE), None)
            for line in path.read_text().splitlines():
                match = re.match(r'\s*#include\s+[<"]([^">]+)[">]', line)
                if not match:
                    continue
                header = match.group(1)
                ours = (ROOT / header).exists()
                if ours and may_use is not None and may_use.isdisjoint(folders_of(header)):
                    problems.append(f"{name} includes {header}: it may use {sorted(may_use)}")
                if folder == "tests":
                    continue
                for pattern, doors in ONE_DOOR.items():
                    if re.match(pattern, header) and name not in doors:
                        problems.append(f"{name} includes {header}: only {sorted(doors)} may")
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
