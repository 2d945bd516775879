#!/usr/bin/env python3
"""Holds the dependency direction of the folders and the rule that some libraries have one door."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# folder or file: folders and files it may include from; the longest that holds a file decides
MESSAGES = {"loop/messages.h", "loop/options.h", "loop/drive_options.h", "loop/sensor_channel.h"}
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
    # Two sides that know one another by messages alone.
    "loop/messages.h": {"reduced"},
    "loop/drive_options.h": MESSAGES,
    "loop/drive_options.cc": MESSAGES,
    "loop/sensor_channel.h": MESSAGES,
    "loop/sensor_channel.cc": MESSAGES,
    "loop/control_side": MESSAGES | FIRMWARE | {"firmware_sim/master", "controller", "reduced", "loop/control_side"},
    "loop/plant_side": MESSAGES
    | FIRMWARE
    | {"firmware_sim/drive", "model", "reduced", "controller/options.h", "loop/plant_side"},
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
    """A file and the folders that hold it, the innermost first."""
    return [name] + [folder.as_posix() for folder in pathlib.PurePosixPath(name).parents]


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
