"""Plays poses through the package palpate: as client.c."""

import struct
import sys
import time

import palpate


def bits(xyz):
    return "".join(" %016x" % struct.unpack("<Q", struct.pack("<d", x)) for x in xyz)


def main():
    try:
        session = palpate.Session(sys.argv[1] if len(sys.argv) > 1 else "", palpate.Tool(radius=0.1, friction=0.3, coupling_stiffness=500.0))
    except palpate.Error as error:
        sys.exit(f"error: {error.reason}\nhint: {error.hint}")
    if len(sys.argv) > 2:
        session.record(sys.argv[2])
    number = {name: 1 << k for k in range(32) if (name := palpate.library.load().palpate_status_name(1 << k)) is not None}
    times = []
    for line in sys.stdin:
        *pose, grab = line.split()
        pose = [float(word) for word in pose]
        begin = time.perf_counter_ns()
        felt = session.step(pose[:3], pose[3:], grab != "0")
        touched = session.contacts()
        times.append(time.perf_counter_ns() - begin)
        print(str(sum(number[name.encode()] for name in felt.status)) + bits(felt.force) + bits(felt.torque) +
              bits([*touched.position.ravel(), 0, 0, 0][:3]) + bits([*touched.normal.ravel(), 0, 0, 0][:3]))
    if len(sys.argv) > 2:
        session.end_recording()
    times.sort()
    if times:
        print("#", times[len(times) // 2], times[(len(times) - 1) * 999 // 1000])


main()
