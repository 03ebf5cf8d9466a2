// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/phantom.h"

#include <fmt/format.h>

#include "common/error.h"
#include "meshing/topology.h"
#include "phantom/causes/cause_kind.h"
#include "phantom/voxels.h"

namespace supine::phantom {
namespace {

constexpr int stiffer_tries = 6;
constexpr double stiffer = 1.15;

std::vector<Cause> draw_causes(const PhantomOptions& options) {
  std::vector<Cause> causes;
  const auto add = [&](const std::string& name, bool outside) {
    for (const Cause& known : causes)
      if (known.name == name) throw InputError(fmt::format("cause '{}' is given twice", name));
    causes.push_back(draw_cause(name, options.seed));
    if (causes.back().outside == outside) return;
    throw InputError(fmt::format("'{}' is {} the catalogue: use {}", name, outside ? "in" : "not in",
                                 outside ? "--effect" : "--outside"));
  };
  for (const std::string& name : options.effects) add(name, false);
  for (const std::string& name : options.outside) add(name, true);
  return causes;
}

// Stiffens the body until every pose has an equilibrium.
void solve_stiffening(const BodyMesh& body_mesh, Phantom& phantom) {
  for (int tried = 0;; ++tried) {
    try {
      return solve_truth(body_mesh, phantom.body, phantom.causes, phantom.poses);
    } catch (const NumericalFailure&) {
      if (tried == stiffer_tries) throw;
      phantom.body.breast_kpa *= stiffer;
      phantom.body.skin_kpa *= stiffer;
    }
  }
}

double grown_mm(const std::vector<Cause>& causes) {
  double sum = 0;
  for (const Cause& cause : causes)
    if (const CauseKind& kind = cause_kind(cause.name); kind.labels_grown_mm) sum += kind.labels_grown_mm(cause);
  return sum;
}

double volume_ml(const meshing::TetMesh& mesh) {
  double sum = 0;
  for (Eigen::Index c = 0; c < mesh.cells.rows(); ++c) sum += meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
  return sum / 1000;
}

}  // namespace

void PhantomOptions::check() const {
  const auto need = [](bool good, const char* name, double value, const char* bound) {
    if (!good) throw InputError(fmt::format("{} is {}; it must lie in {}", name, value, bound));
  };
  need(noise_mm >= 0 && noise_mm <= 5, "noise_mm", noise_mm, "[0, 5]");
  need(voxel_mm >= 0.5 && voxel_mm <= 4, "voxel_mm", voxel_mm, "[0.5, 4]");
  need(rings >= 4 && rings <= 30, "rings", rings, "[4, 30]");
  need(order == 1 || order == 2, "order", order, "{1, 2}");
  const std::size_t causes = effects.size() + outside.size();
  if (causes > 2) throw InputError(fmt::format("{} causes are asked for; a phantom has at most two", causes));
}

Phantom make_phantom(const PhantomOptions& options) {
  options.check();
  Phantom phantom;
  phantom.causes = draw_causes(options);
  phantom.body = draw_body(options.seed);
  phantom.poses = truth_poses(options.tilt);
  const BodyMesh body_mesh = mesh_body(phantom.body, options.seed, options.rings, options.order);
  solve_stiffening(body_mesh, phantom);
  phantom.nodes = static_cast<int>(body_mesh.mesh.points.rows());
  phantom.tetrahedra = static_cast<int>(body_mesh.mesh.cells.rows());
  phantom.volume_ml = volume_ml(body_mesh.mesh);
  phantom.rest = body_mesh.mesh.points;

  CaseContents& contents = phantom.contents;
  const TruthPose& prone = phantom.poses.front();
  contents.side = phantom.body.side;
  contents.noise_mm = options.noise_mm;
  contents.labels =
      label_voxels(body_mesh, phantom.body, prone.x, options.seed, {options.voxel_mm, grown_mm(phantom.causes)});
  contents.prone_landmarks = mark_skin(body_mesh, phantom.body, "prone", prone.x, options.seed);
  contents.prone_gravity = prone.gravity;
  const ScanOptions scanner{options.noise_mm, std::min(0.2, options.noise_mm)};
  for (std::size_t p = 1; p < phantom.poses.size(); ++p) {
    const TruthPose& pose = phantom.poses[p];
    contents.poses.push_back(
        {pose.name, pose.gravity,
         scan_pose(body_mesh, phantom.body, pose.name, pose.x, phantom.causes, options.seed, scanner)});
  }
  return phantom;
}

}  // namespace supine::phantom
