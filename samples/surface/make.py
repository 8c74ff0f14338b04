"""A bowl of triangles without a lid, in millimetres: what a scanner might give."""
import math

n, rings, points, faces = 24, 7, [(0, 0, -30)], []
for ring in range(1, rings + 1):
    tilt = math.pi / 2 * ring / rings
    points += [(30 * math.sin(tilt) * math.cos(2 * math.pi * k / n), 30 * math.sin(tilt) * math.sin(2 * math.pi * k / n),
                -30 * math.cos(tilt)) for k in range(n)]
for k in range(n):
    after = (k + 1) % n
    faces.append((0, 1 + after, 1 + k))
    for ring in range(rings - 1):
        a, b = 1 + n * ring, 1 + n * (ring + 1)
        faces += [(a + k, a + after, b + after), (a + k, b + after, b + k)]
with open("bowl.off", "w") as file:
    file.write(f"OFF\n{len(points)} {len(faces)} 0\n")
    file.writelines(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in points)
    file.writelines(f"3 {a} {b} {c}\n" for a, b, c in faces)
