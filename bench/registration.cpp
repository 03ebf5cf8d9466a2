// SPDX-License-Identifier: AGPL-3.0-or-later
//
// Drawn misplacements of a case's scan, registered back: how far from the true place, and whether the stated 95 %
// region holds it. One line of JSON per draw; bench/registration.py makes the table.
//
//   bench_registration CASE SHAPE.vtu DRAWS SEED [TRUTH: shift and turn of the scan as given, mm and rad] [KIND]
//
// Kinds: landmarks (to 300 mm, any turn), skin (to 30 mm and 20°), support (the same as landmarks, and the scan sees
// the bare muscle sheet around the breast: rigid), rigid (the scan sees half as much and four bony points). The share
// of the skin goes from a third to all: what lies on one side of a plane through the scan.
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <random>

#include "calibration/surface_topology.h"
#include "common/error.h"
#include "common/statistics.h"
#include "pipeline/case/scan_case.h"
#include "registration/register_scan.h"

namespace supine {
namespace {

using registration::Motion;
using registration::Problem;
using registration::RigidTransform;

class Draws {
 public:
  explicit Draws(unsigned seed) : random_(seed) {}

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double normal() { return std::normal_distribution<double>()(random_); }
  Eigen::Vector3d direction() { return Eigen::Vector3d(normal(), normal(), normal()).normalized(); }

  RigidTransform misplacement(const Eigen::Vector3d& centre, double most_mm, double most_rad) {
    Motion motion;
    motion << between(0, most_mm) * direction(), between(0, most_rad) * direction();
    return registration::turned_about(centre, motion);
  }

 private:
  std::mt19937 random_;
};

/// The given share of the scan on one side of a plane.
void crop(Problem& problem, double share, Draws& draws) {
  const Eigen::VectorXd along = problem.points * draws.direction();
  const double bound = quantile({along.data(), along.data() + along.size()}, share);
  std::vector<int> kept;
  for (int p = 0; p < along.size(); ++p)
    if (along[p] <= bound) kept.push_back(p);
  problem.points = Points(problem.points(kept, Eigen::all));
  problem.normals = Points(problem.normals(kept, Eigen::all));
}

/// Points of the support beyond the skin, as a scanner would see them.
void see_support(Problem& problem, const calibration::SurfaceDistance& support,
                 const calibration::SurfaceDistance& skin, Draws& draws) {
  calibration::ClosestPoints closest;
  skin.closest(support.points(), closest);
  std::vector<int> bare;
  for (int p = 0; p < support.points().rows(); ++p)
    if (closest.on_border[p] && closest.distance_mm[p] < 30) bare.push_back(p);
  const Eigen::Index before = problem.points.rows(), more = static_cast<Eigen::Index>(bare.size());
  problem.points.conservativeResize(before + more, Eigen::NoChange);
  problem.normals.conservativeResize(before + more, Eigen::NoChange);
  for (Eigen::Index b = 0; b < more; ++b) {
    const Eigen::Vector3d normal = support.normals().row(bare[b]);
    problem.normals.row(before + b) = normal;
    problem.points.row(before + b) =
        support.points().row(bare[b]) + (problem.noise_mm * draws.normal() * normal).transpose();
  }
}

/// Four bony points around the body, picked to 1 mm.
void see_bone(Problem& problem, const calibration::SurfaceDistance& support, Draws& draws) {
  problem.landmarks.clear();
  for (int l = 0; l < 4; ++l) {
    Eigen::Index furthest = 0;
    (support.points() * draws.direction()).maxCoeff(&furthest);
    const Eigen::Vector3d place = support.points().row(furthest).transpose() + 20 * draws.direction();
    problem.landmarks.push_back({fmt::format("bone{}", l),
                                 place + Eigen::Vector3d(draws.normal(), draws.normal(), draws.normal()), place,
                                 Eigen::Vector3d::Zero(), 1.0, true});
  }
}

void misplace(Problem& problem, const RigidTransform& by) {
  problem.points = by.apply(problem.points);
  problem.normals = by.apply_to_directions(problem.normals);
  for (registration::Landmark& l : problem.landmarks) l.scan = by.at(l.scan);
}

/// How far two placements of the scan are apart.
struct Off {
  double rms_mm, turn_deg;
};
Off off(const Points& points, const RigidTransform& found, const RigidTransform& truth) {
  const Eigen::VectorXd apart = (found.apply(points) - truth.apply(points)).rowwise().norm();
  const double turn = Eigen::AngleAxisd(found.rotation.transpose() * truth.rotation).angle();
  return {std::sqrt(apart.squaredNorm() / static_cast<double>(apart.size())), turn * 180 / std::acos(-1.0)};
}

void print(const std::string& name, const std::string& kind, double share, const registration::Registration& found,
           const Off& given, const Off& error, double distance, double seconds) {
  const auto& covariance = found.fit.covariance;
  fmt::print(
      "{{\"case\":\"{}\",\"kind\":\"{}\",\"share\":{:.3f},\"given_mm\":{:.3f},\"error_mm\":{:.3f},\"turn_deg\":{:.3f},"
      "\"mahalanobis2\":{:.3f},\"inside\":{},\"sd_mm\":{:.3f},\"sd_deg\":{:.3f},\"before_mm\":{:.2f},"
      "\"after_mm\":{:.2f},\"overlap\":{:.3f},\"misfit_mm\":{:.2f},\"effective\":{:.1f},\"others\":{},"
      "\"worse_said\":{},\"given_inside\":{},\"seconds\":{:.2f}}}\n",
      name, kind, share, given.rms_mm, error.rms_mm, error.turn_deg, distance,
      distance <= chi_squared_quantile(6, 0.95), std::sqrt(covariance.topLeftCorner<3, 3>().trace()),
      std::sqrt(covariance.bottomRightCorner<3, 3>().trace()) * 180 / std::acos(-1.0), found.before_mm, found.after_mm,
      found.overlap, found.fit.misfit_mm, found.fit.effective_points, found.other_places, found.worse_than_given(),
      found.given_inside, seconds);
  std::fflush(stdout);
}

struct Body {
  const pipeline::ScanCase& in;
  const calibration::SurfaceDistance support;
  RigidTransform truth;  ///< scan as given → image
  std::string name;
};

void one(const Body& body, const std::string& kind, unsigned seed) {
  Draws draws(seed);
  Problem problem = body.in.problem;
  const double share = draws.between(1.0 / 3, 1);
  crop(problem, share, draws);
  problem.points = body.truth.apply(problem.points);
  problem.normals = body.truth.apply_to_directions(problem.normals);
  for (registration::Landmark& l : problem.landmarks) l.scan = body.truth.at(l.scan);
  if (kind == "support") {
    see_support(problem, body.support, *body.in.problem.target.skin, draws);
    problem.target.rigid = &body.support;
  }
  if (kind == "rigid") see_bone(problem, body.support, draws);
  if (kind == "skin") problem.landmarks.clear();
  const Eigen::Vector3d centre = problem.points.colwise().mean();
  const double pi = std::acos(-1.0);
  const RigidTransform by =
      kind == "skin" ? draws.misplacement(centre, 30, pi / 9) : draws.misplacement(centre, 300, pi);
  misplace(problem, by);
  const auto start = std::chrono::steady_clock::now();
  try {
    const auto found = registration::register_scan(problem, {}, true, "the scan");
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    print(body.name, kind, share, found, off(problem.points, {}, by.inverse()),
          off(problem.points, found.fit.transform, by.inverse()),
          registration::mahalanobis_squared(found.fit, by.inverse()), took.count());
  } catch (const InputError& error) {
    fmt::print("{{\"case\":\"{}\",\"kind\":\"{}\",\"share\":{:.3f},\"refused\":\"{}\"}}\n", body.name, kind, share,
               error.what());
  }
}

int run(int argc, char** argv) {
  const pipeline::Case description = pipeline::read_case(argv[1]);
  const std::filesystem::path shape = argv[2];
  const pipeline::ScanCase in = pipeline::read_scan_case(description, description.pose(shape.stem().string()), shape);
  const int draws = std::atoi(argv[3]);
  const unsigned seed = static_cast<unsigned>(std::atoi(argv[4]));
  RigidTransform truth;
  if (argc >= 11) {
    Motion motion;
    for (int k = 0; k < 6; ++k) motion[k] = std::atof(argv[5 + k]);
    truth = registration::turned_about(in.scan.points.colwise().mean(), motion).inverse();
  }
  const meshing::TetMesh& mesh = in.predicted.mesh;
  const Body body{in, {mesh.muscle.points, mesh.muscle.triangles}, truth, description.name};
  const std::string kinds[] = {"landmarks", "skin", "support", "rigid"};
  const std::string only = argc % 2 == 0 ? argv[argc - 1] : "";
  for (int draw = 0; draw < draws; ++draw)
    if (only.empty() || only == kinds[draw % 4]) one(body, kinds[draw % 4], seed + static_cast<unsigned>(draw));
  return 0;
}

}  // namespace
}  // namespace supine

int main(int argc, char** argv) {
  if (argc != 5 && argc != 6 && argc != 11 && argc != 12) {
    fmt::print(stderr, "bench_registration CASE SHAPE.vtu DRAWS SEED [TX TY TZ RX RY RZ] [KIND]\n");
    return 2;
  }
  try {
    return supine::run(argc, argv);
  } catch (const supine::Error& error) {
    fmt::print(stderr, "bench_registration: {}\n", error.what());
    return 2;
  }
}
