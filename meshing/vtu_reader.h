// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "meshing/mesh_io.h"

namespace supine::meshing {

/// A .vtu file of tetrahedra and boundary triangles, opened; see mesh_io.h for what it must hold.
class VtuReader {
 public:
  /// @throws InputError  not there, not a readable .vtu, another frame or unit
  explicit VtuReader(const std::filesystem::path& file);
  ~VtuReader();

  Points positions() const;
  /// The mesh at the file's positions minus @p displacement (#N by 3; empty = none), checked as a whole.
  TetMesh mesh(const Table& displacement = {}) const;
  std::optional<std::string> text(const std::string& field) const;  ///< string field data
  /// @throws InputError  no such array, or another number of components
  Table point_array(const std::string& name, int components) const;
  NamedTables point_arrays() const;

 private:
  struct Grid;
  Table cell_column(const std::string& name) const;
  Indices nodes_of(long long cell, int wanted) const;  ///< 1 by wanted
  void read_muscle(TetMesh& mesh) const;
  void read_topology(TetMesh& mesh) const;
  void read_tissue(TetMesh& mesh) const;
  void read_parts(TetMesh& mesh) const;
  void read_supports(TetMesh& mesh) const;
  std::vector<std::string> texts(const std::string& field) const;  // string field data; none where there is no such

  std::filesystem::path file_;
  std::unique_ptr<Grid> grid_;
};

}  // namespace supine::meshing
