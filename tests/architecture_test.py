#!/usr/bin/env python3
"""Holds the dependency direction of the folders and of the targets, and the rule that some libraries
have one door."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# folder or file: folders and files it may include from; the longest that holds a file decides
MESSAGES = {"loop/messages.h", "loop/options.h", "loop/drive_options.h", "loop/sensor_channel.h",
            "loop/timing.h", "loop/vehicle_side.h", "firmware_sim/bus/spsc_ring.h"}
FIRMWARE = {"firmware_sim/bus", "firmware_sim/canopen"}
MAY_USE = {
    "model": {"model"},
    "reduced": {"model", "reduced"},
    "reduced/build": {"model", "reduced", "reduced/build"},
    "controller": {"model", "reduced", "controller"},
    "firmware_sim/bus": {"firmware_sim/bus"},
    "firmware_sim/canopen": FIRMWARE,
    "firmware_sim/drive": FIRMWARE | {"firmware_sim/drive"},
    "firmware_sim/master": FIRMWARE | {"firmware_sim/master"},
    "loop": {"model", "reduced", "controller", "firmware_sim", "loop"},
    # Two sides that know one another by messages alone.
    "loop/messages.h": {"reduced"},
    "loop/vehicle_side.h": MESSAGES,
    "loop/vehicle_side.cc": MESSAGES | {"model/named_types.h"},
    "loop/drive_options.h": MESSAGES,
    "loop/drive_options.cc": MESSAGES,
    "loop/sensor_channel.h": MESSAGES,
    "loop/sensor_channel.cc": MESSAGES,
    "loop/timing.h": set(),
    "loop/timing.cc": {"loop/timing.h", "firmware_sim/bus/socket_time.h"},
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
    r"httplib": {"tools/live/live_server.cc"},
    r"pybind11/": {"cmake/precompiled/python.h"},
    r"linux/can": {"firmware_sim/bus/socket_can_bus.cc"},
}
# what runs without a plant: neither these folders (their subfolders apart) nor what the target
# mantle_mechanics is made of may include a header of the target mantle_model or of reduced/build
WITHOUT_PLANT = {"reduced", "controller", "loop/control_side"}
# library: the only targets that may link it themselves
MAY_LINK = {
    r"SUNDIALS::": {"model"},
    r"tomlplusplus::": {"scene"},
    r"pybind11::": {"python"},
    r"PkgConfig::IPOPT": {"ipopt"},
    r"PkgConfig::NLOPT": {"tuning"},
    r"LCM::": {"lcm_types"},
    r"fmt::": {"mechanics", "model", "bus", "telemetry", "tuning", "python"},
}
# target: Mantle's own targets that it may reach, directly or through others
MAY_REACH = {
    "mechanics": set(),
    "model": {"mechanics"},
    "reduced": {"mechanics"},
    "reduced_build": {"mechanics", "model", "reduced"},
    "controller": {"mechanics", "reduced"},
    "bus": set(),
    "canopen": {"bus"},
    "drive": {"bus", "canopen"},
    "master": {"bus", "canopen"},
    "loop_messages": {"mechanics", "reduced"},
    "control_side": {"mechanics", "reduced", "controller", "bus", "canopen", "master", "loop_messages"},
    "plant_side": {"mechanics", "model", "reduced", "reduced_build", "bus", "canopen", "drive", "loop_messages"},
}


def folders_of(name):
    """A file and the folders that hold it, the innermost first."""
    return [name] + [folder.as_posix() for folder in pathlib.PurePosixPath(name).parents]


def read_targets():
    """Of every CMakeLists.txt but the tests': target -> what it links, target -> its sources."""
    links, sources = {}, {}
    for path in sorted(ROOT.rglob("CMakeLists.txt")):
        folder = path.relative_to(ROOT).parent
        if folder.parts and folder.parts[0] in ("build", "tests", "bench") or "build-" in str(folder):
            continue
        text = re.sub(r"#[^\n]*", "", path.read_text())
        for command, body in re.findall(r"(mantle_library|target_link_libraries)\s*\(([^()]*)\)", text):
            name, *words = body.split()
            name = name.removeprefix("mantle_")
            keyword = "SOURCES" if command == "mantle_library" else "PUBLIC"
            for word in words:
                if word in ("SOURCES", "HEADERS", "FOLDER", "PUBLIC", "PRIVATE", "INTERFACE"):
                    keyword = word
                elif keyword == "SOURCES":
                    sources.setdefault(name, set()).add((folder / word).as_posix())
                elif keyword in ("PUBLIC", "PRIVATE", "INTERFACE"):
                    links.setdefault(name, set()).add(word)
    return links, sources


def reached(links, target, seen):
    for word in links.get(target, ()):
        if word.startswith("mantle::") and word[8:] not in seen:
            seen.add(word[8:])
            reached(links, word[8:], seen)
    return seen


def check_targets(links):
    for target, words in links.items():
        for pattern, targets in MAY_LINK.items():
            for word in words:
                if re.match(pattern, word) and target not in targets:
                    yield f"target {target} links {word}: only {sorted(targets)} may"
    for target, may in MAY_REACH.items():
        if target not in links:
            yield f"target {target}: there is none"
        for other in reached(links, target, set()) - may:
            yield f"target {target} reaches {other}: it may reach {sorted(may)}"


def main():
    links, sources = read_targets()
    problems = list(check_targets(links))
    plant = {name.removesuffix(".cc") + ".h" for name in sources["model"]}
    mechanics = sources["mechanics"] | {n.removesuffix(".cc") + ".h" for n in sources["mechanics"]}
    for folder in ("model", "reduced", "controller", "firmware_sim", "loop", "tools", "python", "tests", "bench"):
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
                without_plant = folders_of(name)[1] in WITHOUT_PLANT or name in mechanics | MESSAGES
                if without_plant and (header in plant or header.startswith("reduced/build/")):
                    problems.append(f"{name} includes {header}: it must run without a plant")
                if ours and may_use is not None and may_use.isdisjoint(folders_of(header)):
                    problems.append(f"{name} includes {header}: it may use {sorted(may_use)}")
                if folder == "tests":
                    continue
                if folder == "python" and header.startswith("pybind11/"):
                    continue
                for pattern, doors in ONE_DOOR.items():
                    if re.match(pattern, header) and name not in doors:
                        problems.append(f"{name} includes {header}: only {sorted(doors)} may")
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
