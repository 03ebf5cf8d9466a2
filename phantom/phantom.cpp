// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/phantom.h"

#include <fmt/format.h>

#include "common/error.h"
#include "meshing/topology.h"
#include "phantom/cause_prior.h"
#include "phantom/causes/cause_kind.h"
#include "phantom/solve_poses.h"
#include "phantom/solve_volunteer.h"
#include "phantom/voxels.h"

namespace supine::phantom {
namespace {

constexpr int stiffer_tries = 6;
constexpr double stiffer = 1.15;
constexpr double landmark_sigma_mm = 1.5;  // of a landmark found again in a scan

std::vector<Cause> draw_causes(const PhantomOptions& options) {
  if (options.prior) return draw_causes_from_prior(options.seed);
  std::vector<Cause> causes;
  const auto add = [&](const std::string& name, bool outside) {
    for (const Cause& known : causes)
      if (known.name == name) throw InputError(fmt::format("cause '{}' is given twice", name));
    causes.push_back(draw_cause(name, options.seed, options.size));
    if (causes.back().outside == outside) return;
    throw InputError(fmt::format("'{}' is {} the catalogue: use {}", name, outside ? "in" : "not in",
                                 outside ? "--effect" : "--outside"));
  };
  for (const std::string& name : options.effects) add(name, false);
  for (const std::string& name : options.outside) add(name, true);
  return causes;
}

Nuisances draw_nuisances(const PhantomOptions& options, const Phantom& phantom) {
  std::vector<std::string> poses;
  for (std::size_t p = 1; p < phantom.poses.size(); ++p) poses.push_back(phantom.poses[p].name);
  const auto kind = options.prior ? Nuisances::Kind::prior : Nuisances::Kind::realistic;
  return {options.seed, kind, phantom.causes, poses};
}

/// Solves; stiffens the body until every pose has an equilibrium.
void solve_stiffening(const BodyMesh& body_mesh, const PhantomOptions& options, Phantom& phantom) {
  Body body = phantom.body;
  for (int tried = 0;; ++tried) {
    try {
      return solve_poses(body_mesh, body, options, phantom);
    } catch (const NumericalFailure&) {
      if (tried == stiffer_tries) throw;
      body.breast_kpa *= stiffer;
      body.skin_kpa *= stiffer;
    }
  }
}

void solve(const BodyMesh& body_mesh, const PhantomOptions& options, Phantom& phantom) {
  const bool volunteers = options.population == Population::volunteers;
  volunteers ? solve_volunteer(body_mesh, options, phantom) : solve_stiffening(body_mesh, options, phantom);
  if (phantom.discrepancy)
    for (std::size_t p = 1; p < phantom.poses.size(); ++p)
      phantom.poses[p].x += phantom.discrepancy->displacement(phantom.poses[p].name);
}

double grown_mm(const Phantom& phantom) {
  double sum = phantom.nuisances ? phantom.nuisances->labels_grown_mm() : 0;
  for (const Cause& cause : phantom.causes)
    if (const CauseKind& kind = cause_kind(cause.name); kind.labels_grown_mm) sum += kind.labels_grown_mm(cause);
  return sum;
}

/// By what a cause moves a scan. Drawn anew for every scan but the supine one; by the catalogue it is one motion.
Placement motion_of(const Cause& given, const std::string& pose, std::uint64_t seed) {
  const bool as_given = pose == "supine" || given.by_catalogue;
  const Cause cause = as_given ? given : draw_cause(given.name, seed + 0x9e3779b9u);
  const auto v = [&cause](const char* name) { return cause.values.at(name); };
  return {{v("shift_x_mm"), v("shift_y_mm"), v("shift_z_mm")}, {v("turn_x_rad"), v("turn_y_rad"), v("turn_z_rad")}};
}

std::optional<Placement> place_of_scan(const Phantom& phantom, const std::string& pose, std::uint64_t seed) {
  std::optional<Placement> place;
  if (phantom.nuisances) place = phantom.nuisances->placement(pose);
  for (const Cause& cause : phantom.causes) {
    if (!cause_kind(cause.name).moves_scan) continue;
    const Placement motion = motion_of(cause, pose, seed);
    place = place ? after(*place, motion) : motion;
  }
  return place;
}

ScanOptions scanner_of(const PhantomOptions& options, const Phantom& phantom, const std::string& pose) {
  ScanOptions scanner{options.noise_mm, std::min(0.2, options.noise_mm)};
  if (!phantom.nuisances) return scanner;
  scanner.shared.push_back(phantom.nuisances->scan_error(pose));
  if (phantom.discrepancy) scanner.shared.push_back(phantom.discrepancy->beyond_forces(pose));
  scanner.landmarks = {landmark_sigma_mm, true};
  return scanner;
}

void scan_all(const BodyMesh& body_mesh, const PhantomOptions& options, Phantom& phantom) {
  for (std::size_t p = 1; p < phantom.poses.size(); ++p) {
    const TruthPose& pose = phantom.poses[p];
    Scan scan =
        scan_pose(body_mesh, phantom.body, pose.name, pose.x, options.seed, scanner_of(options, phantom, pose.name));
    if (const auto place = place_of_scan(phantom, pose.name, options.seed)) {
      move_scan(*place, scan);
      phantom.places[pose.name] = *place;
    }
    phantom.contents.poses.push_back({pose.name, pose.gravity, std::move(scan)});
  }
}

double volume_ml(const meshing::TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) sum += meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
  return sum / 1000;
}

/// Refuses wishes of which one leaves the other without meaning.
void check_wishes(const PhantomOptions& options) {
  const auto exclude = [](bool both, const char* first, const char* second, const char* why) {
    if (both) throw InputError(fmt::format("{} excludes {}: {}; leave one of them out", first, second, why));
  };
  constexpr const char* drawn = "it draws number, names and sizes of the effects itself";
  exclude(options.prior && options.realistic, "--prior", "--realistic", "each says how nuisances are drawn");
  exclude(options.prior && !options.effects.empty(), "--prior", "--effect", drawn);
  exclude(options.prior && !options.outside.empty(), "--prior", "--outside", drawn);
  exclude(options.prior && options.size, "--prior", "--size", drawn);
  exclude(options.size && options.effects.empty() && options.outside.empty(), "--size", "a case without causes",
          "there is nothing whose size it could be");
}

}  // namespace

void PhantomOptions::check() const {
  const auto need = [](bool good, const char* name, double value, const char* bound) {
    if (!good) throw InputError(fmt::format("{} is {}; it must lie in {}", name, value, bound));
  };
  need(noise_mm >= 0 && noise_mm <= 5, "noise_mm", noise_mm, "[0, 5]");
  need(voxel_mm >= 0.5 && voxel_mm <= 4, "voxel_mm", voxel_mm, "[0.5, 4]");
  need(rings >= 4 && rings <= 30, "rings", rings, "[4, 30]");
  need(!size || (*size >= 0 && *size <= 1), "size", size.value_or(0), "[0, 1]");
  need(order == 1 || order == 2, "order", order, "{1, 2}");
  check_wishes(*this);
  const std::size_t causes = effects.size() + outside.size(), most = realistic ? 3 : 2;
  if (causes > most)
    throw InputError(fmt::format("{} causes are asked for; a phantom has at most two, a realistic one three", causes));
}

Phantom make_phantom(const PhantomOptions& options) {
  options.check();
  Phantom phantom;
  phantom.causes = draw_causes(options);
  phantom.body = draw_body(options.seed, options.population);
  phantom.poses = truth_poses(options.tilt);
  const BodyMesh body_mesh = mesh_body(phantom.body, options.seed, options.rings, options.order);
  if (options.realistic || options.prior) phantom.nuisances = draw_nuisances(options, phantom);
  solve(body_mesh, options, phantom);
  phantom.nodes = static_cast<int>(body_mesh.mesh.points.rows());
  phantom.tetrahedra = static_cast<int>(body_mesh.mesh.cells.rows());
  phantom.volume_ml = volume_ml(body_mesh.mesh);
  phantom.rest = body_mesh.mesh.points;
  phantom.motion = measure_motion(body_mesh, phantom.body, phantom.poses[0].x, phantom.poses[1].x, options.seed);

  CaseContents& contents = phantom.contents;
  const TruthPose& prone = phantom.poses.front();
  contents.side = phantom.body.side;
  contents.noise_mm = options.noise_mm;
  contents.labels = label_voxels(body_mesh, phantom.body, prone.x, options.seed, {options.voxel_mm, grown_mm(phantom)});
  contents.prone_landmarks = mark_skin(body_mesh, phantom.body, "prone", prone.x, options.seed);
  contents.prone_gravity = prone.gravity;
  contents.real_size = phantom.body.real_size;
  scan_all(body_mesh, options, phantom);
  return phantom;
}

}  // namespace supine::phantom
