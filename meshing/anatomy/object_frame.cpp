// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/object_frame.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "common/error.h"
#include "meshing/supports.h"
#include "meshing/surface/triangle_tree.h"
#include "meshing/topology.h"

namespace supine::meshing {
namespace {

using reconstruction::Region;

struct Skin {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // ∫ (p - centroid)(p - centroid)ᵀ dA
};

Skin skin_of(const TetMesh& mesh) {
  Skin skin;
  double area = 0;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (mesh.region[f] != static_cast<int>(Region::skin)) continue;
    const Eigen::Vector3d at = face_point(mesh.points, mesh.faces, f, 1.0 / 3, 1.0 / 3);
    const double a = face_area_mm2(mesh.points, mesh.faces, f);
    area += a;
    skin.centroid += a * at;
    second += a * at * at.transpose();
  }
  if (area == 0)
    throw InputError("the mesh has no boundary triangles of region skin; everything lies on supports or cuts");
  skin.centroid /= area;
  skin.scatter = second - area * skin.centroid * skin.centroid.transpose();
  return skin;
}

void set_directions(Anatomy& frame, const TetMesh& mesh, const Skin& skin) {
  Eigen::Vector3d on_supports = Eigen::Vector3d::Zero(), outward = Eigen::Vector3d::Zero();
  double area = 0;
  for (Eigen::Index t = 0; t < mesh.muscle.triangles.rows(); ++t) {
    const Eigen::Vector3d a = mesh.muscle.points.row(mesh.muscle.triangles(t, 0)),
                          b = mesh.muscle.points.row(mesh.muscle.triangles(t, 1)),
                          c = mesh.muscle.points.row(mesh.muscle.triangles(t, 2));
    const Eigen::Vector3d vector_area = (b - a).cross(c - a) / 2;
    outward += vector_area;
    on_supports += vector_area.norm() * (a + b + c) / 3;
    area += vector_area.norm();
  }
  on_supports /= area;
  const Eigen::Vector3d away = skin.centroid - on_supports;
  frame.outward = (outward.norm() > 1e-6 * area ? outward : away).normalized();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(skin.scatter);
  frame.lateral = principal.eigenvectors().col(2);
  if (frame.lateral.dot(away) < 0) frame.lateral = -frame.lateral;
  frame.head = principal.eigenvectors().col(1);
  Eigen::Index most = 0;
  frame.head.cwiseAbs().maxCoeff(&most);
  if (frame.head[most] < 0) frame.head = -frame.head;
}

void set_points(Anatomy& frame, const TetMesh& mesh) {
  const Eigen::Index count = mesh.points.rows();
  const Points from_centre = mesh.points.rowwise() - frame.foot_centre_mm.transpose();
  const Eigen::VectorXd along = from_centre * frame.lateral, across = from_centre * frame.head;
  frame.foot_radius_mm = along.cwiseAbs().maxCoeff();
  frame.foot_fourier = Eigen::VectorXd::Constant(1, frame.foot_radius_mm);
  frame.q.resize(count, 2);
  frame.q << along / frame.foot_radius_mm, across / frame.foot_radius_mm;
  frame.thickness_mm = TriangleTree(mesh.muscle.points, mesh.muscle.triangles).distances_mm(mesh.points);
  frame.mound_height_mm = frame.thickness_mm.maxCoeff();
  frame.muscle_normal.resize(count, 3);
  for (Eigen::Index i = 0; i < count; ++i)
    frame.muscle_normal.row(i) = frame.muscle->at(mesh.points.row(i).transpose()).gradient.normalized().transpose();
}

}  // namespace

Anatomy object_frame(const TetMesh& mesh, const std::string& imaged_pose) {
  if (mesh.muscle.triangles.rows() == 0)
    throw InputError("the mesh has no boundary triangles of region inner: nothing holds the body; give it a support");
  Anatomy frame;
  frame.side = "none";
  frame.imaged_pose = imaged_pose;
  Eigen::Matrix<double, 2, 3> box;
  box << mesh.points.colwise().minCoeff(), mesh.points.colwise().maxCoeff();
  const std::size_t supports = std::max<std::size_t>(1, mesh.support_names.size());
  for (std::size_t s = 0; s < supports; ++s)
    frame.supports.push_back(std::make_shared<const MuscleDistance>(sheet_of(mesh, static_cast<int>(s)), box));
  frame.muscle = frame.supports.front();
  const Skin skin = skin_of(mesh);
  set_directions(frame, mesh, skin);
  frame.foot_centre_mm = skin.centroid;
  set_points(frame, mesh);
  return frame;
}

}  // namespace supine::meshing
