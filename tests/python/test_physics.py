"""Water, ground and spin: against formulas, and hostile arguments."""
import math
import unittest

import numpy as np
import rayrep
from solids import ball

BARGE = rayrep.box((100, 40, 20), (3, -2, 10))


class Water(unittest.TestCase):
    def test_a_barge_floats_as_the_textbook_says(self):
        water = rayrep.hydrostatics(BARGE, mass=40)
        self.assertAlmostEqual(water.waterline, 10)
        self.assertAlmostEqual(water.displaced_volume, 40000)
        self.assertAlmostEqual(water.displaced_mass, 40)
        np.testing.assert_allclose(water.center_buoyancy, [3, -2, 5], atol=1e-9)
        self.assertAlmostEqual(water.waterplane_area, 4000)
        np.testing.assert_allclose(water.second_moments, [100 * 40**3 / 12, 40 * 100**3 / 12])
        self.assertAlmostEqual(water.metacentric_radius, 100 * 40**3 / 12 / 40000)
        self.assertAlmostEqual(water.metacentric_height([3, -2, 10]), 40**2 / 12 / 10 - 5)
        self.assertIsNone(water.freeboard)

    def test_up_and_fluid_count(self):
        on_its_side = rayrep.hydrostatics(BARGE, mass=40, up="y")
        self.assertAlmostEqual(on_its_side.waterline, 20)
        np.testing.assert_allclose(on_its_side.up, [0, 1, 0])
        self.assertAlmostEqual(rayrep.hydrostatics(BARGE, mass=40, fluid=2).waterline, 5)
        self.assertAlmostEqual(rayrep.hydrostatics(BARGE, waterline=10, up=(0, 0, -7)).center_buoyancy[2], 15)

    def test_what_is_too_heavy_sinks(self):
        with self.assertRaises(rayrep.GoalError):
            rayrep.hydrostatics(BARGE, mass=81)
        rest = rayrep.floating_rest(BARGE, 81)
        self.assertEqual((rest.outcome, rest.waterline), ("sinks", None))
        with self.assertRaises(rayrep.GoalError):
            rayrep.righting_arm(BARGE, 81)

    def test_a_barge_on_its_side_lies_down(self):
        rest = rayrep.floating_rest(BARGE, 40, up="y")
        self.assertEqual(rest.outcome, "rests")
        self.assertAlmostEqual(abs(rest.up[2]), 1)
        self.assertAlmostEqual(rest.tilt, math.pi / 2, places=5)

    def test_righting_arms_are_those_of_a_box_side(self):
        curve = rayrep.righting_arm(BARGE, 40, lowered="y", steps=36)
        self.assertEqual(len(curve.heel), 37)
        t = np.tan(curve.heel[1:5])  # of a wall-sided body GZ = sin(heel) (GM + BM tan^2 / 2)
        expected = np.sin(curve.heel[1:5]) * (40**2 / 12 / 10 - 5 + 40**2 / 12 / 10 * t**2 / 2)
        np.testing.assert_allclose(curve.arm[1:5], expected, rtol=1e-6)
        self.assertAlmostEqual(curve.range, math.pi / 2, places=4)
        self.assertEqual(curve.end, "turns_over")
        np.testing.assert_allclose(np.abs(rayrep.righting_arm(BARGE, 40).lowered), [0, 1, 0], atol=1e-6)

    def test_arguments_that_make_no_sense(self):
        for call in (lambda: rayrep.hydrostatics(BARGE), lambda: rayrep.hydrostatics(BARGE, 3, mass=4),
                     lambda: rayrep.hydrostatics(BARGE, mass=-1), lambda: rayrep.hydrostatics(BARGE, mass=math.nan),
                     lambda: rayrep.hydrostatics(BARGE, 3, up=(0, 0, 0)), lambda: rayrep.hydrostatics(BARGE, 3, up="w"),
                     lambda: rayrep.hydrostatics(BARGE, 3, up=(0, 1)), lambda: rayrep.hydrostatics(BARGE, 3, fluid=0),
                     lambda: rayrep.righting_arm(BARGE, 40, steps=0), lambda: rayrep.righting_arm(BARGE, 0),
                     lambda: rayrep.spin(BARGE, contact=(1, 2)), lambda: rayrep.spin(BARGE, density=0),
                     lambda: rayrep.support_polygon(BARGE, tolerance=-1), lambda: rayrep.resting_faces(BARGE, shake=9),
                     lambda: rayrep.resting_faces(BARGE, center_mass="middle"), lambda: rayrep.box((1, 0, 1)),
                     lambda: rayrep.support_polygon(BARGE, center_mass=(math.nan, 0, 0))):
            with self.assertRaises(rayrep.UsageError):
                call()
        with self.assertRaises(TypeError):
            rayrep.hydrostatics("duck.stl", 3)
        lid_off = rayrep.Mesh(BARGE.vertices, BARGE.faces[1:])
        for call in (lambda: rayrep.hydrostatics(lid_off, 3), lambda: rayrep.mass_properties(lid_off),
                     lambda: rayrep.spin(lid_off), lambda: rayrep.support_polygon(lid_off, center_mass=(0, 0, 1))):
            with self.assertRaises(rayrep.InputError):
                call()
        with self.assertRaises(rayrep.InputError):
            rayrep.resting_faces(BARGE, center_mass=(0, 0, 1000))


class GroundAndSpin(unittest.TestCase):
    def test_a_box_tips_over_its_near_edge(self):
        support = rayrep.support_polygon(BARGE)
        self.assertTrue(support.stands)
        self.assertEqual(support.corners.shape, (4, 3))
        self.assertAlmostEqual(support.area, 4000)
        self.assertAlmostEqual(support.height, 10)
        np.testing.assert_allclose(sorted(support.tipping_angles), [math.atan(2)] * 2 + [math.atan(5)] * 2)
        np.testing.assert_allclose(support.safest_point, [3, -2, 0], atol=1e-9)
        self.assertFalse(rayrep.support_polygon(BARGE, center_mass=(60, 0, 5)).stands)
        np.testing.assert_allclose(rayrep.support_polygon(BARGE, up="-x").corners[:, 0], 53)

    def test_a_box_lands_on_its_larger_faces_more_often(self):
        faces = rayrep.resting_faces(BARGE)
        self.assertAlmostEqual(sum(face.share for face in faces), 1)
        self.assertEqual([round(abs(face.up[2])) for face in faces[:2]], [1, 1])

    def test_a_flat_box_spins_from_the_speed_of_the_formula(self):
        found = rayrep.spin(BARGE, density=1, contact=(3, -2, 0))
        self.assertEqual(found.axis_class, "largest")
        m, l = 80, 10
        i1, i2, i3 = (m / 12 * (a * a + b * b) for a, b in ((40, 20), (100, 20), (100, 40)))
        self.assertAlmostEqual(found.sliding[-1, 0], math.sqrt(m * 9806.65 * l / (i3 - i2)))
        self.assertEqual(found.sliding[-1, 1], math.inf)
        self.assertAlmostEqual(found.ratio_larger, i3 / i2)
        self.assertEqual(rayrep.spin(BARGE, up="y").axis_class, "middle")
        self.assertEqual(rayrep.spin(BARGE, up="y").sliding.shape[1:], (2,))
        self.assertAlmostEqual(rayrep.spin(BARGE, yoyo=True).height, 0)

    def test_inertial_elements_are_in_si(self):
        text = rayrep.urdf(rayrep.box((100, 100, 100)), 1)
        self.assertIn('<mass value="1"/>', text.replace('"1.0"', '"1"'))
        self.assertIn("<inertial", rayrep.mjcf(ball()))


if __name__ == "__main__":
    unittest.main()
