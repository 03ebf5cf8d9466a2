// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/warp/two_shapes.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "meshing/topology.h"
#include "tests/support/shapes.h"

namespace supine::warp::testing {
namespace {

constexpr double size_mm = 40;

Eigen::Matrix3d matrix() {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  return turn * Eigen::Vector3d(1.1, 0.9, 1.05).asDiagonal();
}
const Eigen::Vector3d shift(7, -4, 3);

}  // namespace

MovedBox moved_box(int order, const Map& map) {
  MovedBox box{supine::testing::box_mesh(3, 3, 3, Eigen::Vector3d::Constant(size_mm)), {}};
  if (order == 2) box.mesh = meshing::to_quadratic(box.mesh);
  box.target = box.mesh.points;
  for (Eigen::Index p = 0; p < box.target.rows(); ++p)
    box.target.row(p) = map(box.mesh.points.row(p).transpose()).transpose();
  return box;
}

Eigen::Vector3d affine(const Eigen::Vector3d& x) { return matrix() * x + shift; }

Eigen::Vector3d affine_back(const Eigen::Vector3d& x) { return matrix().inverse() * (x - shift); }

Eigen::Vector3d bent(const Eigen::Vector3d& x) {
  const Eigen::Vector3d u = x / size_mm;
  return x + Eigen::Vector3d(6 * u.y() * u.z() - 4 * u.z() * u.z(), 5 * u.x() * u.x() - 3 * u.x() * u.y(),
                             9 * u.x() * (1 - u.x()) + 7 * u.y() * u.y());
}

segmentation::GreyImage volume_of(const segmentation::Grid& grid,
                                  const std::function<double(const Eigen::Vector3d&)>& f) {
  segmentation::GreyImage image{grid, std::vector<float>(grid.count())};
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        image.at(i, j, k) = static_cast<float>(f(grid.point(Eigen::Vector3d(i, j, k))));
  return image;
}

segmentation::Grid grid_over(const Eigen::Vector3d& low, double length_mm, double spacing_mm) {
  segmentation::Grid grid;
  grid.spacing_mm.setConstant(spacing_mm);
  grid.size.setConstant(static_cast<int>(length_mm / spacing_mm) + 1);
  grid.direction = Eigen::AngleAxisd(0.2, Eigen::Vector3d(2, -1, 1).normalized()).toRotationMatrix();
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * length_mm);
  grid.origin_mm = low + half - grid.direction * half;
  return grid;
}

}  // namespace supine::warp::testing
