"""A rigid sphere on an elastic block, through both programs: the quick end of scripts/studies/hertz."""

import importlib.machinery
import importlib.util
import unittest

import numpy as np

from programs import SOURCE, ProgramTest


def load(name):
    """scripts/studies/NAME as a module."""
    loader = importlib.machinery.SourceFileLoader(name, str(SOURCE / "scripts" / "studies" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


study = load("hertz")


class References(unittest.TestCase):
    """What the script compares with agrees where it must: all with Hertz as the depth goes to 0."""

    def test_small_depths(self):
        for poissons_ratio in (0.0, 0.3, 0.49):
            hertz = study.hertz(1e-6, poissons_ratio)
            self.assertAlmostEqual(study.sneddon(1e-6, poissons_ratio) / hertz, 1, delta=1e-6)
            self.assertAlmostEqual(study.half_space(1e-6, poissons_ratio) / hertz, 1, delta=1e-3)  # points move sideways by sqrt(1e-6)

    def test_sneddon_at_a_depth(self):
        # a = R/2: delta = R/4 ln 3, F (1 - nu^2)/(E R^2) = 5/8 ln 3 - 1/2
        self.assertAlmostEqual(study.sneddon(np.log(3) / 4, 0.0), 0.625 * np.log(3) - 0.5, delta=1e-12)


class Hertz(ProgramTest):
    """Cells of R/20, R/10 and R/5 under the sphere, block of 20 R."""

    DEPTH, POISSON = 0.2, 0.3

    def error(self, cells, depth=DEPTH):
        file = study.bake(self.folder, cells, self.POISSON, size=20)
        self.radius, self.force = study.press(file, cells, depth)
        return study.more(self.force.sum(), study.half_space(depth, self.POISSON))

    def test_force_and_pressure(self):
        coarse, fine = self.error(5), self.error(10)
        # Measured +1.7 and +2.7 %: 1.6 % by the block's end at 20 R, the rest discretisation where the contact has but 2.2 and 4.5 cells in its
        # radius.
        self.assertAlmostEqual(coarse, 1.7, delta=0.1)
        self.assertAlmostEqual(fine, 2.7, delta=0.1)
        # Hertz: 1 - (1 - 1/4)^1.5 = 35 % of the force is within half of the contact's radius, all within it but for a cell.
        a = np.sqrt(self.DEPTH)
        self.assertAlmostEqual(self.force[self.radius < 0.5 * a].sum() / self.force.sum(), 0.35, delta=0.1)
        np.testing.assert_array_equal(self.force[self.radius >= a + 0.1], 0)

    def test_a_shallow_press_is_not_held_out_by_edges(self):
        # Edges of L are chords of the sphere: touched, they add 1.5 L^2 / (8 R depth), 4.7 % here with L the diagonal of a cell.
        self.assertAlmostEqual(self.error(20, 0.02), -0.4, delta=0.3)


class SmallTools(ProgramTest):
    """Balls that touch one node and a few, on a block of half the study's size."""

    def test_what_is_told_is_the_ratio_to_hertz(self):
        small = load("small-tools")
        small.SIDE, small.CELLS = small.SIDE / 2, {element: cells // 2 for element, cells in small.CELLS.items()}
        for element in small.CELLS:
            file = small.bake(self.folder, element, 0.45)
            for radius, depth in ((0.003, 0.0015), (0.012, 0.0012)):
                ratio, told = small.press(self.folder, file, radius, depth)
                self.assertAlmostEqual(told / ratio.mean(), 1, delta=0.15, msg=f"{element}, R {radius}: {ratio}")
                self.assertGreater(told, 1.5)
