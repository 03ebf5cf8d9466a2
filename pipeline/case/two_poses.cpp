// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/two_poses.h"

#include <fmt/format.h>

#include "common/error.h"
#include "meshing/topology.h"
#include "pipeline/case/shape_gravity.h"
#include "pipeline/tool/lineage.h"
#include "simulation/solve/folds.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

meshing::PoseMesh read_shape(Run& run, const Case& measured, const fs::path& folder, const std::string& pose) {
  if (pose != "undeformed") measured.pose(pose);
  const fs::path file = folder / (pose + ".vtu");
  if (!fs::exists(file))
    throw InputError(
        fmt::format("{} is not there: the shape in pose '{}' was not computed; run make CASE={} simulate, "
                    "or name the folder of the shapes with --dir",
                    file.string(), pose, measured.folder.string()));
  if (pose != "undeformed") check_gravity(file, measured.pose(pose));
  return meshing::read_pose(run.input(file), pose);
}

/// Shapes of two models do not belong together, even on one mesh. What a sidecar does not say is not asked.
void check_one_model(const fs::path& folder, const std::string& from, const std::string& to) {
  const auto a = input_hashes(folder / (from + ".vtu"), "model.toml"),
             b = input_hashes(folder / (to + ".vtu"), "model.toml");
  if (a.empty() || b.empty() || a == b) return;
  throw InputError(
      fmt::format("{0}.vtu and {1}.vtu in {2} were computed with two states of model.toml; simulate both "
                  "again",
                  from, to, folder.string()));
}

void warn_of_inverted(Run& run, const Indices& cells, const Points& shape, const std::string& pose) {
  if (cells.cols() == 10) {
    if (const auto folds = simulation::find_folds(cells, shape); folds.cells > 0)
      run.warn(simulation::folds_warning(pose, folds));
    return;
  }
  int inverted = 0;
  Eigen::Index first = 0;
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    if (meshing::cell_volume_mm3(shape, cells, c) > 0) continue;
    if (inverted++ == 0) first = c;
  }
  if (inverted == 0) return;
  const Eigen::RowVector3d at = shape(cells.row(first).head(4), Eigen::all).colwise().mean();
  run.warn(
      fmt::format("{}: {} cells are inside out, the first ({}) at ({:.1f}, {:.1f}, {:.1f}) mm; what lies in them "
                  "is carried to the wrong place",
                  pose, inverted, first, at.x(), at.y(), at.z()));
}

}  // namespace

TwoPoses read_two_poses(Run& run, const Case& measured, const fs::path& folder, const std::string& from,
                        const std::string& to) {
  if (from == to) throw InputError(fmt::format("--from and --to are both '{}'; nothing would move", from));
  TwoPoses two{from, to, read_shape(run, measured, folder, from), {}};
  const meshing::PoseMesh other = read_shape(run, measured, folder, to);
  constexpr double same_mm = 1e-6;
  if (other.mesh.cells != two.source.mesh.cells ||
      (other.mesh.points - two.source.mesh.points).cwiseAbs().maxCoeff() > same_mm)
    throw InputError(
        fmt::format("{0}.vtu and {1}.vtu in {2} belong to two meshes; simulate again: make CASE={3} "
                    "simulate",
                    from, to, folder.string(), measured.folder.string()));
  check_one_model(folder, from, to);
  two.target = other.positions;
  for (const auto& [pose, shape] : {std::pair(from, &two.source.positions), std::pair(to, &two.target)})
    warn_of_inverted(run, two.source.mesh.cells, *shape, pose);
  return two;
}

}  // namespace supine::pipeline
