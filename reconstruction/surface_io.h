// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "reconstruction/surface.h"

namespace supine::reconstruction {

/// A surface exactly as its file gives it, before any change of frame.
struct SurfaceFile {
  Surface surface;                   ///< triangles (polygons and strips are triangulated) or bare points (#T = 0)
  std::optional<std::string> frame;  ///< "LPS" or "RAS" when the file says so
};

/// Reads .ply .stl .obj (ascii or binary) and .vtp, triangles, polygons or bare points.
///
/// A frame is declared by a comment `frame LPS` (PLY and OBJ comments, the header of an STL, also with
/// `=` or `:`) or by the string field data `frame` (VTP); `region` is the cell array of our own VTP files.
/// STL repeats its points: they are merged. Points no triangle uses are kept only where there are no triangles at all.
/// Triangles that stand twice, and points of a bare cloud that do, are read once. Lines and points of an OBJ are not
/// read. Endings may be in capitals.
/// @throws InputError  file missing, unreadable, cut short or of another kind; no points; a coordinate that is not
/// finite
///   (names the point); a triangle that names a point there is not; a frame other than LPS and RAS, or two of them in
///   one file; a declared unit other than mm; a region outside 0 to 4; triangles without any area
SurfaceFile read_surface_file(const std::filesystem::path& file);

/// Reads a surface into patient LPS, mm: one declared as RAS is turned (x and y negated), one that declares no
/// frame takes @p case_frame.
/// @param case_frame  LPS or RAS
/// @throws InputError  as read_surface_file; case_frame is neither
Surface read_surface(const std::filesystem::path& file, const std::string& case_frame = "LPS");

/// Writes a binary .vtp: points, triangles (vertices where there are none), the cell array `region` when the surface
/// carries one, field data `frame` = LPS and `unit` = mm.
/// @param more  further cell arrays by name, one value per triangle
/// @throws InputError  when the file cannot be written
void write_surface(const Surface& surface, const std::filesystem::path& file,
                   const std::map<std::string, Eigen::VectorXi>& more = {});

}  // namespace supine::reconstruction
