// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/volume_checks.h"

#include <fmt/format.h>

#include "common/error.h"

namespace supine::pipeline {

using segmentation::Grid;

void check_holds_body(Run& run, const TwoPoses& poses, const Grid& grid, const std::string& name, bool trusted) {
  const auto share_in = [&grid](const Points& shape, double sign) {
    Eigen::Index inside = 0;
    const Eigen::Vector3d last = (grid.size.array() - 1).matrix().cast<double>();
    for (Eigen::Index p = 0; p < shape.rows(); ++p) {
      const Eigen::Vector3d index = grid.continuous_index({sign * shape(p, 0), sign * shape(p, 1), shape(p, 2)});
      inside += (index.array() > -0.5).all() && ((index - last).array() < 0.5).all();
    }
    return static_cast<double>(inside) / static_cast<double>(shape.rows());
  };
  constexpr double least = 0.5, whole = 0.98;
  const double share = share_in(poses.source.positions, 1);
  if (share >= whole) return;
  const std::string what = fmt::format("{}: holds {:.0f} % of the body in pose {}", name, 100 * share, poses.from);
  if (share >= least || (share > 0 && trusted)) return run.warn(what + "; the rest becomes background");
  const double turned = share_in(poses.source.positions, -1);
  throw InputError(fmt::format(
      "{} (bound {:.0f} %). {}", what, 100 * least,
      turned >= least ? "With x and y negated it would hold it: the file says LPS and is RAS, or the other way round"
                      : "Another patient, another frame, another pose (--from) or another unit than mm? "
                        "--trust-place carries a part of the body all the same"));
}

void check_body_is_there(const std::filesystem::path& target, const warp::WarpedVolume& carried) {
  constexpr std::size_t least = 10;
  const Grid& grid = carried.image.grid;
  if (carried.body_voxels >= least) return;
  throw InputError(fmt::format(
      "{}: only {} of its {} x {} x {} voxels of {:.3g} x {:.3g} x {:.3g} mm lie in the body (bound {}). Another "
      "frame or place of --like, or too large a --spacing?",
      target.string(), carried.body_voxels, grid.size.x(), grid.size.y(), grid.size.z(), grid.spacing_mm.x(),
      grid.spacing_mm.y(), grid.spacing_mm.z(), least));
}

double check_shows_skin(Run& run, const TwoPoses& poses, const segmentation::GreyImage& image, const std::string& name,
                        bool trusted) {
  constexpr double usual = 0.8, least = 0.65;
  const double contrast = warp::skin_contrast(poses.source.mesh, poses.source.positions, image);
  if (contrast >= usual) return contrast;
  const bool refused = contrast < least && !trusted;
  const std::string what = fmt::format(
      "{} does not show the skin where the body has it in pose {}: outside it is darker than inside in {:.0f} % of "
      "places (usual: over {:.0f} %, bound {:.0f} %). Another patient, frame or pose{}",
      name, poses.from, 100 * contrast, 100 * usual, 100 * least,
      refused ? ", or a volume that shows no skin? Such a one is carried with --trust-place" : "?");
  if (refused) throw InputError(what);
  run.warn(what);
  return contrast;
}

}  // namespace supine::pipeline
