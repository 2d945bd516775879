"""The shipped EDS as a configuration tool reads it (CiA 306), with Python's configparser.

Usage: eds_test.py EDS_FILE
"""

import configparser
import re
import sys

TYPES = {0x02: 8, 0x03: 16, 0x04: 32, 0x05: 8, 0x06: 16, 0x07: 32, 0x09: 32}
SIGNED = {0x02, 0x03, 0x04}
# Every index of canopen-profile.md.
PROFILE = [
    0x1000, 0x1001, 0x1003, 0x1005, 0x1008, 0x1014, 0x1016, 0x1017, 0x1018, 0x1029,
    0x1400, 0x1401, 0x1600, 0x1601, 0x1800, 0x1801, 0x1A00, 0x1A01,
    0x6007, 0x603F, 0x6040, 0x6041, 0x605A, 0x605D, 0x605E, 0x6060, 0x6061, 0x6064, 0x6065,
    0x606C, 0x6071, 0x6072, 0x6075, 0x6076, 0x6077, 0x6078, 0x607A, 0x607D, 0x6084, 0x6085,
    0x6087, 0x60B2, 0x60C2, 0x60FF, 0x6502, 0x608F, 0x6091, 0x6092, 0x2200,
]


def value(text, node=5):
    text = text.strip()
    if text.startswith("$NODEID+"):
        return node + int(text[len("$NODEID+"):], 0)
    return int(text, 0)


def check_entry(eds, section):
    entry = eds[section]
    data_type = int(entry["DataType"], 16)
    assert data_type in TYPES, (section, data_type)
    assert int(entry["ObjectType"], 16) == 7, section
    assert entry["AccessType"] in ("ro", "wo", "rw", "rww", "const"), section
    assert entry["PDOMapping"] in ("0", "1"), section
    assert entry["ParameterName"], section
    if data_type == 0x09:
        return
    bits = TYPES[data_type]
    low, high = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if data_type in SIGNED else (0, (1 << bits) - 1)
    low = value(entry["LowLimit"]) if "LowLimit" in entry else low
    high = value(entry["HighLimit"]) if "HighLimit" in entry else high
    assert low <= value(entry["DefaultValue"]) <= high, section


def main():
    eds = configparser.RawConfigParser()
    eds.optionxform = str
    with open(sys.argv[1], encoding="ascii") as file:
        eds.read_file(file)
    assert eds["DeviceInfo"]["BaudRate_1000"] == "1"
    assert eds["DeviceInfo"]["NrOfRXPDO"] == "2" and eds["DeviceInfo"]["NrOfTXPDO"] == "2"

    listed = []
    for name in ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"):
        count = int(eds[name]["SupportedObjects"])
        assert len(eds[name]) == count + 1, name
        listed += [int(eds[name][str(i)], 16) for i in range(1, count + 1)]
    assert len(listed) == len(set(listed)), "an object listed twice"
    assert {0x1000, 0x1001, 0x1018} <= set(listed)
    missing = set(PROFILE) - set(listed)
    assert not missing, f"profile objects missing: {[hex(i) for i in missing]}"

    sections = {s for s in eds.sections() if re.fullmatch("[0-9A-F]{4}(sub[0-9A-F]+)?", s)}
    expected = set()
    for index in listed:
        section = f"{index:04X}"
        expected.add(section)
        if "SubNumber" not in eds[section]:
            check_entry(eds, section)
            continue
        subs = sorted(s for s in sections if s.startswith(section + "sub"))
        assert len(subs) == int(eds[section]["SubNumber"]), section
        for sub in subs:
            check_entry(eds, sub)
        expected.update(subs)
    assert sections == expected, sections ^ expected

    # What a master reads from it to address the PDOs of node 5.
    assert value(eds["1400sub1"]["DefaultValue"]) == 0x205
    assert value(eds["1801sub1"]["DefaultValue"]) == 0x40000285  # no RTR
    assert value(eds["1A00sub1"]["DefaultValue"]) == 0x60410010
    print(f"{len(listed)} objects, {len(sections)} sections")


main()
