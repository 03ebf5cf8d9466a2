// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/torso.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"

namespace supine::segmentation {
namespace {

constexpr double not_there = std::numeric_limits<double>::quiet_NaN();
constexpr double flat_mm = 3;          // the floor of the cleft is what lies this close to its deepest point
constexpr double reach_mm = 160;       // a breast's foremost point is at most this far from the middle
constexpr double steepest_line = 0.1;  // dx/dz of the middle line; a patient lies straighter than that

struct Box {
  Eigen::Vector3d low, high;
};

Box bounds(const Grid& grid) {
  Box box{Eigen::Vector3d::Constant(INFINITY), Eigen::Vector3d::Constant(-INFINITY)};
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int a = 0; a < 3; ++a) index[a] = (corner >> a & 1) ? grid.size[a] - 1 : 0;
    const Eigen::Vector3d p = grid.point(index);
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  }
  return box;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// One level's cleft.
struct Cleft {
  double x, y, z;
};

/// The deepest point that has a breast on either side, if the level has one.
std::optional<Cleft> find_cleft(const FrontSkin& front, Eigen::Index k, double least_mm) {
  const Eigen::Index n = front.y_mm.rows();
  const auto reach = static_cast<Eigen::Index>(reach_mm / front.step_x_mm);
  Eigen::Index best = -1;
  double best_depth = least_mm;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double y = front.y_mm(i, k);
    if (std::isnan(y)) continue;
    double left = INFINITY, right = INFINITY;
    for (Eigen::Index o = 1; o <= reach; ++o) {
      if (i - o >= 0 && !std::isnan(front.y_mm(i - o, k))) left = std::min(left, front.y_mm(i - o, k));
      if (i + o < n && !std::isnan(front.y_mm(i + o, k))) right = std::min(right, front.y_mm(i + o, k));
    }
    const double depth = y - std::max(left, right);
    if (depth > best_depth) {
      best_depth = depth;
      best = i;
    }
  }
  if (best < 0) return std::nullopt;
  const double floor = front.y_mm(best, k) - flat_mm;
  Eigen::Index first = best, last = best;
  while (first > 0 && front.y_mm(first - 1, k) >= floor) --first;
  while (last + 1 < n && front.y_mm(last + 1, k) >= floor) ++last;
  return Cleft{(front.x(first) + front.x(last)) / 2, front.y_mm(best, k), front.z(k)};
}

/// Median of the slopes of all pairs (Theil and Sen), then of the offsets.
void fit_line(const std::vector<Cleft>& clefts, Torso& torso) {
  std::vector<double> slopes, offsets;
  for (std::size_t a = 0; a < clefts.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (clefts[a].z != clefts[b].z) slopes.push_back((clefts[a].x - clefts[b].x) / (clefts[a].z - clefts[b].z));
  torso.sternum_slope = slopes.empty() ? 0 : std::clamp(median(slopes), -steepest_line, steepest_line);
  for (const Cleft& c : clefts) offsets.push_back(c.x - torso.sternum_slope * c.z);
  torso.sternum_x_mm = median(offsets);
}

}  // namespace

double FrontSkin::at(double x_mm, double z_mm) const {
  const auto i = static_cast<Eigen::Index>(std::lround((x_mm - x0_mm) / step_x_mm));
  const auto k = static_cast<Eigen::Index>(std::lround((z_mm - z0_mm) / step_z_mm));
  return i < 0 || k < 0 || i >= y_mm.rows() || k >= y_mm.cols() ? not_there : y_mm(i, k);
}

FrontSkin front_skin(const Mask& body, const Grid& grid, double step_mm) {
  const Box box = bounds(grid);
  FrontSkin front;
  Eigen::Index up = 0;
  grid.direction.row(2).cwiseAbs().maxCoeff(&up);
  front.step_x_mm = step_mm;
  front.step_z_mm = grid.spacing_mm[up];
  front.x0_mm = box.low.x();
  front.z0_mm = box.low.z();
  const auto nx = static_cast<Eigen::Index>((box.high.x() - box.low.x()) / front.step_x_mm) + 1;
  const auto nz = static_cast<Eigen::Index>((box.high.z() - box.low.z()) / front.step_z_mm + 0.5) + 1;
  front.y_mm.setConstant(nx, nz, not_there);
  const double step_y = grid.spacing_mm.minCoeff() / 2;
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < nz; ++k)
    for (Eigen::Index i = 0; i < nx; ++i)
      for (double y = box.low.y(); y <= box.high.y(); y += step_y) {
        const Eigen::Vector3d at = grid.continuous_index({front.x(i), y, front.z(k)});
        const Eigen::Vector3i n = at.array().round().cast<int>();
        if (!grid.contains(n.x(), n.y(), n.z()) || !body[grid.index(n.x(), n.y(), n.z())]) continue;
        front.y_mm(i, k) = y;
        break;
      }
  return front;
}

Torso find_torso(const FrontSkin& front, std::optional<double> sternum_x_mm, double least_mm) {
  std::vector<Cleft> clefts;
  for (Eigen::Index k = 0; k < front.y_mm.cols(); ++k)
    if (const auto cleft = find_cleft(front, k, least_mm)) clefts.push_back(*cleft);
  Torso torso;
  torso.slices = static_cast<int>(clefts.size());
  if (clefts.size() < 3 && !sternum_x_mm)
    throw InputError(
        fmt::format("only {} levels of the volume show a cleft between two breasts that hang at least {} mm below it, "
                    "3 are needed to find the sternum; give its place in x (planes, sternum_mm)",
                    clefts.size(), least_mm));
  std::vector<double> depths;
  if (sternum_x_mm) {
    torso.sternum_x_mm = *sternum_x_mm;
    for (Eigen::Index k = 0; k < front.y_mm.cols(); ++k)
      if (const double y = front.at(*sternum_x_mm, front.z(k)); !std::isnan(y)) depths.push_back(y);
    if (depths.empty())
      throw InputError(
          fmt::format("the body does not reach x = {} mm, where the sternum is said to be", *sternum_x_mm));
  } else {
    fit_line(clefts, torso);
    for (const Cleft& c : clefts) depths.push_back(c.y);
  }
  torso.sternum_skin_y_mm = median(depths);
  return torso;
}

}  // namespace supine::segmentation
