"""A log of our writer, decoded with the Python types that lcm-gen makes from lcm_types/.

Usage: lcm_log_test.py WRITER TYPES_DIR TELEMETRY_PAGE

The container is read here, by its definition (tools/mantle/lcm_bridge.h). Leaf n of sample k has
the value that telemetry_samples.h gives it. The page names every channel and field.
"""

import re
import struct
import subprocess
import sys
import tempfile

SAMPLES = 7
SAMPLE_PERIOD_US = 10_000
SYNC_WORD = 0xEDA1DA01
COUNTS = {
    "num_arms": 8, "num_cables": 33, "num_motors": 16, "num_drives": 16, "num_knots": 21,
    "num_q": 99, "num_v": 105, "num_works": 60,
    "num_nodes": 88, "num_spans": 80, "num_mantle_nodes": 33, "num_mantle_spans": 32,
    "num_rigid_points": 3, "num_cable_points": 368, "num_errors": 210, "num_deviations": 210, "num_waypoints": 5, "num_bins": 82,
}


def events(path):
    """Event number, time in us, channel and message of every event of a log."""
    with open(path, "rb") as log:
        while header := log.read(28):
            sync, number, time_us, name_size, size = struct.unpack(">IqqII", header)
            assert sync == SYNC_WORD, hex(sync)
            name, message = log.read(name_size), log.read(size)
            assert len(message) == size
            yield number, time_us, name.decode("ascii"), message


def leaves(value):
    if isinstance(value, (list, tuple)):
        for entry in value:
            yield from leaves(entry)
    else:
        yield value


def expected(leaf, k, n):
    if isinstance(leaf, str):
        return f"{k}.{n}"
    return k + n / 8 if isinstance(leaf, float) else (k + n) % 100


def check(message, k):
    """Every field has the values of sample k; returns how many leaves there were."""
    n = 0
    for field in message.__slots__:
        value = getattr(message, field)
        if field.startswith("num_"):
            assert value == COUNTS[field], (field, value)
            continue
        for leaf in leaves(value):
            if field == "utime":
                assert leaf == k * SAMPLE_PERIOD_US, leaf
            else:
                assert leaf == expected(leaf, k, n), (field, n, leaf)
            n += 1
    return n


def main():
    writer, types_dir, page = sys.argv[1:]
    sys.path.insert(0, types_dir)
    import mantle

    types = {
        "MANTLE_STATE": mantle.state_t, "MANTLE_REDUCED_STATE": mantle.reduced_state_t,
        "MANTLE_PLAN": mantle.plan_t, "MANTLE_DRIVES": mantle.drives_t,
        "MANTLE_ENERGY": mantle.energy_t, "MANTLE_STATUS": mantle.status_t,
        "MANTLE_SHAPE": mantle.shape_t,
        "MANTLE_CONTROL": mantle.control_t,
        "MANTLE_WATER": mantle.water_t,
        "MANTLE_SESSION": mantle.session_t,
    }
    leaves_of = {}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([writer, folder, str(SAMPLES)], check=True)
        count = 0
        for number, time_us, channel, data in events(folder + "/telemetry.lcmlog"):
            message = types[channel].decode(data)
            assert number == count and time_us == message.utime, (number, time_us)
            assert message.encode() == data, channel
            leaves_of[channel] = check(message, count // len(types))
            count += 1
    assert count == SAMPLES * len(types), count
    assert leaves_of["MANTLE_PLAN"] == 1 + 21 * (1 + 16 + 3 + 8 * 3) + 3, leaves_of
    assert leaves_of["MANTLE_DRIVES"] == 1 + 11 * 16, leaves_of
    with open(page, encoding="utf-8") as file:
        told = set(re.findall("`([^`]*)`", file.read()))
    for channel, kind in types.items():
        untold = {channel, kind.__name__, *kind.__slots__} - told
        assert not untold, f"{page} does not tell of {untold}"
    print(f"{count} messages, leaves of each: {leaves_of}")


main()
