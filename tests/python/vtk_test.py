# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine.vtk: objects of VTK over the same memory. Skipped (77) where there is no python3-vtk9."""

import gc
import sys
import unittest

import supine
import numpy as np
from support import SmallCase

try:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    import supine.vtk
except ImportError as absent:
    print(f"skipped: {absent}")
    sys.exit(77)


def address(array):
    return array.__array_interface__["data"][0]


class Vtk(SmallCase):
    def test_a_shape_is_shared_and_outlives_its_simulation(self):
        found = supine.simulate(self.case, self.mesh, self.model, poses=["supine"])
        moved = found["supine"] - self.mesh.points
        grid = supine.vtk.grid(self.mesh, found["supine"], displacement_mm=moved)
        self.assertEqual(address(vtk_to_numpy(grid.GetPoints().GetData())), address(found["supine"]))
        expected = found["supine"].copy()
        del found, moved
        gc.collect()
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPoints().GetData()), expected)
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetPointData().GetArray("displacement_mm")),
                                      expected - self.mesh.points)

    def test_cells_are_shared_and_those_of_the_mesh(self):
        grid = supine.vtk.grid(self.mesh)
        self.assertEqual(grid.GetNumberOfCells(), len(self.mesh.cells))
        connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        self.assertEqual(address(connectivity), address(self.mesh.cells))
        last = [grid.GetCell(grid.GetNumberOfCells() - 1).GetPointId(i) for i in range(self.mesh.cells.shape[1])]
        self.assertEqual(last, list(self.mesh.cells[-1]))
        np.testing.assert_array_equal(vtk_to_numpy(grid.GetCellData().GetArray("tissue")), self.mesh.tissue)

    def test_the_skin_has_its_faces_long_after_what_they_were_made_from(self):
        faces = self.mesh.faces[self.mesh.region == 2][:, :3].copy()
        skins = [supine.vtk.skin(self.mesh) for _ in range(20)]
        gc.collect()
        spent = [np.full_like(faces, 10 ** 9) for _ in range(40)]  # what was freed is written over
        for skin in skins:
            self.assertEqual(skin.GetNumberOfPolys(), len(faces))
            cells = skin.GetPolys()
            np.testing.assert_array_equal(vtk_to_numpy(cells.GetConnectivityArray()).reshape(-1, 3), faces)
            np.testing.assert_array_equal(vtk_to_numpy(cells.GetOffsetsArray()), np.arange(0, faces.size + 1, 3))
        del spent


if __name__ == "__main__":
    unittest.main()
