"""Draws the picture of a sample, by what its sample.toml says under [picture]: bodies as they are at moments of a run, with the tool, and beside them a
curve. Everything is drawn by numpy and matplotlib, so that it needs neither a screen nor a browser.

  recordings = ["a.mcap", ...]  runs: a line each in the curve, called by names = ["...", ...]
  bodies = ["a.mcap", ...]      runs of the bodies that are drawn, by default the first for each moment
  at = [0.5, ...]               moments [s]
  colour                        "displacement" (default), "von_mises", "pressure" or "none"
  view = [azimuth, elevation]   where the eye is [degree]
  floor                         height of a floor [m]
  tool = false                  leaves the tool out
  curve                         "force" (default), "x" (one component), "xyz", "contacts", "safety", "node" (with node = place, axis), "" (none)
  until                         where the curve ends [s]
  surfaces = ["a.vtu", ...]     surfaces of play --surface in place of bodies of runs, with their edges
  shapes = ["a.npz", ...]       nodes, triangles, u, tools, radius from Python, with table = "a.csv": columns over the first
  fields = ["BODY.palpate.hdf", "FIELD.csv"]   what probe --field wrote
  map = "a.csv", extent         a table as a coloured map [mm]"""

import os
import pathlib
import re
import subprocess
import tempfile

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import Circle, Polygon
from PIL import Image

import palpate

WIDTH, HEIGHT, FINE = 640, 300, 2  # [px] of the picture, and how much finer it is drawn
LINES = ["#b3403a", "#33658f", "#4f8a4b"]
LIGHT = np.array([-0.35, 0.45, 0.82])  # right, up, towards the eye
SHARP = np.cos(np.radians(40))  # sides that meet at less are shaded as one
TISSUE = LinearSegmentedColormap.from_list("tissue", ["#efd9cb", "#eab48c", "#dd7448", "#a92f3c", "#55123f"])
STRESS = LinearSegmentedColormap.from_list("stress", ["#dfe6ea", "#a9cfd0", "#efcf6b", "#e2813a", "#b12a3a"])
COLOURS = {"displacement": ("displacement", TISSUE, 1e3, "mm"), "von_mises": ("von Mises stress", STRESS, 1e-3, "kPa"),
           "pressure": ("contact pressure", STRESS, 1e-3, "kPa"), "none": ("", TISSUE, 0.0, "")}


class Run:
    """A recording with its pictures."""

    def __init__(self, file):
        self.ticks = palpate.read(file)
        with tempfile.TemporaryDirectory() as folder:
            pictures = pathlib.Path(folder) / "pictures.h5"
            subprocess.run(["palpate-runtime", "export", file, "--hdf5", pictures], check=True, capture_output=True)
            with h5py.File(pictures) as hdf:
                self.nodes, self.simplices = hdf["surface/nodes"][:], hdf["surface/simplices"][:]
                self.times = hdf["frames/time"][:]
                self.frames = {name: hdf[f"frames/{name}"][:] for name in COLOURS if name != "none"}

    def values(self, frame, colour):
        if colour == "none":
            return np.zeros(len(self.nodes))
        found = self.frames[colour][frame]
        return np.linalg.norm(found, axis=1) if colour == "displacement" else np.nan_to_num(found)

    def tool(self, moment):
        """Shape, place and quaternion of the tool."""
        tick = np.argmin(abs(self.ticks["time"] - moment))
        shape = re.search(r"^tool=(\S+)", self.ticks.options, re.MULTILINE)[1] if isinstance(self.ticks.options, str) else self.ticks.options["tool"]
        return shape, self.ticks["tool_position"][tick], self.ticks["tool_orientation"][tick]


def corner_normals(points, triangles):
    """Normal of each corner of each triangle [F, 3, 3], the mean of those neighbours that do not meet it in a sharp edge."""
    corners = points[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-30)
    around = [[] for _ in points]
    for face, nodes in enumerate(triangles):
        for node in nodes:
            around[node].append(face)
    normals = np.empty_like(corners)
    for face, nodes in enumerate(triangles):
        for k, node in enumerate(nodes):
            faces = np.array(around[node])
            normals[face, k] = area[faces[own[faces] @ own[face] > SHARP]].sum(axis=0)
    return normals / np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-30)


def hidden_edges(points, triangles):
    """Whether the edge opposite of each corner [F, 3] is a diagonal of a side of a brick: the longest in both of its triangles, which are in one plane."""
    corners = points[triangles]
    lengths = np.stack([np.linalg.norm(corners[:, (k + 1) % 3] - corners[:, (k + 2) % 3], axis=1) for k in range(3)], axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    longest = lengths > 1.02 * np.sort(lengths, axis=1)[:, [1]]
    by_edge = {}
    for face, nodes in enumerate(triangles):
        for k in range(3):
            by_edge.setdefault(frozenset((nodes[(k + 1) % 3], nodes[(k + 2) % 3])), []).append((face, k))
    hidden = np.zeros_like(longest)
    for pair in by_edge.values():
        if len(pair) == 2 and all(longest[face, k] for face, k in pair) and normals[pair[0][0]] @ normals[pair[1][0]] > 0.999:
            for face, k in pair:
                hidden[face, k] = True
    return hidden


class Canvas:
    """Pixels with depth, seen from a direction."""

    def __init__(self, points, view, shape, margin=0.04):
        azimuth, elevation = np.radians(view)
        towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        self.axes = np.array([right, np.cross(towards, right), towards])
        seen = points @ self.axes.T
        low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
        height, width = shape
        self.scale = (1 - 2 * margin) * min(width / (high[0] - low[0]), height / (high[1] - low[1]))
        self.middle, self.centre = (low + high) / 2, np.array([width / 2, height / 2])
        self.colour = np.ones((height, width, 3))
        self.depth = np.full((height, width), -np.inf)

    def project(self, points):
        seen = points @ self.axes.T
        flat = (seen[:, :2] - self.middle) * self.scale * [1, -1] + self.centre
        return np.column_stack([flat, seen[:, 2] * self.scale])

    def draw(self, points, triangles, paint, normals=None, edges=None, alpha=1.0, both_sides=False):
        """`paint(weights, face)`: colours [n, 3] of places within a face; `edges`: which are not drawn, None for no edges."""
        normals = corner_normals(points, triangles) if normals is None else normals
        seen, turned = self.project(points), normals @ self.axes.T
        colour, depth = (self.colour, self.depth) if alpha == 1.0 else (self.colour.copy(), self.depth.copy())
        for face, nodes in enumerate(triangles):
            a, b, c = seen[nodes]
            twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if abs(twice) < 1e-9 or (twice > 0 and not both_sides):
                continue
            low = np.maximum(np.floor(seen[nodes, :2].min(axis=0)).astype(int), 0)
            high = np.minimum(np.ceil(seen[nodes, :2].max(axis=0)).astype(int) + 1, self.depth.shape[::-1])
            if (low >= high).any():
                continue
            x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
            wb = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / twice
            wc = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / twice
            weights = np.stack([1 - wb - wc, wb, wc], axis=-1)
            z = weights @ seen[nodes, 2]
            window = np.s_[low[1]:high[1], low[0]:high[0]]
            inside = (weights.min(axis=-1) >= -1e-9) & (z > depth[window])
            if not inside.any():
                continue
            weights = weights[inside]
            normal = weights @ turned[face]
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
            light = normal @ (LIGHT / np.linalg.norm(LIGHT))
            light = abs(light) if both_sides else np.clip(light, 0, 1)
            pixels = paint(weights, face) * (0.42 + 0.62 * light)[:, None] + 0.10 * (light**24)[:, None]
            if edges is not None:
                altitude = abs(twice) / np.linalg.norm(seen[nodes][[1, 2, 0], :2] - seen[nodes][[2, 0, 1], :2], axis=1)
                near = np.where(edges[face], np.inf, weights * altitude).min(axis=1)
                pixels *= (1 - 0.30 * np.clip(1.6 - near, 0, 1))[:, None]
            colour[window][inside] = np.clip(pixels, 0, 1)
            depth[window][inside] = z[inside]
        if alpha != 1.0:
            new = depth > self.depth
            self.colour[new] = (1 - alpha) * self.colour[new] + alpha * colour[new]


def revolved(profile, place, axis):
    """Points, triangles and normals of a profile [(radius, height)] that is turned about an axis."""
    n, profile = 48, np.array(profile)
    axis = np.asarray(axis) / np.linalg.norm(axis)
    side = np.cross(axis, [1.0, 0, 0] if abs(axis[0]) < 0.9 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    turns = np.linspace(0, 2 * np.pi, n, endpoint=False)
    out = np.cos(turns)[:, None] * side + np.sin(turns)[:, None] * np.cross(axis, side)
    points = (place + profile[:, 1, None, None] * axis + profile[:, 0, None, None] * out).reshape(-1, 3)
    i, k = np.meshgrid(np.arange(len(profile) - 1), np.arange(n), indexing="ij")
    a, b, c, d = ((i + di) * n + (k + dk) % n for di, dk in ((0, 0), (0, 1), (1, 0), (1, 1)))
    triangles = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])
    return points, triangles


def tool_shape(shape, place, quaternion, small):
    """Triangles of a tool as options call it; a point is drawn as a small ball."""
    kind, _, sizes = shape.partition(":")
    sizes = [float(word) for word in sizes.split(",")] if sizes else [small]
    w, x, y, z = quaternion
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    tilts = np.linspace(-np.pi / 2, np.pi / 2, 25)
    if kind == "disc":
        edge = sizes[1] if len(sizes) > 1 else 0.1 * sizes[0]
        thick = max(2 * edge, 0.12 * sizes[0])  # it may be thinner than a pixel
        return revolved([(1e-9, -edge), (sizes[0], -edge), (sizes[0], thick), (1e-9, thick)], place, axis)
    length = sizes[1] if kind == "capsule" else 0.0
    return revolved([(sizes[0] * np.cos(t), sizes[0] * np.sin(t) + (length if t > 0 else 0.0)) for t in tilts], place, axis)


def draw_body(axes, bodies, view, tools=(), floor=None, around=()):
    """`bodies`: (rest nodes, triangles, displacement, values, largest value, map of colours); `around`: points [n, 3] that are in the picture too."""
    shape = np.array([axes.bbox.height, axes.bbox.width]).round().astype(int)
    points = np.vstack([nodes + u for nodes, _, u, *_ in bodies] + [tool[0] for tool in tools] + list(around))
    canvas = Canvas(points, view, shape)
    if floor is not None:
        low, high = points[:, :2].min(axis=0) - 0.005, points[:, :2].max(axis=0) + 0.005
        square = np.array([[low[0], low[1], floor], [high[0], low[1], floor], [high[0], high[1], floor], [low[0], high[1], floor]])
        canvas.draw(square, np.array([[0, 1, 2], [0, 2, 3]]), lambda weights, face: np.full((len(weights), 3), 0.93))
    for nodes, triangles, u, values, largest, colours in bodies:
        shades = np.clip(values / max(largest, 1e-30), 0, 1)
        canvas.draw(nodes + u, triangles, lambda weights, face: colours(weights @ shades[triangles[face]])[:, :3], edges=hidden_edges(nodes, triangles))
    for points, triangles in tools:
        canvas.draw(points, triangles, lambda weights, face: np.full((len(weights), 3), [0.80, 0.83, 0.88]), alpha=0.72, both_sides=True)
    axes.imshow(canvas.colour, interpolation="nearest", aspect="auto")
    axes.set_axis_off()


def outline(simplices):
    """Closed rings of nodes of the lines of a body in the plane."""
    after = dict(simplices.tolist())
    while after:
        ring = [next(iter(after))]
        while ring[-1] in after:
            ring.append(after.pop(ring[-1]))
        yield ring


def draw_plane(axes, run, frame, values, largest, colours, tool, window, floor):
    positions = (run.nodes + run.frames["displacement"][frame])[:, :2]
    for k, ring in enumerate(sorted(outline(run.simplices), key=lambda ring: -np.ptp(positions[ring, 0]))):
        axes.add_patch(Polygon(positions[ring], facecolor="#e8edf2" if k == 0 else "white", zorder=k))
    shades = np.clip(values / max(largest, 1e-30), 0, 1)
    lines = LineCollection(positions[run.simplices], colors=colours(shades[run.simplices].mean(axis=1)), linewidths=2.2, capstyle="round", zorder=5)
    axes.add_collection(lines)
    if tool is not None:
        axes.add_patch(Circle(tool[1][:2], float(tool[0].partition(":")[2].split(",")[0]), facecolor="#c9d0d8", edgecolor="0.45", zorder=6))
    if floor is not None:
        axes.axhline(floor, color="0.6", linewidth=1.5)
    axes.set(xlim=window[0], ylim=window[1], aspect="equal")
    axes.set_axis_off()


def style(axes, label):
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_ylabel(label)
    axes.set_xlabel("time [s]")
    axes.margins(x=0)


def draw_curve(axes, spec, runs):
    kind, names = spec.get("curve", "force"), spec.get("names", [])
    for k, run in enumerate(runs):
        time, force = run.ticks["time"], run.ticks["force"]
        name = names[k] if names else None
        if kind == "xyz":
            for axis in range(3):
                axes.plot(time, force[:, axis], color=LINES[axis], label=f"${'xyz'[axis]}$")
        elif kind == "contacts":
            axes.plot(time, run.ticks["contacts"], color=LINES[0])
        elif kind == "safety":
            axes.plot(time, np.linalg.norm(force, axis=1), color="0.65", label="computed")
            axes.plot(time, np.linalg.norm(run.ticks["shown_force"], axis=1), color=LINES[0], label="in the hand")
            for tick in np.flatnonzero(np.diff(run.ticks["fault"].astype(int)) > 0):
                axes.axvline(time[tick], color="0.3", linewidth=0.8, linestyle=":")
                axes.text(time[tick], axes.get_ylim()[1], "fault ", fontsize=7, ha="right", va="top", color="0.3")
        elif kind == "node":
            node, axis = np.argmin(np.linalg.norm(run.nodes - spec["node"], axis=1)), "xyz".index(spec["axis"])
            axes.plot(run.times, 1e3 * run.frames["displacement"][:, node, axis], color=LINES[0])
        else:
            axes.plot(time, force[:, 0] if kind == "x" else np.linalg.norm(force, axis=1), color=LINES[k], label=name, linewidth=1.4 + 1.2 * (len(runs) - 1 - k))
    style(axes, {"contacts": "contacts", "node": f"tip, {spec.get('axis')} [mm]", "x": "force along x [N]"}.get(kind, "force [N]"))
    if "until" in spec:
        axes.set_xlim(0, spec["until"])
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False, fontsize=7.5, loc="best", handlelength=1.4, borderaxespad=0.2)


def draw_table(axes, file):
    with open(file) as lines:
        names = lines.readline().strip().split(",")
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    for k, name in enumerate(names[1:]):
        axes.plot(rows[:, 0], rows[:, k + 1], color=LINES[k], label=name)
    style(axes, "force [N]")
    axes.legend(frameon=False, fontsize=7.5)


def draw_map(axes, spec):
    force = np.loadtxt(spec["map"], delimiter=",")
    shown = axes.imshow(1e3 * force, origin="lower", extent=spec["extent"], cmap="magma", interpolation="bicubic")
    axes.set(xlabel="x [mm]", ylabel="y [mm]")
    plt.colorbar(shown, ax=axes, label="force [mN]", shrink=0.8)


def read_vtu(file):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(file)
    reader.Update()
    grid = reader.GetOutput()
    triangles = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(grid.GetPoints().GetData()), triangles, vtk_to_numpy(grid.GetPointData().GetArray("displacement"))


def read_field(model, field):
    with h5py.File(model) as hdf:
        nodes, surface, u = hdf["mesh/nodes"][:], hdf["mesh/surface"][:], hdf["rest/displacement"][:]
    table = np.genfromtxt(field, delimiter=",", names=True)
    u[table["node"].astype(int)] += np.column_stack([table[name] for name in ("ux", "uy", "uz")])
    return nodes, surface, u


def panels(spec):
    """What is drawn of bodies: functions that take axes, and what stands below each."""
    view, colour = spec.get("view", [-60, 32]), spec.get("colour", "displacement")
    meaning, colours, factor, unit = COLOURS[colour]
    size = lambda u: np.linalg.norm(u, axis=1)
    told = lambda largest: f"{meaning} up to {float(f'{factor * largest:.2g}'):g} {unit}"
    runs = {name: Run(name) for name in {*spec.get("recordings", []), *spec.get("bodies", [])}}
    bodies = spec.get("bodies", spec.get("recordings", [None])[:1] * len(spec.get("at", [])))
    frames = [(runs[name], moment, int(np.argmin(abs(runs[name].times - moment)))) for name, moment in zip(bodies, spec.get("at", []))]
    largest = max((np.max(run.values(frame, colour)) for run, _, frame in frames), default=0.0)
    around = [run.nodes + run.frames["displacement"][frame] for run, _, frame in frames if "floor" in spec]
    found = []
    for k, (run, moment, frame) in enumerate(frames):
        values = run.values(frame, colour)
        tool = run.tool(moment) if spec.get("tool", True) else None
        below = spec["names"][spec["recordings"].index(bodies[k])] if "bodies" in spec and "names" in spec else f"{moment:g} s" if len(frames) > 1 else told(largest)
        if run.simplices.shape[1] == 2:
            every = np.concatenate([(one.nodes + one.frames["displacement"][at])[:, :2] for one, _, at in frames])
            low, high = every.min(axis=0) - 0.006, every.max(axis=0) + 0.012
            if spec.get("floor") is not None:
                low[1] = spec["floor"] - 0.004
            is_near = tool is not None and (tool[1][:2] > low).all() and (tool[1][:2] < high).all()
            found.append((lambda axes, a=(run, frame, values, largest, colours, tool if is_near else None, list(zip(low, high)), spec.get("floor")): draw_plane(axes, *a), below))
            continue
        u = run.frames["displacement"][frame]
        extent = np.ptp(run.nodes, axis=0).max()
        near = tool is not None and np.linalg.norm(tool[1] - (run.nodes + u).mean(axis=0)) < 1.2 * extent
        tools = [tool_shape(*tool, 0.012 * extent)] if near else []
        found.append((lambda axes, b=[(run.nodes, run.simplices, u, values, largest, colours)], t=tools: draw_body(axes, b, view, t, spec.get("floor"), around), below))
    for k, file in enumerate(spec.get("surfaces", [])):
        nodes, triangles, u = read_vtu(file)
        largest = size(u).max() if k == 0 else largest
        found.append((lambda axes, b=[(nodes, triangles, u, size(u), largest, colours)]: draw_body(axes, b, view), spec["names"][k]))
    for file in spec.get("shapes", []):
        kept = np.load(file)
        tools = [tool_shape(f"sphere:{kept['radius']}", place, (1, 0, 0, 0), 0) for place in kept["tools"]]
        u = kept["u"]
        found.append((lambda axes, b=[(kept["nodes"], kept["triangles"], u, size(u), size(u).max(), colours)], t=tools: draw_body(axes, b, view, t), told(size(u).max())))
    if "fields" in spec:
        nodes, triangles, u = read_field(*spec["fields"])
        found.append((lambda axes: draw_body(axes, [(nodes, triangles, u, size(u), size(u).max(), colours)], view), told(size(u).max())))
    return found, [runs[name] for name in spec.get("recordings", [])]


def draw(spec, folder, out):
    """Draws into `out` what the [picture] of a sample asks for of the files in `folder`."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        plt.rcParams.update({"font.size": 8, "axes.linewidth": 0.6, "lines.linewidth": 1.5, "xtick.major.width": 0.6, "ytick.major.width": 0.6})
        bodies, runs = panels(spec)
        has_curve = "table" in spec or bool(runs) and spec.get("curve", "force") != ""
        count = len(bodies)
        ratios = [1.0] * count + ([0.95 if count > 1 else 0.75] if has_curve else [])
        figure = plt.figure(figsize=(WIDTH / 100, HEIGHT / 100), dpi=100 * FINE)
        if "map" in spec:
            draw_map(figure.add_axes([0.08, 0.15, 0.90, 0.80]), spec)
        else:
            grid = figure.add_gridspec(1, len(ratios), width_ratios=ratios, left=0.01, right=0.985, top=0.97, bottom=0.03, wspace=0.04 if not has_curve else 0.10)
            for k, (paint, below) in enumerate(bodies):
                axes = figure.add_subplot(grid[k])
                box = axes.get_position()
                axes.set_position([box.x0, box.y0 + 0.07, box.width, box.height - 0.07])
                paint(axes)
                figure.text(box.x0 + box.width / 2, 0.035, below, ha="center", va="bottom", color="0.25")
            if has_curve:
                axes = figure.add_subplot(grid[count])
                box = axes.get_position()
                axes.set_position([box.x0 + 0.065, 0.16, box.width - 0.065, 0.78])
                draw_table(axes, spec["table"]) if "table" in spec else draw_curve(axes, spec, runs)
        figure.canvas.draw()
        picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
        plt.close(figure)
        picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS).save(out, quality=82, method=6)
    finally:
        os.chdir(before)
