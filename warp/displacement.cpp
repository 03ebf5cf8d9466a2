// SPDX-License-Identifier: AGPL-3.0-or-later
#include "warp/displacement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "common/error.h"
#include "warp/surroundings.h"

namespace supine::warp {
namespace {

using segmentation::Grid;

constexpr double margin_mm = 20, reach_of_way = 3, least_spacing_mm = 1;

struct Box {
  Eigen::Vector3d low, high;
};

Box box_of(const TwoShapes& shapes) {
  const Eigen::Vector3d low =
      shapes.source.colwise().minCoeff().cwiseMin(shapes.target.colwise().minCoeff()).transpose();
  const Eigen::Vector3d high =
      shapes.source.colwise().maxCoeff().cwiseMax(shapes.target.colwise().maxCoeff()).transpose();
  return {low.array() - margin_mm, high.array() + margin_mm};
}

/// Runs the field out to zero over the margin, so that it ends without a step.
void taper(Slab& slab, const Grid& grid) {
#pragma omp parallel for
  for (int s = 0; s < slab.count; ++s) {
    std::size_t at = static_cast<std::size_t>(s) * grid.size.x() * grid.size.y();
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i, ++at) {
        const Eigen::Vector3d index(i, j, slab.first + s);
        const Eigen::Vector3d last = (grid.size.array() - 1).matrix().cast<double>();
        const double to_end = index.cwiseMin(last - index).cwiseProduct(grid.spacing_mm).minCoeff();
        const double t = std::min(1.0, to_end / margin_mm);
        if (slab.place[at] != Place::body && t < 1) slab.mm[at] *= static_cast<float>(t * t * (3 - 2 * t));
      }
  }
}

Eigen::Vector3d interpolated(const segmentation::VectorImage& image, const Eigen::Vector3d& index) {
  const Eigen::Vector3i low = index.array().floor().cast<int>().max(0).min(image.grid.size.array() - 2);
  const Eigen::Vector3d t = index - low.cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Eigen::Vector3i at = low;
    for (int a = 0; a < 3; ++a) {
      const int up = corner >> a & 1;
      at[a] += up;
      weight *= up ? t[a] : 1 - t[a];
    }
    sum += weight * image.vectors[image.grid.index(at.x(), at.y(), at.z())].cast<double>();
  }
  return sum;
}

void measure(const TwoShapes& shapes, Displacement& field) {
  const Indices& cells = shapes.mesh.cells;
  double sum = 0;
  for (Eigen::Index c = 0; c < cells.rows(); ++c) {
    Eigen::RowVector3d source = Eigen::RowVector3d::Zero(), target = source;
    // The middle of a quadratic cell: −1/8 of each corner, 1/4 of each edge's middle.
    for (Eigen::Index a = 0; a < cells.cols(); ++a) {
      const double weight = cells.cols() == 4 ? 0.25 : a < 4 ? -0.125 : 0.25;
      source += weight * shapes.source.row(cells(c, a)), target += weight * shapes.target.row(cells(c, a));
    }
    const Eigen::Vector3d found = interpolated(field.image, field.image.grid.continuous_index(target.transpose()));
    const double error = (found.transpose() - (source - target)).norm();
    sum += error * error;
    field.error_max_mm = std::max(field.error_max_mm, error);
  }
  field.error_rms_mm = std::sqrt(sum / static_cast<double>(cells.rows()));
}

}  // namespace

double spacing_for(const TwoShapes& shapes, double points) {
  const Box box = box_of(shapes);
  return std::max(least_spacing_mm, std::cbrt((box.high - box.low).prod() / points));
}

Displacement displacement_of(const TwoShapes& shapes, double spacing_mm, double blend_mm) {
  const Box box = box_of(shapes);
  Grid grid;
  grid.spacing_mm.setConstant(spacing_mm);
  grid.origin_mm = box.low;
  for (int a = 0; a < 3; ++a)
    grid.size[a] = static_cast<int>(std::min(1e7, std::ceil((box.high[a] - box.low[a]) / spacing_mm) + 1));
  check_memory(grid, 2 * (sizeof(Eigen::Vector3f) + sizeof(Place)) + 3 * sizeof(double));
  const double longest = (shapes.source - shapes.target).rowwise().norm().maxCoeff();
  Slab all;
  all.start(grid, 0, grid.size.z());
  CellRaster(shapes.mesh, shapes.target, shapes.source, grid).fill(all);
  Surroundings(shapes.mesh, shapes.target, shapes.source, {blend_mm, std::max(blend_mm, reach_of_way * longest)})
      .fill(grid, all);
  taper(all, grid);
  Displacement field{{grid, std::move(all.mm)}};
  measure(shapes, field);
  return field;
}

void write_tfm(const segmentation::VectorImage& displacement, const std::filesystem::path& file) {
  const Grid& grid = displacement.grid;
  std::ofstream stream(file, std::ios::binary);
  stream
      << "#Insight Transform File V1.0\n"
      << "# LPS, mm. Maps a place of the target shape to the place it comes from in the source shape (ITK: fixed ->\n"
      << "# moving). A volume, model or markup put under it in 3D Slicer moves from the source into the target shape.\n"
      << "#Transform 0\nTransform: DisplacementFieldTransform_double_3_3\nParameters:";
  fmt::memory_buffer text;
  for (const Eigen::Vector3f& mm : displacement.vectors) {
    for (int a = 0; a < 3; ++a) {
      // Four digits: a tenth of a micrometre.
      if (mm[a] == 0)
        fmt::format_to(std::back_inserter(text), " 0");
      else
        fmt::format_to(std::back_inserter(text), " {:.4f}", mm[a]);
    }
    if (text.size() < 1 << 20) continue;
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    text.clear();
  }
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream << fmt::format("\nFixedParameters: {} {} {}", grid.size.x(), grid.size.y(), grid.size.z());
  for (const double value : grid.origin_mm) stream << fmt::format(" {:.17g}", value);
  for (const double value : grid.spacing_mm) stream << fmt::format(" {:.17g}", value);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) stream << fmt::format(" {:.17g}", grid.direction(r, c));
  stream << "\n";
  stream.flush();
  if (!stream) throw InputError(fmt::format("{}: cannot be written; check the free space on the disk", file.string()));
}

}  // namespace supine::warp
