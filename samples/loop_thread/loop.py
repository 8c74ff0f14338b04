"""A thread steps the body a thousand times a second while the program goes on."""
import time

import numpy
import palpate

with palpate.Session("block.palpate.hdf", palpate.Tool(radius=0.01), max_contacts=256, overlay=palpate.Overlay(refinement=0)) as session:
    session.record("loop.mcap")
    with palpate.Loop(session, lambda t: (0.03, 0.03, max(0.036, 0.0402 - 0.01 * t))) as loop:
        while loop.felt is None or loop.felt.tool_position[2] > 0.036:
            time.sleep(0.1)  # draw here, or read a device
            print(f"largest displacement {1e3 * abs(session.displacement()).max():.2f} mm")
    session.end_recording()
print(f"{loop.felt.force[2]:.6f} N; half of the ticks began less than {1e6 * numpy.median(loop.late):.0f} us late")
