# SPDX-License-Identifier: AGPL-3.0-or-later
"""Meshes and shapes as objects of VTK, which share their memory with the arrays of supine. Needs python3-vtk9."""

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import (VTK_QUADRATIC_TETRA, VTK_TETRA, vtkCellArray, vtkPolyData,
                                           vtkUnstructuredGrid)


def _shared(array, name=None):
    """The array for VTK, without a copy where its memory is in rows; VTK keeps the array alive."""
    shared = numpy_to_vtk(np.ascontiguousarray(array), deep=False)
    if name is not None:
        shared.SetName(name)
    return shared


def _points(positions):
    points = vtkPoints()
    points.SetData(_shared(positions))
    return points


def _cells(corners):
    corners = np.ascontiguousarray(corners)
    offsets = np.arange(0, corners.size + 1, corners.shape[1], dtype=corners.dtype)
    cells = vtkCellArray()
    cells.SetData(_shared(offsets), _shared(corners.reshape(-1)))
    # It holds shallow copies of the two, which do not keep the memory alive.
    cells._numpy_reference = (offsets, corners)
    return cells


def _add(attributes, arrays):
    for name, array in arrays.items():
        attributes.AddArray(_shared(array, name))


def grid(mesh, positions=None, **point_arrays):
    """The tetrahedra as vtkUnstructuredGrid, with the cell array `tissue`.

    positions: N by 3, mm, a shape of the mesh; default its imaged one. point_arrays: N numbers or N by k.
    """
    made = vtkUnstructuredGrid()
    made.SetPoints(_points(mesh.points if positions is None else positions))
    made.SetCells(VTK_TETRA if mesh.order == 1 else VTK_QUADRATIC_TETRA, _cells(mesh.cells))
    made.GetCellData().AddArray(_shared(mesh.tissue, "tissue"))
    _add(made.GetPointData(), point_arrays)
    return made


def skin(mesh, positions=None, **point_arrays):
    """The skin as vtkPolyData; of a quadratic mesh its corners. Points are those of the whole mesh."""
    faces = mesh.faces[mesh.region == 2][:, :3]
    made = vtkPolyData()
    made.SetPoints(_points(mesh.points if positions is None else positions))
    made.SetPolys(_cells(faces))
    _add(made.GetPointData(), point_arrays)
    return made
