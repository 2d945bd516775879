#!/usr/bin/env python3
"""hil_test.py MANTLE SCENES TYPES WORK CASE: plant and controller as programs of their own, in real time,
joined by multicast CAN and LCM on this machine alone; and what becomes of either where the other is killed.

Times are of a machine that may be busy: bounds are those of the claim and a second for the machine."""

import json
import os
import pathlib
import random
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time

MANTLE, SCENES, TYPES, WORK, CASE = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3], pathlib.Path(sys.argv[4]), sys.argv[5]
sys.path.insert(0, TYPES)
import mantle  # noqa: E402

MACHINE_S = 1.0  # what a busy machine may add
PORT = 20000 + os.getpid() % 20000
BUS = f"udp:239.74.163.2:{PORT}@lo"
LCM_GROUP = "239.255.76.67"
LCM = f"udpm://{LCM_GROUP}:{PORT}?ttl=0"
COARSE = ["--set", "mantle.elements=16", "--set", "arms.arm.elements=8"]


class Program:
    """One of the programs, with what it has said so far."""

    all = []

    def __init__(self, name, *arguments, duration=None):
        self.name = name
        words = [MANTLE, name, str(SCENES / "steer.toml"), "--bus", BUS, "--lcm", LCM, *COARSE, *arguments]
        if duration is not None:
            words += ["--set", f"time.duration={duration}"]
        self.log = WORK / f"{name}.{time.monotonic_ns()}.txt"
        self.file = open(self.log, "w")
        self.process = subprocess.Popen(words, cwd=WORK, stdout=self.file, stderr=subprocess.STDOUT)
        Program.all.append(self)

    def said(self):
        return self.log.read_text()

    def await_words(self, words, limit_s=30.0, after=0):
        """Seconds until it has said so, not counting its first `after` characters."""
        begin = time.monotonic()
        while words not in self.said()[after:]:
            assert time.monotonic() - begin < limit_s, f"{self.name} did not say '{words}':\n{self.said()}"
            assert self.process.poll() is None or words in self.said()[after:], f"{self.name} ended:\n{self.said()}"
            time.sleep(0.005)
        return time.monotonic() - begin

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def end(self, status=0, limit_s=60.0):
        try:
            ended = self.process.wait(limit_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self.name} did not end:\n{self.said()}") from None
        assert ended == status, f"{self.name}: status {ended}, must be {status}:\n{self.said()}"

    def interrupt(self, status=0):
        self.process.send_signal(signal.SIGINT)
        self.end(status)


class Listener:
    """Messages of one LCM channel."""

    def __init__(self, channel, kind):
        self.channel, self.kind = channel, kind
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self.socket.bind((LCM_GROUP, PORT))
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                               socket.inet_aton(LCM_GROUP) + socket.inet_aton("0.0.0.0"))

    def until(self, true_of, limit_s):
        """Seconds until a message is so; none where none is."""
        begin = time.monotonic()
        while time.monotonic() - begin < limit_s:
            self.socket.settimeout(max(0.01, limit_s - (time.monotonic() - begin)))
            try:
                data = self.socket.recv(65536)
            except TimeoutError:
                break
            if struct.unpack_from(">I", data)[0] != 0x4C433032:
                continue
            name, message = data[8:].split(b"\0", 1)
            if name.decode() == self.channel and true_of(self.kind.decode(message)):
                return time.monotonic() - begin
        return None


def check_run():
    """Either may start first; both ends tell the same run."""
    control = Program("control", "--out", "out", duration=2)
    plant = Program("plant", "--out", "out", "--fresh")
    plant.await_words("goes at t = 0.000 s")
    control.end()
    plant.interrupt()
    told = json.loads((WORK / "out/control.json").read_text())
    lived = json.loads((WORK / "out/plant.json").read_text())
    fast = told["real_time"]
    assert told["complete"] and told["time_s"] > 1.98, told
    assert fast["cycles"] + fast["missed_cycles"] >= 199, fast
    assert fast["sync_lateness"]["count"] == fast["cycles"], fast
    assert told["plans"] + fast["overtaken_plans"] >= 39, told
    assert told["foreign_frames"] == 0 and lived["foreign_frames"] == 0, (told, lived)
    assert lived["error"]["max"] < 0.2, lived["error"]
    assert not (WORK / "out/checkpoint").exists(), "a run that ended is not gone on with"


def check_follow():
    """A controller in Python."""
    plant = Program("plant", "--out", "out", "--fresh")
    control = Program("control", "--follow", "--out", "out", duration=2)
    states = Listener("MANTLE_STATE", mantle.state_t)
    control.await_words("running")
    idle = states.until(lambda m: max(m.cable_tension) > 0.2, 0.5)
    assert idle is None, "nobody commands anything"
    own = subprocess.Popen([sys.executable, str(SCENES.parent / "examples/follow.py"), TYPES, f"{LCM_GROUP}:{PORT}"])
    try:
        assert states.until(lambda m: max(m.cable_tension) > 0.3, 1.0 + MACHINE_S) is not None, control.said()
    finally:
        own.kill()
        own.wait()
    assert states.until(lambda m: max(m.cable_tension) < 0.1, 0.6 + MACHINE_S) is not None, "it is let go"
    control.interrupt(3)
    plant.interrupt()


def check_control_killed():
    """The drives' watchdog lets the cables go; a second controller takes them over."""
    plant = Program("plant", "--out", "out", "--fresh")
    control = Program("control", duration=60)
    states = Listener("MANTLE_STATE", mantle.state_t)
    control.await_words("running")
    for _ in range(2):
        time.sleep(0.3 + random.random())
        control.kill()
        # 100 ms of 1400:5, a period, the ramp of 6087, 150 ms to slack; samples are 50 ms apart.
        slack = states.until(lambda m: max(m.cable_tension) < 1e-3, 0.5 + MACHINE_S)
        assert slack is not None, "cables stay taut without a controller"
        print(f"slack {slack:.3f} s after the controller was killed")
        control = Program("control", duration=60)
        control.await_words("running")
        assert states.until(lambda m: max(m.cable_tension) > 0.05, 2.0 + MACHINE_S) is not None, control.said()
    control.interrupt(3)
    plant.interrupt()


def check_plant_killed():
    """The controller notices, commands nothing, and goes on with the plant that comes back."""
    plant = Program("plant", "--out", "out", "--fresh")
    control = Program("control", "--out", "out", duration=6)
    control.await_words("running")
    for _ in range(2):
        time.sleep(0.8 + 0.3 * random.random())
        said = len(control.said())
        plant.kill()
        lost = control.await_words("vehicle lost", 0.2 + MACHINE_S, after=said)
        print(f"noticed {lost:.3f} s after the plant was killed")
        plant = Program("plant", "--out", "out")
        plant.await_words("goes on from t = ")
        control.await_words("running", after=said)
        plant.await_words("goes at t = ")
    control.end()
    plant.interrupt()
    fresh = Program("plant", "--out", "out", "--fresh")
    fresh.await_words("held at t = 0.000 s")
    fresh.interrupt()


def check_hil():
    """Both and a recorder."""
    done = subprocess.run([MANTLE, "hil", str(SCENES / "steer.toml"), "--bus", BUS, "--lcm", LCM, *COARSE,
                           "--set", "time.duration=1", "--out", "hil"], cwd=WORK, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json.loads((WORK / "hil/summary.json").read_text())
    assert summary["complete"] and summary["control"]["complete"], summary
    assert summary["frames"] > 1000, summary["frames"]
    assert sum(1 for _ in open(WORK / "hil/bus.log")) == summary["frames"]
    log = subprocess.run([MANTLE, "log", "hil/telemetry.lcmlog"], cwd=WORK, capture_output=True, text=True)
    assert log.returncode == 0 and "MANTLE_SENSORS" in log.stdout and "MANTLE_PLAN" in log.stdout, log.stdout + log.stderr


def check_lockstep():
    """Frames of two programs in lock-step are those of one, to the last bit."""
    words = ["--set", "time.duration=1"]
    one = subprocess.run([MANTLE, "run", str(SCENES / "steer.toml"), *COARSE, *words, "--record", "one.log", "--out", "one"],
                         cwd=WORK, capture_output=True, text=True, timeout=100)
    assert one.returncode == 0, one.stderr
    plant = Program("plant", "--lockstep", "--out", "out", duration=1)
    control = Program("control", "--lockstep", "--record", "two.log", "--out", "out", duration=1)
    control.end()
    plant.end()
    ours, theirs = (WORK / "one.log").read_bytes(), (WORK / "two.log").read_bytes()
    assert len(ours) > 10_000 and ours == theirs, f"{len(ours)} and {len(theirs)} bytes"
    # A stranger's frame ends the run.
    plant = Program("plant", "--lockstep", "--out", "out", duration=5)
    control = Program("control", "--lockstep", "--out", "out", duration=5)
    time.sleep(1.0)
    second = Program("control", "--out", "other", "--wait", "1", duration=1)
    second.process.wait(60)
    control.end(3)
    assert "foreign" in control.said() + plant.said(), control.said() + plant.said()


def main():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    route = subprocess.run(["ip", "route", "get", LCM_GROUP], capture_output=True)
    if route.returncode != 0:
        print("this machine has no route for multicast (ip route add 224.0.0.0/4 dev lo)")
        sys.exit(77)
    seed = int(time.time())
    random.seed(seed)
    print(f"seed {seed}")
    try:
        {"run": check_run, "follow": check_follow, "control_killed": check_control_killed,
         "plant_killed": check_plant_killed, "hil": check_hil, "lockstep": check_lockstep}[CASE]()
    finally:
        for program in Program.all:
            program.process.kill()
            program.process.wait()


main()
