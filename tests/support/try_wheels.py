"""Run by scripts/try-wheels where the wheels are installed: `force`, the first force from Python; `all`, a bake, an image, a recording with what it shows,
and a surface pushed with its page."""

import pathlib
import re
import signal
import subprocess
import sys
import urllib.request

import palpate

PROGRAMS = pathlib.Path(palpate.library.program("palpate-runtime")).parent
CORNERS = [(x, y, z) for x in (0, 40) for y in (0, 30) for z in (0, 20)]
SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def press(file, recording=None):
    with palpate.Session(file, palpate.Tool(radius=0.1)) as session:
        if recording is not None:
            session.record(recording)
        for tick in range(300):
            felt = session.step((0.5, 0.5, max(1.05, 1.2 - 0.001 * tick)))
        return felt.force[2]


def box():
    lines = ["solid box"]
    for side in SIDES:
        for corners in ((side[0], side[1], side[2]), (side[0], side[2], side[3])):
            lines += ["facet normal 0 0 0", "outer loop", *["vertex %g %g %g" % CORNERS[corner] for corner in corners], "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box", ""])


def push():
    """A surface to a page that is served."""
    pathlib.Path("box.stl").write_text(box())
    command = ["palpate-runtime", "push", "box.stl", "--unit", "mm", "--surface-nodes", "300", "--view-address", "0"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        said = []
        for line in process.stderr:
            said.append(line)
            address = re.search(r"http://\S+", line)
            if address is not None:
                break
        else:
            sys.exit("".join(said))
        page = urllib.request.urlopen(address[0]).read()
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    if len(page) < 100_000 or b'data-testid="depth"' not in page or process.returncode != 128 + signal.SIGINT:
        sys.exit(f"a page of {len(page)} bytes, and status {process.returncode}: {''.join(said)}")
    print(f"box.stl is pushed; its page has {len(page)} bytes")


def image():
    """A block of voxels, which teem reads."""
    header = "NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: 12 12 12\nspacings: 1 1 1\nencoding: raw\n\n"
    voxels = bytes(all(1 < k < 10 for k in (n % 12, n // 12 % 12, n // 144)) for n in range(12 ** 3))
    pathlib.Path("block.nrrd").write_bytes(header.encode() + voxels)
    baked("block.nrrd", "--unit", "mm", "--surface-nodes", "300")
    print("block.nrrd is baked")


def baked(*words):
    done = subprocess.run([str(PROGRAMS / "palpate-precompute"), *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        sys.exit(done.stdout)


def main():
    shipped = PROGRAMS.parent / "share" / "palpate" / "models" / "cube" / "cube.palpate.hdf"
    force = press(shipped)
    print(f"force {force:.9f} N")
    if force <= 0:
        sys.exit("the cube pulls")
    if sys.argv[1] == "force":
        return
    palpate.bake("/wheels/model.toml", "cube.palpate.hdf")
    again = press("cube.palpate.hdf", "touch.mcap")
    if abs(again - force) > 1e-9 * force:
        sys.exit(f"the cube baked here gives {again!r} N")
    print("the cube is baked; its force is that of the shipped one")
    probed = palpate.probe("cube.palpate.hdf", [[0, 0, 1]], at=[(0.5, 0.5, 1)])[0]
    print(f"probe {probed[2]:.4f} N")
    subprocess.run([str(PROGRAMS / "palpate-runtime"), "export", "touch.mcap", "--hdf5", "touch.h5"], stdout=subprocess.DEVNULL, check=True)
    print(f"{len(palpate.read('touch.mcap'))} ticks are recorded and exported")
    image()
    subprocess.run([sys.executable, "-m", "palpate.samples", "press"], check=True)
    push()


main()
