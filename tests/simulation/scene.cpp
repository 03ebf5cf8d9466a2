// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/simulation/scene.h"

#include <map>

#include "tests/support/shapes.h"
#include "tests/support/two_breasts.h"

namespace supine::testing {
namespace {

using reconstruction::Region;

meshing::Anatomy box_anatomy(const meshing::TetMesh& mesh, const Eigen::Vector3d& size_mm) {
  meshing::Anatomy a;
  a.side = "left";
  a.outward = Eigen::Vector3d::UnitZ();
  a.lateral = Eigen::Vector3d::UnitX();
  a.head = Eigen::Vector3d::UnitY();
  a.foot_centre_mm = {size_mm.x() / 2, size_mm.y() / 2, 0};
  a.foot_radius_mm = 0.3 * size_mm.x();
  a.mound_height_mm = size_mm.z();
  a.foot_fourier = Eigen::VectorXd::Constant(1, a.foot_radius_mm);
  a.q.resize(mesh.points.rows(), 2);
  for (Eigen::Index p = 0; p < mesh.points.rows(); ++p)
    a.q.row(p) = (mesh.points.row(p).transpose() - a.foot_centre_mm).head<2>().transpose() / a.foot_radius_mm;
  Eigen::Matrix<double, 2, 3> reach;
  reach.row(0) = mesh.points.colwise().minCoeff();
  reach.row(1) = mesh.points.colwise().maxCoeff();
  a.thickness_mm = mesh.points.col(2);
  a.muscle = std::make_shared<meshing::MuscleDistance>(mesh.muscle, reach);
  return a;
}

}  // namespace

meshing::TetMesh quadratic(const meshing::TetMesh& linear) {
  static constexpr int tet_edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  static constexpr int face_edges[3][2] = {{0, 1}, {1, 2}, {2, 0}};
  meshing::TetMesh mesh = linear;
  std::map<std::pair<int, int>, int> middle;
  std::vector<Eigen::RowVector3d> added;
  const auto node = [&](int a, int b) {
    const auto [place, fresh] =
        middle.try_emplace(std::minmax(a, b), static_cast<int>(linear.points.rows() + added.size()));
    if (fresh) added.push_back(0.5 * (linear.points.row(a) + linear.points.row(b)));
    return place->second;
  };
  mesh.cells.resize(linear.cells.rows(), 10);
  for (Eigen::Index c = 0; c < linear.cells.rows(); ++c) {
    mesh.cells.row(c).head<4>() = linear.cells.row(c);
    for (int e = 0; e < 6; ++e)
      mesh.cells(c, 4 + e) = node(linear.cells(c, tet_edges[e][0]), linear.cells(c, tet_edges[e][1]));
  }
  mesh.faces.resize(linear.faces.rows(), 6);
  for (Eigen::Index f = 0; f < linear.faces.rows(); ++f) {
    mesh.faces.row(f).head<3>() = linear.faces.row(f);
    for (int e = 0; e < 3; ++e)
      mesh.faces(f, 3 + e) = node(linear.faces(f, face_edges[e][0]), linear.faces(f, face_edges[e][1]));
  }
  mesh.points.conservativeResize(linear.points.rows() + static_cast<Eigen::Index>(added.size()), 3);
  for (std::size_t i = 0; i < added.size(); ++i)
    mesh.points.row(linear.points.rows() + static_cast<Eigen::Index>(i)) = added[i];
  return mesh;
}

TestScene box_scene(int n, const Eigen::Vector3d& size_mm) {
  TestScene scene{box_mesh(n, n, n, size_mm), {}};
  auto& mesh = scene.mesh;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::RowVector3d centre =
        (mesh.points.row(mesh.faces(f, 0)) + mesh.points.row(mesh.faces(f, 1)) + mesh.points.row(mesh.faces(f, 2))) / 3;
    if (centre.z() < 1e-9)
      mesh.region[f] = static_cast<int>(Region::inner);
    else if (centre.z() > size_mm.z() - 1e-9)
      mesh.region[f] = static_cast<int>(Region::skin);
    else
      mesh.region[f] = static_cast<int>(Region::cut);
  }
  scene.anatomy = box_anatomy(mesh, size_mm);
  return scene;
}

void name_parts_and_support(meshing::TetMesh& mesh) {
  mesh.part_names = {"left", "right"};
  mesh.part_fraction.resize(mesh.cells.rows(), 2);
  const double middle = (mesh.points.col(0).minCoeff() + mesh.points.col(0).maxCoeff()) / 2;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) {
    double x = 0;
    for (int k = 0; k < 4; ++k) x += mesh.points(mesh.cells(c, k), 0) / 4;
    mesh.part_fraction.row(c) << (x > middle ? 1 : 0), (x > middle ? 0 : 1);
  }
  mesh.support_names = {"clamp"};
  mesh.muscle_support = Eigen::VectorXi::Zero(mesh.muscle.triangles.rows());
}

TestScene bar_scene(double length_mm, double width_mm, int along, int across) {
  // box_mesh() holds z = 0: z becomes -x, so that the bar leaves its clamp in the direction of -x.
  meshing::TetMesh mesh = box_mesh(across, across, along, {width_mm, width_mm, length_mm});
  Eigen::Matrix3d turn;
  turn << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  mesh = moved(std::move(mesh), turn, {0, -width_mm / 2, -width_mm / 2});
  name_parts_and_support(mesh);
  TestScene scene{quadratic(mesh), {}};
  scene.anatomy = meshing::compute_anatomy(scene.mesh, "none", "undeformed");
  return scene;
}

const TestScene& two_breasts_scene() {
  static const TestScene scene = [] {
    TestScene made;
    made.mesh = two_breasts_mesh({.left_height_mm = 48, .right_height_mm = 42, .across = 22, .up = 11, .deep = 2});
    made.anatomy = meshing::compute_anatomy(made.mesh, "both");
    return made;
  }();
  return scene;
}

const TestScene& dome_scene(int order) {
  const auto make = [](int wanted) {
    DomeOptions options;
    options.rings = 5;
    options.layers = 2;
    TestScene scene{dome_mesh(options), {}};
    if (wanted == 2) scene.mesh = quadratic(scene.mesh);
    scene.anatomy = meshing::compute_anatomy(scene.mesh, "left");
    return scene;
  };
  if (order == 2) {
    static const TestScene quadratic_scene = make(2);
    return quadratic_scene;
  }
  static const TestScene linear = make(1);
  return linear;
}

simulation::Model soft_model(simulation::BulkLaw law, simulation::SkinLaw skin) {
  simulation::Model model;
  model.breast.law = law;
  model.breast.young_modulus_kpa.value = 0.8;
  model.skin.law = skin;
  model.skin.young_modulus_kpa.value = 20;
  return model;
}

}  // namespace supine::testing
