"""A segmented image as NRRD, voxels of 3 mm: 1 is an organ, 2 a lesion in it, 0 is outside."""
import numpy

z, y, x = numpy.mgrid[:18, :18, :24]
labels = numpy.zeros(x.shape, numpy.uint8)
labels[((x - 11.5) / 11) ** 2 + ((y - 8.5) / 8) ** 2 + ((z - 8.5) / 8) ** 2 < 1] = 1
labels[(x - 7) ** 2 + (y - 8.5) ** 2 + (z - 12) ** 2 < 6] = 2
with open("organ.nrrd", "wb") as file:
    file.write(b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 24 18 18\nspacings: 3 3 3\nencoding: raw\n\n" + labels.tobytes())
