#!/usr/bin/env python3
"""commands_test.py MANTLE WORK: runs every command of the README and of the pages under docs/, as they stand
there, in a scratch folder each page. Exit status 0 is demanded of all but those of SKIPPED, and every entry
there must still be needed. Long runs are cut by a rule (`program`), so that the whole takes some seconds."""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

from markdown_pages import ROOT, commands, file_of, is_typed, name, pages, split

LIMIT_S = 120  # one command; the slowest takes some seconds on an idle machine

# What is not run, and why: (command, reason).
SKIPPED = [
    (r"^tools/(build|demo|test)\b", "builds; CI begins with it"),
    (r"^(cmake|build-example/)", "builds; the test `install` builds and runs the examples"),
    (r"^tools/vcan_run\b", "starts a kernel where this one has no vcan; the tests labelled vcan use it"),
    (r"\bvcan0\b", "wants a SocketCAN interface; the tests labelled vcan have one"),
    (r"^mantle report results/steer\.partial", "of a run that was stopped; tools.command_report reads one"),
    (r"^lcm-logger\b", "records until Ctrl-C"),
    (r"^(sudo apt|javac|java|.*--format mp4)\b", "wants programs that tools/setup does not install"),
    (r"^(build/mantle run.*control\.grid\.steps=200|tail -1 results/foresight)", "takes minutes: a plan of 10 s to convergence"),
    (r"^(mantle study (accuracy|effects)|tools/plot results/price)\b", "half a minute; tools.study_accuracy and study_effects run them"),
    (r"^(mantle (plant|control)|kill|sleep|python3 examples/follow.py)\b|--follow\b",
     "programs beside one another, one of them killed; the tests tools.hil_* run and kill them"),
    (r"^mantle live\b", "a server that runs until it is stopped; the test tools.command_live runs one"),
]
# Pages whose absence makes an entry idle.
SKIPPED_FOR = {
    r"^mantle live\b": "docs/live.md",
    r"^(mantle study (accuracy|effects)|tools/plot results/price)\b": "docs/price.md",
}

# What a page takes for granted.
BEFORE = {
    "docs/report.md": [
        "mantle run scenes/reach.toml --out results/mpc",
        "mantle run scenes/reach.toml --controller pid --out results/pid",
    ],
    "docs/telemetry.md": ["mantle run scenes/steer.toml --out results"],
    "docs/tutorials/closed_loop.md": ["cp $PAGES/my_robot.toml ."],
}


def program(mantle):
    """The program as the pages call it, cut short: 0.2 s of simulated time where a command does not say how
    much, three runs of a search, a third of a second on a bus."""
    return f"""#!/usr/bin/env bash
given=" $* "
case "$1" in
  run | compare | tune | study | hil) [[ $given == *time.duration=* || $given == *--help* ]] || set -- "$@" --set time.duration=0.2 ;;
esac
case "$1 ${{2-}}" in
  tune*) set -- "$@" --evaluations 3 ;;
  "control "*) [[ $given == *time.duration=* || $given == *--help* ]] || set -- "$@" --set time.duration=2 ;;
  "plant "*) [[ $given == *--duration* ]] || set -- "$@" --duration 60 ;;
  drives* | "bus monitor") [[ $given == *--duration* || $given == *--eds* ]] || set -- "$@" --duration 0.3 ;;
esac
exec {mantle} "$@"
"""


def scratch(work, mantle):
    """A folder that looks like the repository after a build."""
    if work.exists():
        shutil.rmtree(work)
    (work / "build").mkdir(parents=True)
    for part in ("scenes", "tools", "examples", "lcm_types", "docs"):
        (work / part).symlink_to(ROOT / part)
    (work / "build/mantle").write_text(program(mantle))
    (work / "build/mantle").chmod(0o755)
    for part in ("lcm_types", "python"):
        if (mantle.parent / part).exists():
            (work / "build" / part).symlink_to(mantle.parent / part)


def run(script, folder, environment):
    """Exit status and output of a script; whatever it leaves running is stopped."""
    process = subprocess.Popen(["bash", "-e", "-o", "pipefail", "-c", script], cwd=folder, env=environment, text=True,
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               start_new_session=True)
    try:
        output, _ = process.communicate(timeout=LIMIT_S)
        status = process.returncode
    except subprocess.TimeoutExpired:
        status, output = "none: it does not end", ""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    return status, output


def own_network(arguments):
    """Goes on in a network namespace, where multicast has a route and no other program listens."""
    inner = 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"'
    enter = ["unshare", "-rn", "bash", "-c", inner, "bash"]
    if os.environ.get("MANTLE_OWN_NETWORK") or subprocess.run([*enter, "true"], capture_output=True).returncode != 0:
        return
    os.environ["MANTLE_OWN_NETWORK"] = "1"
    os.execvp("unshare", [*enter, sys.executable, *arguments])


def main():
    own_network(sys.argv)
    mantle, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    only = sys.argv[3:]
    multicast = subprocess.run(["ip", "route", "get", "239.74.163.2"], capture_output=True).returncode == 0
    no_page = (mantle.parent / "report/report.missing").exists()  # npm had no network; the build says so
    no_module = not any((mantle.parent / "python/mantle").glob("_mantle.*.so"))  # built without pybind11, which it says
    used, problems, ran, skipped = set(), [], 0, 0
    saved = work / "saved"
    shutil.rmtree(work, ignore_errors=True)
    saved.mkdir(parents=True)
    blocks = {page: split(page.read_text())[0] for page in pages()}
    for file in filter(None, (file_of(block) for page in blocks.values() for block in page)):
        (saved / file[0]).write_text(file[1])
    times = []
    for page, found in blocks.items():
        if only and name(page) not in only:
            continue
        folder = work / name(page).replace("/", "_").removesuffix(".md")
        scratch(folder, mantle)
        (folder / "bin").mkdir()
        (folder / "bin/python3").symlink_to("/usr/bin/python3")  # the distribution's, which has its packages
        environment = dict(os.environ, PATH=f"{folder}/bin:{folder}/build:{os.environ['PATH']}", PAGES=str(saved),
                           MPLBACKEND="agg", PYTHONPATH=f"{folder}/build/python",  # as a page has it exported
                           PYTHONDONTWRITEBYTECODE="1")
        for command in BEFORE.get(name(page), []):
            status, output = run(command, folder, environment)
            if status != 0:
                problems.append(f"before {name(page)}: {command}: exit status {status}\n{output}")
        for block in found:
            if file := file_of(block):
                (folder / file[0]).write_text(file[1])
            if not is_typed(block):
                continue
            script = []
            for line, command in commands(block):
                skip = next((pattern for pattern, _ in SKIPPED if re.search(pattern, command)), None)
                used.add(skip)
                if no_module and name(page) == "docs/tutorials/own_controller_in_python.md":
                    skip = skip or "no module for Python"
                if skip or (re.search(r"udp:|mantle (hil|plant|control)|follow.py", command) and not multicast) or (no_page and re.search(r"mantle report|--report", command)):
                    skipped += 1
                    continue
                script.append((line, command))
            if not script:
                continue
            # One shell for a block, that says which command it is at.
            text = "".join(f"echo '@ {line}'\n{command}" for line, command in script)
            begin = time.monotonic()
            status, output = run(text, folder, environment)
            times.append((time.monotonic() - begin, f"{name(page)}:{block.line}"))
            ran += len(script)
            if status != 0:
                reached = re.findall(r"^@ (\d+)$", output, re.M)
                problems.append(f"{name(page)}:{reached[-1] if reached else block.line}: exit status {status}\n{output[-2000:]}")
    for pattern, reason in SKIPPED:
        if not only and pattern not in used and (ROOT / SKIPPED_FOR.get(pattern, "README.md")).exists():
            problems.append(f"SKIPPED holds {pattern!r} ({reason}), which no page has")
    print("\n".join(problems))
    for seconds, where in sorted(times, reverse=True)[:8]:
        print(f"{seconds:6.1f} s  {where}")
    print(f"{ran} commands run, {skipped} skipped, {sum(seconds for seconds, _ in times):.1f} s")
    return 1 if problems or (ran < 50 and not only) else 0


if __name__ == "__main__":
    sys.exit(main())
