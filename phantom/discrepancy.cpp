// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/discrepancy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "phantom/face_grid.h"
#include "phantom/random.h"
#include "simulation/solve/linear_solver.h"

namespace supine::phantom {
namespace {

using reconstruction::Region;
constexpr int centres_per_surface = 60;
constexpr double length_mm = 25, share_beyond_forces = 0.1;
constexpr double least_scale_mm = 0.3, share_of_way = 0.01, most_mm = 10;
constexpr int draws_for_scale = 48;  // the mean square is then known to a tenth

/// Faces of a mesh with what integrals over them need.
struct Patchwork {
  Indices faces;  // their nodes
  Points middle, normal;
  Eigen::VectorXd area;

  Patchwork(const meshing::TetMesh& mesh, Region region, const Points& x) {
    faces = mesh.faces(faces_with(mesh, static_cast<int>(region)), Eigen::all);
    middle.resize(faces.rows(), 3);
    normal.resize(faces.rows(), 3);
    area.resize(faces.rows());
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      const Eigen::RowVector3d a = x.row(faces(f, 0)), b = x.row(faces(f, 1)), c = x.row(faces(f, 2));
      const Eigen::RowVector3d twice = (b - a).cross(c - a);
      middle.row(f) = (a + b + c) / 3;
      area[f] = 0.5 * twice.norm();
      normal.row(f) = twice.normalized();
    }
  }
};

/// Spread over the rows: each the furthest from those before.
Points spread_centres(const Points& points, int count) {
  Points chosen(count, 3);
  Eigen::VectorXd distance = (points.rowwise() - points.colwise().mean()).rowwise().norm();
  Eigen::Index next = 0;
  distance.minCoeff(&next);
  distance.setConstant(1e300);
  for (int k = 0; k < count; ++k) {
    chosen.row(k) = points.row(next);
    distance = distance.cwiseMin((points.rowwise() - chosen.row(k)).rowwise().norm());
    distance.maxCoeff(&next);
  }
  return chosen;
}

/// Bumps on one surface of the stress-free body.
struct Bumps {
  Patchwork surface;
  Points centres;
  Eigen::MatrixXd weight;  // face by centre

  Bumps(const meshing::TetMesh& mesh, Region region) : surface(mesh, region, mesh.points) {
    centres =
        spread_centres(surface.middle, std::min<int>(centres_per_surface, static_cast<int>(surface.faces.rows())));
    const double width = 0.5 * std::sqrt(surface.area.sum() / static_cast<double>(centres.rows()));
    weight.resize(surface.faces.rows(), centres.rows());
    for (Eigen::Index c = 0; c < centres.rows(); ++c)
      weight.col(c) =
          (-0.5 / (width * width) * (surface.middle.rowwise() - centres.row(c)).rowwise().squaredNorm()).array().exp();
  }

  /// Adds the forces on the nodes, 3 per node, of what is drawn from the streams; each has its share of the variance.
  void add(std::uint64_t seed, const std::vector<std::string>& streams, Eigen::VectorXd& force) const {
    Points amplitude = Points::Zero(centres.rows(), 3);
    const double sd = std::sqrt(1 / static_cast<double>(streams.size()));
    for (const std::string& stream : streams)
      for (int axis = 0; axis < 3; ++axis)
        amplitude.col(axis) += RandomField(seed, stream + "xyz"[axis], sd, length_mm).over(centres);
    const Points traction = surface.area.asDiagonal() * (weight * amplitude);
    // A constant traction pulls on the corners of a straight triangle, on the middles of the edges of a curved one.
    const int first = surface.faces.cols() == 6 ? 3 : 0;
    for (Eigen::Index f = 0; f < traction.rows(); ++f)
      for (int a = first; a < first + 3; ++a)
        force.segment<3>(3 * surface.faces(f, a)) += traction.row(f).transpose() / 3;
  }
};

/// What forces move a body by in a pose.
class Response {
 public:
  Response(const simulation::Mechanics& mechanics, const Points& rest, const TruthPose& pose)
      : sums_(mechanics.pattern()), solver_(sums_.tangent) {
    mechanics.evaluate({pose.x, rest, 1.0}, {.energy = false, .tangent = true}, sums_);
    if (!solver_.factorise(sums_.tangent))
      throw NumericalFailure("the tangent of the phantom is singular in " + pose.name + "; take another seed");
  }

  Points to(const Eigen::VectorXd& force) const {
    const Eigen::VectorXd moved = solver_.solve(force);
    return Eigen::Map<const Points>(moved.data(), moved.size() / 3, 3);
  }

 private:
  simulation::Sums sums_;
  simulation::LuSolver solver_;
};

/// How far the middles of the faces move along their normals.
Eigen::VectorXd along_normal(const Patchwork& surface, const Points& moved) {
  Eigen::VectorXd along = Eigen::VectorXd::Zero(surface.faces.rows());
  for (Eigen::Index f = 0; f < along.size(); ++f)
    for (int a = 0; a < 3; ++a) along[f] += moved.row(surface.faces(f, a)).dot(surface.normal.row(f)) / 3;
  return along;
}

double mean_square(const Patchwork& surface, const Eigen::VectorXd& values) {
  return surface.area.dot(values.cwiseAbs2()) / surface.area.sum();
}

double scale_mm(const std::vector<TruthPose>& poses) {
  const Points way = poses[1].x - poses[0].x;
  return std::max(least_scale_mm, share_of_way * std::sqrt(way.squaredNorm() / static_cast<double>(way.rows())));
}

}  // namespace

double half_cauchy(std::uint64_t seed, double scale, double most) {
  Random random(seed, "half-Cauchy");
  for (;;) {
    const double value = scale * std::tan(0.5 * std::numbers::pi * random.uniform());
    if (value <= most) return value;
  }
}

Discrepancy::Discrepancy(Truth& truth, const BodyMesh& body_mesh, const std::vector<TruthPose>& poses,
                         std::uint64_t seed)
    : seed_(seed), size_mm_(half_cauchy(seed, scale_mm(poses), most_mm)) {
  const Bumps skin(body_mesh.mesh, Region::skin), inner(body_mesh.mesh, Region::inner);
  const auto forces = [&](const std::string& draw, const std::string& pose) {
    Eigen::VectorXd force = Eigen::VectorXd::Zero(body_mesh.mesh.points.size());
    skin.add(seed, {"forces on the skin " + draw, "forces on the skin " + draw + pose}, force);
    inner.add(seed, {"forces within " + draw, "forces within " + draw + pose}, force);
    return force;
  };
  double variance = 0;
  for (std::size_t p = 1; p < poses.size(); ++p) {
    const Response response(truth.in(poses[p]), body_mesh.mesh.points, poses[p]);
    const Patchwork surface(body_mesh.mesh, Region::skin, poses[p].x);
    for (int k = 0; k < draws_for_scale; ++k) {
      const Points moved = response.to(forces("for scale " + std::to_string(k), poses[p].name));
      variance += mean_square(surface, along_normal(surface, moved)) / draws_for_scale;
    }
    displacement_[poses[p].name] = response.to(forces("", poses[p].name));
  }
  variance /= static_cast<double>(poses.size() - 1);
  for (std::size_t p = 1; p < poses.size(); ++p) {
    const std::string& name = poses[p].name;
    displacement_[name] *= size_mm_ * std::sqrt((1 - share_beyond_forces) / variance);
    const Patchwork surface(body_mesh.mesh, Region::skin, poses[p].x);
    rms_mm_[name] = std::sqrt(
        mean_square(surface, along_normal(surface, displacement_[name]) + beyond_forces(name).over(surface.middle)));
  }
}

RandomField Discrepancy::beyond_forces(const std::string& pose) const {
  return {seed_, "beyond forces " + pose, size_mm_ * std::sqrt(share_beyond_forces), length_mm};
}

}  // namespace supine::phantom
