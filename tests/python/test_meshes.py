"""Meshes: figures of solids, views, hostile arrays."""
import copy
import gc
import pickle
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rayrep
from solids import EXAMPLES, ball, moments_of_tetrahedra

BOX = rayrep.box((30, 20, 10), (1, 2, 3))


class Figures(unittest.TestCase):
    def test_a_box_has_the_figures_of_its_formulas(self):
        self.assertAlmostEqual(BOX.volume, 6000, delta=1e-12 * 6000)
        np.testing.assert_allclose(BOX.center_mass, [1, 2, 3], rtol=1e-12)
        inertia = 500 * np.diag([20**2 + 10**2, 30**2 + 10**2, 30**2 + 20**2])
        np.testing.assert_allclose(BOX.moment_inertia, inertia, rtol=1e-12, atol=1e-12 * inertia.max())
        self.assertAlmostEqual(BOX.area, 2 * (600 + 300 + 200), delta=1e-10)
        np.testing.assert_array_equal(BOX.bounds, [[-14, -8, -2], [16, 12, 8]])
        np.testing.assert_array_equal(BOX.extents, [30, 20, 10])
        self.assertTrue(BOX.is_watertight)

    def test_a_ball_of_triangles_has_the_moments_of_its_tetrahedra(self):
        for center in ((0, 0, 0), (5, -7, 11)):
            mesh = ball(10, 24, center)
            volume, first, second = moments_of_tetrahedra(mesh)
            self.assertAlmostEqual(mesh.volume / volume, 1, delta=1e-12)
            np.testing.assert_allclose(mesh.center_mass, first / volume, rtol=0, atol=1e-12 * 20)
            s = rayrep.moments(mesh)
            np.testing.assert_allclose(s[1:4], first, rtol=0, atol=1e-12 * volume * 20)
            np.testing.assert_allclose(s[[4, 5, 6, 7, 8, 9]], second[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]], rtol=0,
                                       atol=1e-12 * volume * 400)

    def test_a_ball_comes_near_the_round_one_with_the_square_of_its_facets(self):
        exact = 4 / 3 * np.pi * 1000
        errors = [1 - ball(10, n).volume / exact for n in (16, 32, 64)]
        for coarse, fine in zip(errors, errors[1:]):
            self.assertAlmostEqual(coarse / fine, 4, delta=0.1)

    def test_mass_counts_once_what_overlaps(self):
        a, b = rayrep.box((10, 10, 10)), rayrep.box((10, 10, 10), (5, 0, 0))
        both = rayrep.Mesh(np.vstack([a.vertices, b.vertices]), np.vstack([a.faces, b.faces + 8]))
        self.assertAlmostEqual(both.volume, 2000)
        self.assertAlmostEqual(rayrep.mass_properties(both, 1).volume, 1500)

    def test_principal_axes_turn_the_inertia_diagonal(self):
        mass = rayrep.mass_properties(BOX, 2)
        self.assertAlmostEqual(mass.mass, 12)
        axes = mass.principal_inertia_vectors
        np.testing.assert_allclose(axes @ mass.moment_inertia @ axes.T, np.diag(mass.principal_inertia_components), atol=1e-6)
        self.assertAlmostEqual(np.linalg.det(axes), 1)

    def test_bodies_that_do_not_touch_are_split(self):
        a, b = rayrep.box((10, 10, 10)), rayrep.box((4, 4, 4), (20, 0, 0))
        both = rayrep.Mesh(np.vstack([a.vertices, b.vertices]), np.vstack([a.faces, b.faces + 8]))
        self.assertEqual(sorted(part.volume for part in both.split()), [64, 1000])

    def test_files_come_back_as_they_were(self):
        with tempfile.TemporaryDirectory() as folder:
            for ending in ("stl", "obj", "ply", "3mf"):
                path = Path(folder) / f"box.{ending}"
                BOX.export(path)
                back = rayrep.load(path)
                self.assertEqual(back.volume, BOX.volume, ending)
                self.assertEqual(len(back.vertices), 8)
                self.assertEqual(back.name, str(path))
            self.assertAlmostEqual(rayrep.load(path, size=60).volume, 8 * BOX.volume)
            self.assertAlmostEqual(rayrep.load(Path(folder) / "box.stl", unit="cm").volume, 1000 * BOX.volume)
            with self.assertRaises(rayrep.UsageError):
                BOX.export(Path(folder) / "box.xyz")
            with self.assertRaises(rayrep.WriteError) as caught:
                BOX.export("/nowhere/box.stl")
            self.assertIsInstance(caught.exception, OSError)

    def test_an_open_surface_is_seen_and_mended(self):
        lid_off = rayrep.Mesh(BOX.vertices, BOX.faces[2:])
        self.assertFalse(lid_off.is_watertight)
        self.assertAlmostEqual(rayrep.repair(lid_off).volume, BOX.volume)
        fin = rayrep.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        found = rayrep.inspect(fin)
        self.assertFalse(found.usable)
        self.assertIsNone(found.mass)
        self.assertEqual(found.defects["open_edges"].count, 3)
        with self.assertRaises(rayrep.InputError):
            rayrep.mass_properties(fin)
        with self.assertRaises(rayrep.InputError):
            rayrep.hollow(fin)


class Views(unittest.TestCase):
    def test_arrays_are_views_of_the_mesh_and_cannot_be_written(self):
        self.assertTrue(np.shares_memory(BOX.vertices, BOX.vertices))
        for view in (BOX.vertices, BOX.faces):
            with self.assertRaises(ValueError):
                view[0, 0] = 1
            with self.assertRaises(ValueError):
                view.flags.writeable = True
        self.assertEqual(BOX.vertices.dtype, np.float64)
        self.assertEqual(BOX.faces.dtype, np.int32)

    def test_a_view_outlives_the_name_of_its_mesh(self):
        vertices, faces = ball(10, 40).vertices, ball(10, 40).faces
        gc.collect()
        [ball(11, 40) for _ in range(20)]
        np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 10, rtol=1e-12)
        self.assertEqual(faces.max(), len(vertices) - 1)

    def test_arrays_are_copied_in(self):
        corners = np.array(BOX.vertices)
        mesh = rayrep.Mesh(corners, BOX.faces)
        corners[:] = 0
        self.assertEqual(mesh.volume, BOX.volume)

    def test_a_mesh_is_copied_and_pickled_with_its_arrays(self):
        for twin in (copy.deepcopy(BOX), pickle.loads(pickle.dumps(BOX))):
            np.testing.assert_array_equal(twin.vertices, BOX.vertices)
            np.testing.assert_array_equal(twin.faces, BOX.faces)
        with self.assertRaises(rayrep.UsageError):
            rayrep.Mesh.__new__(rayrep.Mesh).__setstate__((1,))

    def test_references_are_given_back(self):
        before = sys.getrefcount(BOX)
        for _ in range(1000):
            BOX.vertices, BOX.faces, BOX.volume, BOX.bounds
        self.assertEqual(sys.getrefcount(BOX), before)
        corners = np.array(BOX.vertices)
        before = sys.getrefcount(corners)
        for _ in range(1000):
            rayrep.Mesh(corners, BOX.faces)
        self.assertEqual(sys.getrefcount(corners), before)

    def test_ten_thousand_turns_take_no_memory(self):
        vertices, faces = np.array(BOX.vertices), np.array(BOX.faces)

        def turns(count):
            for _ in range(count):
                mesh = rayrep.Mesh(vertices, faces)
                mesh.vertices, mesh.faces, mesh.center_mass, mesh.moment_inertia, mesh.is_watertight
                rayrep.mass_properties(mesh)
                try:
                    rayrep.Mesh(vertices, faces + 9)
                except rayrep.UsageError:
                    pass

        turns(1000)
        gc.collect()
        before = resident_kb()
        turns(10000)
        gc.collect()
        self.assertLess(resident_kb() - before, 2000)


def resident_kb():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))


class Hostile(unittest.TestCase):
    def refused(self, vertices, faces, *words):
        with self.assertRaises(rayrep.UsageError) as caught:
            rayrep.Mesh(vertices, faces)
        self.assertIsInstance(caught.exception, ValueError)
        for word in words:
            self.assertIn(word, str(caught.exception))

    def test_shapes(self):
        corners, faces = BOX.vertices, BOX.faces
        self.refused(corners[:, :2], faces, "vertices", "(8, 2)")
        self.refused(corners.ravel(), faces, "vertices", "(24,)")
        self.refused(corners[None], faces, "vertices", "(1, 8, 3)")
        self.refused(5, faces, "vertices", "()")
        self.refused(corners, [[0, 1, 2, 3]], "faces", "(1, 4)", "quads")
        self.refused([[0, 0, 0], [1]], faces, "vertices")

    def test_kinds(self):
        corners, faces = BOX.vertices, BOX.faces
        self.refused(corners, faces.astype(float), "faces", "float64")
        self.refused(corners.astype(complex), faces, "vertices", "complex128")
        self.refused(corners.astype(str), faces, "vertices")
        self.refused(None, faces, "vertices")
        self.refused(corners, [["a", "b", "c"]], "faces")
        self.refused(np.array([[object()] * 3]), faces, "vertices")
        with self.assertRaises(TypeError):
            rayrep.Mesh(corners)

    def test_numbers(self):
        corners, faces = np.array(BOX.vertices), np.array(BOX.faces)
        for bad in (np.nan, np.inf, -np.inf):
            spoiled = corners.copy()
            spoiled[3, 1] = bad
            self.refused(spoiled, faces, "vertex 3")
        for bad in (-1, 8, 2**31, 2**62):
            spoiled = faces.astype(np.int64)
            spoiled[5, 2] = bad
            self.refused(corners, spoiled, "face 5", str(bad), "0 to 7")
        self.refused(corners, np.array([[0, 1, 2**63]], dtype=np.uint64), "face 0", str(2**63))

    def test_orders_and_strides_do_not_matter(self):
        corners, faces = np.array(BOX.vertices), np.array(BOX.faces)
        padded = np.zeros((16, 6))
        padded[::2, ::2] = corners
        read_only = corners.copy()
        read_only.flags.writeable = False
        others = [np.asfortranarray(corners), padded[::2, ::2], corners[::-1][::-1], read_only, corners.astype(np.float32), corners.tolist(),
                  corners.astype(">f8"), np.array(corners, dtype=int)]
        for other in others:
            np.testing.assert_array_equal(rayrep.Mesh(other, faces).vertices, corners)
        for other in (np.asfortranarray(faces), faces.astype(np.uint8), faces.astype(np.int64), faces.astype(">i4"), faces.tolist()):
            np.testing.assert_array_equal(rayrep.Mesh(corners, other).faces, faces)

    def test_nothing_is_a_mesh_of_nothing(self):
        for vertices, faces in (([], []), (np.zeros((0, 3)), np.zeros((0, 3), int))):
            mesh = rayrep.Mesh(vertices, faces)
            self.assertEqual((mesh.vertices.shape, mesh.faces.shape), ((0, 3), (0, 3)))
            self.assertEqual((mesh.volume, mesh.area, mesh.bounds, mesh.extents), (0, 0, None, None))
            self.assertFalse(mesh.is_watertight)
            self.assertEqual(mesh.split(), [])
            self.assertIn("0 faces", repr(mesh))
            calls = (lambda: mesh.center_mass, lambda: mesh.export("/tmp/rayrep_nothing.stl"), lambda: rayrep.mass_properties(mesh),
                     lambda: rayrep.hollow(mesh), lambda: rayrep.verify(mesh), lambda: rayrep.hydrostatics(mesh, 1),
                     lambda: rayrep.floating_rest(mesh, 1), lambda: rayrep.righting_arm(mesh, 1), lambda: rayrep.spin(mesh),
                     lambda: rayrep.support_polygon(mesh), lambda: rayrep.resting_faces(mesh), lambda: rayrep.urdf(mesh))
            for call in calls:
                with self.assertRaises(rayrep.Error):
                    call()

    def test_a_mesh_cannot_be_made_without_its_arrays(self):
        hidden = rayrep.Mesh.__new__(rayrep.Mesh)
        for call in (lambda: hidden.vertices, lambda: hidden.volume, lambda: rayrep.hollow(hidden)):
            with self.assertRaises((TypeError, ValueError, RuntimeError)):
                call()

    def test_files_that_cannot_be_read(self):
        with self.assertRaises(rayrep.InputError) as caught:
            rayrep.load("/nowhere/duck.stl")
        self.assertIn("/nowhere/duck.stl", str(caught.exception))
        with self.assertRaises(TypeError):
            rayrep.load(5)
        with self.assertRaises(TypeError):
            rayrep.hollow(BOX.vertices)
        with self.assertRaises(rayrep.UsageError):
            rayrep.load("settings.json")
        with tempfile.TemporaryDirectory() as folder:
            path = folder.encode() + b"/b\xff x.stl"
            BOX.export(path)
            mesh = rayrep.load(path)
            self.assertEqual(mesh.volume, BOX.volume)
            self.assertEqual(mesh.name.encode(errors="surrogateescape"), path)
            self.assertIn("input", rayrep.inspect(mesh).report())


class Examples(unittest.TestCase):
    def test_an_example_is_as_its_table_says(self):
        duck = rayrep.load(EXAMPLES / "duck.stl")
        self.assertEqual(len(duck.faces), 18428)
        self.assertAlmostEqual(duck.volume / 1000, 119.4, delta=0.05)
        self.assertTrue(duck.is_watertight)


if __name__ == "__main__":
    unittest.main()
