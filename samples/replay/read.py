import numpy
import palpate

touch = palpate.read("touch.mcap")
force = numpy.linalg.norm(touch["force"], axis=1)
print(f"{len(touch)} ticks, the largest force is {force.max():.4f} N at {touch['time'][force.argmax()]:.3f} s")
