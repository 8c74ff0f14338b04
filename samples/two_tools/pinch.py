"""Two fingertips pinch a block from both sides."""
import numpy
import palpate

with palpate.Session("block.palpate.hdf", [palpate.Tool(radius=0.008), palpate.Tool(radius=0.008)]) as session:
    rows = []
    for tick in range(600):
        way = 0.009 * min(tick, 500) / 500
        session.put(0, (-0.0090 + way, 0.03, 0.022))
        session.put(1, (0.0690 - way, 0.03, 0.022))
        session.step()
        left, right = session.felt(0), session.felt(1)
        rows.append((0.001 * tick, left.force[0], right.force[0]))
    numpy.savetxt("pinch.csv", rows, delimiter=",", header="t,left,right", comments="")
    numpy.savez("pinch.npz", nodes=session.rest, triangles=session.simplices, u=session.displacement(),
                tools=[left.tool_position, right.tool_position], radius=0.008)
print(f"left {left.force[0]:.5f} N, right {right.force[0]:.5f} N")
