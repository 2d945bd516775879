#!/usr/bin/env python3
"""follow.py [TYPES [GROUP:PORT]]: a controller of one's own, in any language that has a socket.

Beside it:  mantle hil scenes/steer.toml --follow
It hears the vehicle's instruments (MANTLE_SENSORS) and says what the motors shall pull
(MANTLE_COMMAND): here a pulse of the mantle, and the arm's cables so that the heading comes back.
TYPES is the folder of the generated classes (build/lcm_types/python)."""

import math
import socket
import struct
import sys

sys.path.insert(0, sys.argv[1] if len(sys.argv) > 1 else "build/lcm_types/python")
import mantle  # noqa: E402

group, port = (sys.argv[2] if len(sys.argv) > 2 else "239.255.76.67:7667").split(":")
SHORT = 0x4C433032  # LCM's message that fits into a datagram
PERIOD_S, TIME_OUT_S, GAIN_N = 0.8, 0.1, 0.5

receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
receiver.bind((group, int(port)))
receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                    socket.inet_aton(group) + socket.inet_aton("0.0.0.0"))
sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)


def messages(channel):
    while True:
        data = receiver.recv(65536)
        if len(data) > 8 and struct.unpack_from(">I", data)[0] == SHORT:
            name, message = data[8:].split(b"\0", 1)
            if name.decode() == channel:
                yield message


def tensions(sensors, count):
    """The mantle's, and four cables of an arm, at 0, 90, 180 and 270 degrees."""
    w, x, y, z = sensors.root_quaternion
    heading = 2 * (x * z + w * y), 2 * (y * z - w * x)  # e3 of the root, off the z axis
    pull = [max(0.0, GAIN_N * value) for value in (-heading[0], -heading[1], heading[0], heading[1])]
    pulse = 0.3 + 0.3 * math.sin(2 * math.pi * sensors.time / PERIOD_S)
    return ([pulse] + pull + [0.0] * count)[:count]


for number, data in enumerate(messages("MANTLE_SENSORS")):
    heard = mantle.sensors_t.decode(data)
    command = mantle.command_t()
    command.utime, command.time_out = heard.utime, TIME_OUT_S
    command.tension = tensions(heard, heard.num_cables)
    command.num_motors = heard.num_cables
    sender.sendto(struct.pack(">II", SHORT, number) + b"MANTLE_COMMAND\0" + command.encode(), (group, int(port)))
