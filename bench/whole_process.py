#!/usr/bin/env python3
"""CPU time of whole processes, builds of the program side by side: medians over rounds in which every
build runs every case once, so that the machine's load falls on all alike.

  bench/whole_process.py --rounds 9 --build before=../before/mantle --build after=build/mantle \\
      'scenes/paper.toml' 'scenes/octopus.toml --set time.integrator="sdirk3"'
"""

import argparse
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
import tomllib


def cpu_time(program, case, folder):
    """User and system seconds of one run; fails where the run does."""
    pid = os.posix_spawn(
        program, [program, "run", *shlex.split(case), "--out", folder], os.environ,
        file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])
    _, status, usage = os.wait4(pid, 0)
    if status != 0:
        sys.exit(f"{program} run {case}: wait status {status}")
    return usage.ru_utime + usage.ru_stime


def simulated(case):
    """The scene's duration [s]."""
    with open(shlex.split(case)[0], "rb") as scene:
        return float(tomllib.load(scene)["time"]["duration"])


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--build", action="append", required=True, metavar="NAME=PROGRAM")
    parser.add_argument("case", nargs="+", help="arguments of `mantle run`, the scene first")
    options = parser.parse_args()
    builds = dict(item.split("=", 1) for item in options.build)
    times = {(case, name): [] for case in options.case for name in builds}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(options.rounds):
            for case in options.case:
                for name, program in builds.items():
                    times[case, name].append(cpu_time(program, case, os.path.join(folder, name)))
    for case in options.case:
        print(case)
        for name in builds:
            cpu = statistics.median(times[case, name])
            print(f"  {name:<10} {cpu:8.4f} s, {simulated(case) / cpu:7.1f} times real time")


if __name__ == "__main__":
    main()
