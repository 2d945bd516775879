"""The other end of python_can_test.cc: python-can's udp_multicast bus.

python_can_peer.py PORT: sends one frame of every kind, answers each frame that it gets with the same
data under id + 1, and prints what it got, a line each: id extended remote dlc data. An id of 7FF
ends it.
"""

import sys

import can

KINDS = [
    can.Message(arbitration_id=0x181, is_extended_id=False, data=[0x37, 0x12, 1, 2, 3, 4, 5, 6]),
    can.Message(arbitration_id=0x080, is_extended_id=False, data=[]),
    can.Message(arbitration_id=0x1ABCDEF, is_extended_id=True, data=[9]),
    can.Message(arbitration_id=0x701, is_extended_id=False, is_remote_frame=True, dlc=1),
]


def main():
    bus = can.Bus(interface="udp_multicast", channel="239.74.163.2", port=int(sys.argv[1]))
    for message in KINDS:
        bus.send(message)
    own = {message.arbitration_id for message in KINDS}
    while True:
        message = bus.recv(timeout=10)
        if message is None:
            sys.exit("no frame for 10 s")
        if message.arbitration_id == 0x7FF:
            break
        if message.arbitration_id in own:  # python-can hears itself
            continue
        print(
            f"{message.arbitration_id:X} {int(message.is_extended_id)} "
            f"{int(message.is_remote_frame)} {message.dlc} {bytes(message.data).hex()}",
            flush=True,
        )
        if not message.is_remote_frame:
            reply_id = message.arbitration_id + 1
            own.add(reply_id)
            bus.send(
                can.Message(
                    arbitration_id=reply_id,
                    is_extended_id=message.is_extended_id,
                    data=message.data,
                )
            )
    bus.shutdown()


main()
