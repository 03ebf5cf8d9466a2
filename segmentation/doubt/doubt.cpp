// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/doubt/doubt.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "segmentation/chest/sampler.h"
#include "segmentation/label_map.h"
#include "segmentation/tissue.h"

namespace supine::segmentation {
namespace {

// Of 403 women the means by density class run from 364 ml (sd 258) to 1,149 ml (sd 421) (Cancer Epidemiology,
// Biomarkers & Prevention, volumes by BI-RADS class; the largest known to us here has 2,400); fat is 66.5 % (sd 18) of
// a breast on MRI (Lee et al., AJR 168, 1997). The bounds lie well outside.
constexpr double least_ml = 60, most_ml = 3500, most_gland_share = 0.8, most_sides = 2.5;
constexpr double outside_from_mm = 4, outside_to_mm = 10, inside_from_mm = 2, inside_to_mm = 10;
constexpr double signal_outside = 0.35;  // of what is inside: the skin line lies inside the body
constexpr double most_unsharp_cm2 = 10, steepest_skin = 1.2;
constexpr double edge_cm2 = 5;

double grey_along(const GreyImage& image, Eigen::Vector3d from, const Eigen::Vector3d& way, double low, double high) {
  double sum = 0;
  int count = 0;
  for (double r = low; r <= high; r += 1)
    if (const float grey = sample(image, from + r * way); !std::isnan(grey)) {
      sum += grey;
      ++count;
    }
  return count > 0 ? sum / count : NAN;
}

/// Whether the skin of a column faces the front, so that straight ahead of it is outside.
bool faces_front(const FrontSkin& front, Eigen::Index i, Eigen::Index k) {
  if (i == 0 || k == 0 || i + 1 >= front.y_mm.rows() || k + 1 >= front.y_mm.cols()) return false;
  const double across = (front.y_mm(i + 1, k) - front.y_mm(i - 1, k)) / (2 * front.step_x_mm),
               along = (front.y_mm(i, k + 1) - front.y_mm(i, k - 1)) / (2 * front.step_z_mm);
  return std::hypot(across, along) < steepest_skin;  // false for NaN
}

/// The median grey of the air in front of the chest: of a magnitude image it is that of the noise, not 0.
double grey_of_air(const Segmented& s) {
  std::vector<float> greys;
  const Grid& grid = s.labels.grid;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i)
        if (s.labels.at(i, j, k) == static_cast<std::uint8_t>(Tissue::air) &&
            grid.point(Eigen::Vector3d(i, j, k)).y() < s.wall.torso.sternum_skin_y_mm)
          greys.push_back(s.image.at(i, j, k));
  if (greys.empty()) return 0;
  const auto middle = greys.begin() + static_cast<std::ptrdiff_t>(greys.size() / 2);
  std::nth_element(greys.begin(), middle, greys.end());
  return *middle;
}

/// The largest patch of skin whose outside is as bright as tissue.
void judge_skin(const Segmented& s, const FrontSkin& front, std::vector<Doubt>& doubts) {
  Grid grid;  // the columns as a picture, for its connected patches
  grid.size = {static_cast<int>(front.y_mm.rows()), static_cast<int>(front.y_mm.cols()), 1};
  Mask bright(grid.count(), 0);
  const Eigen::Vector3d ahead(0, -1, 0);
  const double air = grey_of_air(s);
  for (int k = 0; k < grid.size.y(); ++k)
    for (int i = 0; i < grid.size.x(); ++i) {
      if (!faces_front(front, i, k)) continue;
      const Eigen::Vector3d p(front.x(i), front.y_mm(i, k), front.z(k));
      const double out = grey_along(s.image, p, ahead, outside_from_mm, outside_to_mm) - air,
                   in = grey_along(s.image, p, -ahead, inside_from_mm, inside_to_mm) - air;
      bright[grid.index(i, k, 0)] = in > 0 && out > signal_outside * in;
    }
  const Components patches = connected_components(bright, grid);
  if (patches.size.empty()) return;
  const auto largest = std::max_element(patches.size.begin(), patches.size.end());
  const double area_cm2 = static_cast<double>(*largest) * front.step_x_mm * front.step_z_mm / 100;
  if (area_cm2 < most_unsharp_cm2) return;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  const auto number = static_cast<std::int32_t>(largest - patches.size.begin()) + 1;
  for (int k = 0; k < grid.size.y(); ++k)
    for (int i = 0; i < grid.size.x(); ++i)
      if (patches.number[grid.index(i, k, 0)] == number)
        place += Eigen::Vector3d(front.x(i), front.y_mm(i, k), front.z(k)) / static_cast<double>(*largest);
  doubts.push_back(
      {fmt::format("the skin line is not where the air begins: over {:.0f} cm2 (bound {:.0f}) the grey 4 to 10 mm "
                   "outside is more than {:.2f} of that inside",
                   area_cm2, most_unsharp_cm2, signal_outside),
       place});
}

/// A breast that goes on beyond the image, to the front or to the sides.
void judge_edges(const Segmented& s, const Mask& breast, std::vector<Doubt>& doubts) {
  const Grid& grid = s.labels.grid;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(grid.direction(2, axis)) > 0.7) continue;  // towards head and feet the image may end in it
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const int at : {0, grid.size[axis] - 1}) {
      int count = 0;
      Eigen::Vector3d place = Eigen::Vector3d::Zero();
      Eigen::Vector3i n;
      n[axis] = at;
      for (n[v] = 0; n[v] < grid.size[v]; ++n[v])
        for (n[u] = 0; n[u] < grid.size[u]; ++n[u]) {
          const Eigen::Vector3d p = grid.point(n.cast<double>());
          if (!breast[grid.index(n.x(), n.y(), n.z())] || p.y() > s.wall.torso.sternum_skin_y_mm) continue;
          ++count;
          place += p;
        }
      const double area_cm2 = count * grid.spacing_mm[u] * grid.spacing_mm[v] / 100;
      if (area_cm2 > edge_cm2)
        doubts.push_back(
            {fmt::format("the image ends inside a breast: {:.0f} cm2 of it lie on the image's edge (bound {:.0f})",
                         area_cm2, edge_cm2),
             place / count});
    }
  }
}

struct Side {
  double ml = 0, gland_ml = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
};

void judge_sides(const Segmented& s, const Mask& breast, std::vector<Doubt>& doubts) {
  const Grid& grid = s.labels.grid;
  const double voxel_ml = grid.voxel_volume_mm3() / 1000;
  std::array<Side, 2> sides;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t n = grid.index(i, j, k);
        if (!breast[n]) continue;
        const Eigen::Vector3d p = grid.point(Eigen::Vector3d(i, j, k));
        Side& side = sides[p.x() > s.wall.torso.sternum_x(p.z())];
        side.ml += voxel_ml;
        side.middle += p;
        if (s.labels.voxels[n] == static_cast<std::uint8_t>(Tissue::gland)) side.gland_ml += voxel_ml;
      }
  constexpr std::array<const char*, 2> names{"right", "left"};
  const double few = 0.02 * (sides[0].ml + sides[1].ml);
  for (const int n : {0, 1}) {
    Side& side = sides[n];
    if (side.ml <= few) continue;  // not asked for
    side.middle *= voxel_ml / side.ml;
    if (side.ml < least_ml || side.ml > most_ml)
      doubts.push_back({fmt::format("the {} breast has {:.0f} ml, beyond the {:.0f} to {:.0f} ml that breasts have",
                                    names[n], side.ml, least_ml, most_ml),
                        side.middle});
    if (side.gland_ml > most_gland_share * side.ml)
      doubts.push_back({fmt::format("{:.0f} % of the {} breast are labelled gland (bound {:.0f} %)",
                                    100 * side.gland_ml / side.ml, names[n], 100 * most_gland_share),
                        side.middle});
  }
  const double small = std::min(sides[0].ml, sides[1].ml), large = std::max(sides[0].ml, sides[1].ml);
  if (small > few && large > most_sides * small)
    doubts.push_back(
        {fmt::format("the sides differ: right {:.0f} ml, left {:.0f} ml, a factor of more than {:.1f}; is one breast "
                     "missing or cut off? side = \"left\" or \"right\" takes one",
                     sides[0].ml, sides[1].ml, most_sides),
         sides[sides[0].ml < sides[1].ml ? 0 : 1].middle});
}

}  // namespace

std::vector<Doubt> find_doubts(const Segmented& segmented) {
  std::vector<Doubt> doubts;
  const Mask breast = meshed_mask(segmented.labels);
  judge_skin(segmented, front_skin(breast, segmented.labels.grid), doubts);
  judge_edges(segmented, breast, doubts);
  judge_sides(segmented, breast, doubts);
  return doubts;
}

}  // namespace supine::segmentation
