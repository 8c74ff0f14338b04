"""Presses the block at 15 x 9 places by the same depth: a map of what a fingertip feels."""
import numpy
import palpate

xs, ys = numpy.linspace(-0.03, 0.03, 15), numpy.linspace(-0.018, 0.018, 9)
force = numpy.empty((len(ys), len(xs)))
with palpate.Session("nodule.palpate.hdf", palpate.Tool(radius=0.005)) as session:
    for i, y in enumerate(ys):
        for j, x in enumerate(xs):
            session.reset()
            force[i, j] = session.play(numpy.linspace([x, y, 0.0351], [x, y, 0.033], 20))[-1, 2]
numpy.savetxt("map.csv", force, delimiter=",")
i, j = numpy.unravel_index(force.argmax(), force.shape)
print(f"the hardest place is at {xs[j] * 1e3:.1f}, {ys[i] * 1e3:.1f} mm: {force.max():.4f} N, elsewhere {numpy.median(force):.4f} N")
