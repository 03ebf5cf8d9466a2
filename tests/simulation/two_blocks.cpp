// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/simulation/two_blocks.h"

#include <Eigen/Geometry>
#include <cmath>

#include "tests/support/shapes.h"

namespace supine::testing {
namespace {

using reconstruction::Region;

/// Faces of the plane z = @p height get @p region.
void set_plane(meshing::TetMesh& mesh, double height, Region region) {
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    bool on_plane = true;
    for (int corner = 0; corner < 3; ++corner)
      on_plane = on_plane && std::abs(mesh.points(mesh.faces(f, corner), 2) - height) < 1e-9;
    if (on_plane) mesh.region[f] = static_cast<int>(region);
  }
}

template <class Matrix>
Matrix stacked(const Matrix& above, const Matrix& below) {
  Matrix both(above.rows() + below.rows(), above.cols());
  both << above, below;
  return both;
}

meshing::TetMesh together(const meshing::TetMesh& a, const meshing::TetMesh& b) {
  meshing::TetMesh both = a;
  const int nodes = static_cast<int>(a.points.rows()), cells = static_cast<int>(a.cells.rows());
  both.points = stacked(a.points, b.points);
  both.cells = stacked(a.cells, Indices(b.cells.array() + nodes));
  both.tissue = stacked(a.tissue, b.tissue);
  both.fraction = stacked(a.fraction, b.fraction);
  both.faces = stacked(a.faces, Indices(b.faces.array() + nodes));
  both.region = stacked(a.region, b.region);
  both.face_cell = stacked(a.face_cell, Eigen::VectorXi(b.face_cell.array() + cells));
  return both;
}

}  // namespace

TwoBlocksScene two_blocks_scene(const TwoBlocks& blocks) {
  const int n = blocks.lower_cubes, m = blocks.upper_cubes;
  const TestScene base = box_scene(n, blocks.lower_mm);  // for its anatomy and muscle
  TestScene lower{box_mesh(n, n, std::max(1, n / 2), blocks.lower_mm), base.anatomy};
  lower.mesh.muscle = base.mesh.muscle;
  meshing::TetMesh upper = box_mesh(m, m, std::max(1, m / 2), blocks.upper_mm);
  lower.mesh.region.setConstant(static_cast<int>(Region::cut));
  upper.region.setConstant(static_cast<int>(Region::cut));
  set_plane(lower.mesh, 0, Region::inner);
  set_plane(lower.mesh, blocks.lower_mm.z(), Region::skin);
  set_plane(upper, 0, Region::skin);
  const Eigen::Vector3d middle(blocks.upper_mm.x() / 2, blocks.upper_mm.y() / 2, 0);
  const Eigen::Vector3d place(blocks.lower_mm.x() / 2, blocks.lower_mm.y() / 2, blocks.lower_mm.z() + blocks.gap_mm);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(blocks.tilt_rad, Eigen::Vector3d::UnitX()).toRotationMatrix();
  upper = moved(std::move(upper), turn, place - turn * middle);

  TwoBlocksScene scene;
  if (blocks.order == 2) {
    lower.mesh = quadratic(lower.mesh);
    upper = quadratic(upper);
  }
  scene.first_upper = lower.mesh.points.rows();
  scene.mesh = together(lower.mesh, upper);
  scene.anatomy = lower.anatomy;
  scene.anatomy.q.setZero(scene.mesh.points.rows(), 2);
  return scene;
}

}  // namespace supine::testing
