#!/usr/bin/env python3
"""Holds the dependency direction of the folders and the rule that some libraries have one door."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# folder: folders it may include from
MAY_USE = {
    "model": {"model"},
    "reduced": {"model", "reduced"},
    "controller": {"model", "reduced", "controller"},
    "firmware_sim": {"firmware_sim"},
}
# header pattern: the only files that may include it
ONE_DOOR = {
    r"toml\+\+": {"model/toml_document.cc"},
    r"cvode/": {"model/cvode_stepper.cc"},
    r"IpIpopt|coin/": {"controller/ipopt_solver.cc"},
    r"lcm/|mantle/\w+_t\.hpp": {"tools/mantle/lcm_bridge.cc"},
    r"nlopt": {"tools/mantle/search.cc"},
    r"linux/can": {"firmware_sim/socket_can_bus.cc"},
}


def main():
    problems = []
    for folder in ("model", "reduced", "controller", "firmware_sim", "tools", "tests", "bench"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in (".h", ".cc"):
                continue
            name = path.relative_to(ROOT).as_posix()
            for line in path.read_text().splitlines():
                match = re.match(r'\s*#include\s+[<"]([^">]+)[">]', line)
                if not match:
                    continue
                header = match.group(1)
                top = header.split("/")[0]
                if folder in MAY_USE and top in (*MAY_USE, "tools", "tests") and (
                    top not in MAY_USE[folder]
                ):
                    problems.append(f"{name} includes {header}: {folder} may not use {top}")
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
