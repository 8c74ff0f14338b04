"""A body of arrays: the triangles of a ring, made by numpy, are filled with elements and pressed."""
import numpy
import palpate

n, m = 24, 12
u, v = numpy.meshgrid(numpy.linspace(0, 2 * numpy.pi, n, endpoint=False), numpy.linspace(0, 2 * numpy.pi, m, endpoint=False), indexing="ij")
radius = 0.03 + 0.012 * numpy.cos(v)
points = numpy.stack([radius * numpy.cos(u), radius * numpy.sin(u), 0.012 * numpy.sin(v)], axis=-1).reshape(-1, 3)
a, b = numpy.meshgrid(numpy.arange(n), numpy.arange(m), indexing="ij")
at = lambda i, j: ((i % n) * m + j % m).ravel()
triangles = numpy.vstack([numpy.column_stack([at(a, b), at(a + 1, b), at(a + 1, b + 1)]), numpy.column_stack([at(a, b), at(a + 1, b + 1), at(a, b + 1)])])

palpate.bake_mesh(points, triangles, "ring.palpate.hdf", mesh={"edge_length": 0.008}, material={"youngs_modulus": 5e3, "poissons_ratio": 0.4},
                  fixed=[{"lowest": {"axis": "z", "percent": 20}}])
with palpate.Session("ring.palpate.hdf", palpate.Tool(radius=0.008)) as session:
    session.record("ring.mcap")
    session.play(numpy.linspace([0.03, 0, 0.0202], [0.03, 0, 0.016], 300))
    session.end_recording()
    touched = session.contacts()
print(f"{len(touched.force)} contacts press with {touched.force[:, 2].sum():.4f} N")
