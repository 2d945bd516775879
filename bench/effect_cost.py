#!/usr/bin/env python3
"""What each effect costs, and that one that is off costs nothing: instructions under callgrind.

Counts the instructions of steps of the reduced model, with their derivatives (build/reduced_cost),
for a vehicle without any effect, with each, with all; and, for each, for all the others with
this one switched off against a vehicle that never had it (no parameter of it either). Exit status
0 if those two differ by at most 1 per cent, take the same motion, and switching each effect on
changes either.

  bench/effect_cost.py [build/reduced_cost] [--step]     needs valgrind
"""

import glob
import os
import re
import subprocess
import sys
import tempfile

EFFECTS = ["weight", "drag", "added_mass", "viscosity", "jet_thrust", "contained_water",
           "lateral_added_mass", "lateral_drag", "roll_drag", "rigid_drag"]
ALLOWED = 0.01  # of the instructions
STEPS = 8


def without(effect):
    """All effects but this one. Without viscosity the jet's law runs away at once: it goes too."""
    return "all,-viscosity,-jet_thrust" if effect == "viscosity" else f"all,-{effect}"


def alone(effect):
    """This effect alone, for the same reason beside viscosity."""
    return effect if effect == "viscosity" else f"viscosity,{effect}"


def count(program, what, cases):
    """Instructions per step, Newton iterations per step and the root's path for each case."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "callgrind")
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}",
             "--toggle-collect=mantle::reduced::TakeStep*", "--dump-after=*CostOf*",
             program, str(STEPS), what, *cases],
            capture_output=True, text=True)
        if run.returncode != 0:
            sys.exit(f"effect_cost: {run.stderr}")
        lines = [line.split() for line in run.stdout.splitlines()]
        files = sorted(glob.glob(out + ".*"), key=lambda f: int(f.rsplit(".", 1)[1]))
        if len(lines) != len(cases) or len(files) < len(cases):
            sys.exit(f"effect_cost: {len(files)} profiles of {len(cases)} cases")
        totals = []
        for name in files[:len(cases)]:
            with open(name, encoding="utf-8") as f:
                totals.append(int(re.search(r"^totals: (\d+)", f.read(), re.M)[1]))
    return {case: (total / STEPS, float(line[1]), line[2])
            for case, total, line in zip(cases, totals, lines)}


def main():
    arguments = [a for a in sys.argv[1:] if not a.startswith("--")]
    here = os.path.dirname(os.path.abspath(__file__))
    program = arguments[0] if arguments else os.path.join(here, "../build/reduced_cost")
    what = "step" if "--step" in sys.argv else "jacobians"
    cases = ["none", "none,never", "all"]
    for effect in EFFECTS:
        cases += [alone(effect), without(effect), without(effect) + ",never"]
    result = count(program, what, cases)

    failures = []

    def compare(off, never):
        (a, _, path), (b, _, other) = result[off], result[never]
        if abs(a - b) > ALLOWED * b:
            failures.append(f"{off}: {a:.0f} instructions, {b:.0f} where it never was")
        if path != other:
            failures.append(f"{off}: another motion than where it never was")
        return f"{100 * (a - b) / b:+.3f} %"

    title = "step with derivatives" if what == "jacobians" else "step"
    print(f"Instructions of a {title} (50 ms, mantle and one arm)\n")
    print("| effect | alone (beside viscosity) | Newton iterations | off, against a vehicle that never had it |")
    print("|---|---|---|---|")
    total, iterations, _ = result["none"]
    print(f"| none | {total:.0f} | {iterations:.1f} | {compare('none', 'none,never')} |")
    for effect in EFFECTS:
        cost, iterations, _ = result[alone(effect)]
        off = compare(without(effect), without(effect) + ",never")
        print(f"| {effect} | {cost:.0f} | {iterations:.1f} | {off} |")
        other = "none" if effect == "viscosity" else "viscosity"
        if result[alone(effect)] == result[other] and result["all"] == result[without(effect)]:
            failures.append(f"{effect}: switching it on changes nothing")
    total, iterations, _ = result["all"]
    print(f"| all | {total:.0f} | {iterations:.1f} | |")
    for failure in failures:
        print("FAILED:", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
