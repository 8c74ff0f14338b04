"""The models that are shipped: each is precomputed, proved and pressed, without a warning."""

import shutil
import unittest

import h5py
import numpy

from programs import PRECOMPUTE, RUNTIME, SOURCE, ProgramTest, run

MODELS = SOURCE / "meshes" / "models"
CHEAP = ("cube", "ball", "beam", "sphere", "plate", "cantilever")
TOO_LARGE = {"liver_ct"}  # for one machine


class ModelsTest(ProgramTest):
    def expect_no_warning(self, result):
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("warning", (result.stdout + result.stderr).lower())

    def script(self, file):
        """A sphere that comes down on the highest node that is free, and its radius."""
        with h5py.File(file) as model:
            nodes, fixed, surface = model["/mesh/nodes"][:], model["/dofs/fixed"][:], numpy.unique(model["/mesh/surface"][:])
            up = int(model.attrs["dimension"]) - 1
        free = surface[fixed[surface] == 0]
        top = nodes[free[numpy.argmax(nodes[free, up])]]
        size = float(numpy.linalg.norm(numpy.ptp(nodes, axis=0)))
        rows = []
        for time, height in ((0.0, 0.05), (0.1, 0.03), (0.2, 0.025)):
            at = top.copy()
            at[up] += height * size
            rows.append(f"{time},{at[0]!r},{at[1]!r},{at[2]!r}\n".replace("np.float64(", "").replace(")", ""))
        return self.write("touch.csv", "t,x,y,z\n" + "".join(rows)), 0.03 * size

    def expect_whole(self, name):
        shutil.copytree(MODELS / name, self.folder / name, dirs_exist_ok=True)  # the image may be there, for another
        if not (image := self.folder / "liver" / "liver.inr.gz").exists() and (MODELS / "liver" / image.name).exists():
            image.parent.mkdir(exist_ok=True)
            shutil.copy(MODELS / "liver" / image.name, image)
        self.expect_no_warning(run(PRECOMPUTE, self.folder / name / "model.toml", cwd=self.folder))
        file = self.folder / f"{name}.palpate.hdf"
        self.expect_no_warning(run(PRECOMPUTE, "verify", file))
        self.expect_no_warning(run(PRECOMPUTE, "inspect", file))
        script, radius = self.script(file)
        played = run(RUNTIME, "play", file, "--fast", "--device", f"script:{script}", "--tool", f"sphere:{radius}")
        self.expect_no_warning(played)
        self.assertNotIn(" 0 of them in contact", played.stderr, "it is pressed")


class Cheap(ModelsTest):
    def test_models_are_whole(self):
        for name in CHEAP:
            with self.subTest(model=name):
                self.expect_whole(name)


def greens_by_node(model):
    """The whole matrix, by the nodes' numbers: their order in a file is not the same with every compiler's library."""
    nodes = model["/dofs/stored_nodes"][:]
    size = int(model.attrs["dimension"]) * len(nodes)
    whole = numpy.zeros((size, size))
    whole[numpy.triu_indices(size)] = model["/greens/packed"][:]
    whole += numpy.triu(whole, 1).T
    dofs = (numpy.argsort(nodes)[:, None] * (size // len(nodes)) + numpy.arange(size // len(nodes))).ravel()
    return whole[numpy.ix_(dofs, dofs)]


class Kept(ModelsTest):
    def test_the_body_that_is_kept_baked_is_what_its_model_bakes(self):
        kept = MODELS / "ball" / "ball.palpate.hdf"
        self.expect_no_warning(run(PRECOMPUTE, "verify", kept))
        file = self.folder / "ball.palpate.hdf"
        self.expect_no_warning(run(PRECOMPUTE, MODELS / "ball" / "model.toml", "-o", file))
        with h5py.File(kept) as old, h5py.File(file) as new:
            numpy.testing.assert_array_equal(old["/mesh/nodes"], new["/mesh/nodes"])
            greens = greens_by_node(old)
            numpy.testing.assert_allclose(greens, greens_by_node(new), rtol=0, atol=1e-6 * numpy.abs(greens).max())


class Dear(ModelsTest):
    def test_models_are_whole(self):
        for name in sorted({file.parent.name for file in MODELS.glob("*/model.toml")} - set(CHEAP) - TOO_LARGE):
            if name.startswith("liver") and not (MODELS / "liver" / "liver.inr.gz").exists():
                continue  # scripts/demo fetches the image
            with self.subTest(model=name):
                self.expect_whole(name)
            if name == "liver":
                self.assertLess((self.folder / "liver.palpate.hdf").stat().st_size, 60e6, "what docs/getting-started.md and docs/packages.md say")


if __name__ == "__main__":
    unittest.main()
