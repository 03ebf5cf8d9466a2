// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/arrays.h"
#include "meshing/tet_mesh.h"

namespace supine::meshing {

/// Named arrays of a file: one row per point, or per cell.
using NamedTables = std::vector<std::pair<std::string, Table>>;

/// Writes @p mesh as .vtu: the tetrahedra, then the boundary triangles, as cells of one grid (linear or quadratic,
/// VTK node order). Cell arrays `tissue` (-1 on triangles), `fraction_<tissue>` of the meshed tissues, `region`
/// (0 on tetrahedra); field data `frame` = LPS, `unit` = mm, `tissue_names`, `region_names`, the muscle sheet as
/// `muscle_points_mm` (#P by 3) and `muscle_triangles` (#T by 3), and `side` when @p side is not empty. Of a mesh with
/// named parts and supports also cell arrays `part_<name>` and `support` (-1 where there is none), field data
/// `part_names`, `support_names` and `muscle_support` (#T).
/// The same mesh gives the same bytes.
/// @throws InputError  when the file cannot be written
void write_mesh(const TetMesh& mesh, const std::filesystem::path& file, const std::string& side = {});

/// Reads what write_mesh() wrote (of a pose file: the shape in that pose).
/// @throws InputError  naming the file: not readable, another frame or unit, no tetrahedra, mixed orders, a missing
///   array, an inverted tetrahedron (id, volume, place), faces that are not the whole boundary, a value out of range
TetMesh read_mesh(const std::filesystem::path& file);

/// `left`, `right` or `both` as write_mesh() stored it; empty when the file names none.
std::string read_side(const std::filesystem::path& file);

/// Writes a pose: the grid of write_mesh() with its points at @p positions, point array `displacement_mm`
/// (position - prone), the given arrays, and field data `pose` when @p pose is not empty.
/// @param mesh          imaged (prone) mesh
/// @param positions     #N by 3, mm
/// @param point_arrays  #N rows each
/// @param cell_arrays   #C rows each (NaN is written on the triangles), or #C + #F rows (tetrahedra, then triangles)
/// @param pose          name of the pose
/// @throws InputError  when the file cannot be written or a table has the wrong number of rows
void write_pose(const TetMesh& mesh, const Points& positions, const NamedTables& point_arrays,
                const NamedTables& cell_arrays, const std::filesystem::path& file, const std::string& side = {},
                const std::string& pose = {});

/// A pose as read: the imaged mesh and where its points are in the pose.
struct PoseMesh {
  TetMesh mesh;              ///< points in the imaged (prone) shape
  Points positions;          ///< #N by 3, mm
  NamedTables point_arrays;  ///< all but displacement_mm
};

/// Reads what write_pose() wrote.
/// @param wanted  the pose that the file must show, if it names one; empty: any
/// @throws InputError  as read_mesh(); no `displacement_mm`; another pose
PoseMesh read_pose(const std::filesystem::path& file, const std::string& wanted = {});

}  // namespace supine::meshing
