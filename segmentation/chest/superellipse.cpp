// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/superellipse.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace supine::segmentation {
namespace {

constexpr double plate_begins_mm = 6, plate_rises_mm = 12;  // beside the sternum; it thins as far at the outer edge
constexpr double plate_thins_mm = 25;                       // toward its lower end
constexpr double thinnest_plate_mm = 4, thickest_plate_mm = 15, roundest = 1.8, squarest = 4;
constexpr double innermost_edge_mm = 75, outermost_edge_mm = 120;

/// What the plate adds along a ray whose bare end is at `bare`.
double plate_radius_mm(const Superellipse& shape, double angle_rad, double z_mm, double bare) {
  const double ahead = std::cos(angle_rad);
  const double here = shape.plate_mm * std::clamp(0.5 + (z_mm - shape.plate_low_mm) / plate_thins_mm, 0.0, 1.0);
  if (ahead < 0.2 || here == 0) return 0;
  double more = 0;
  for (int n = 0; n < 3; ++n) {  // the plate is as thick as it is where the ray leaves it
    const double x = (bare + more) * std::abs(std::sin(angle_rad));
    more = here / ahead * std::clamp((x - plate_begins_mm) / plate_rises_mm, 0.0, 1.0) *
           std::clamp((shape.plate_edge_mm - x) / plate_rises_mm, 0.0, 1.0);
  }
  return more;
}

}  // namespace

double Superellipse::radius_mm(double angle_rad, double z_mm) const {
  const double depth = depth_mm + depth_slope * (z_mm - middle_z_mm);
  // Behind the centre the side goes straight back.
  const double across = std::abs(std::sin(angle_rad)) / half_width_mm,
               ahead = std::max(0.0, std::cos(angle_rad)) / std::max(10.0, depth);
  const double bare = std::pow(std::pow(across, power) + std::pow(ahead, power), -1 / power);
  return plate_mm > 0 ? bare + plate_radius_mm(*this, angle_rad, z_mm, bare) : bare;
}

namespace {

using Cost = std::function<double(const Superellipse&)>;

constexpr double widths_apart_mm = 7.5;
/// How far under the middle level the lower end of a plate may lie.
struct LowerEnds {
  double from_mm, to_mm;
};
constexpr LowerEnds any_end{0, 310}, high_end{15, 45}, low_end{40, 70};

struct Limits {
  double least_mm, most_mm;  ///< half width
  LowerEnds ends = any_end;
};

struct Scored {
  Superellipse shape;
  double cost;
};

Scored cheapest(const std::vector<Superellipse>& shapes, const Cost& cost) {
  std::vector<double> sums(shapes.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < shapes.size(); ++n) sums[n] = cost(shapes[n]);
  const auto best = static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) - sums.begin());
  return {shapes[best], sums[best]};
}

bool is_a_plate(const Superellipse& shape, const LowerEnds& ends) {
  const double under_mm = shape.middle_z_mm - shape.plate_low_mm;
  return under_mm >= ends.from_mm && under_mm <= ends.to_mm && shape.plate_mm >= thinnest_plate_mm &&
         shape.plate_mm <= thickest_plate_mm && shape.plate_edge_mm >= innermost_edge_mm &&
         shape.plate_edge_mm <= outermost_edge_mm;
}

bool is_a_chest(const Superellipse& shape, const Limits& limits) {
  return shape.half_width_mm >= limits.least_mm - widths_apart_mm &&
         shape.half_width_mm <= limits.most_mm + widths_apart_mm && shape.power >= roundest &&
         shape.power <= squarest && (shape.plate_mm == 0 || is_a_plate(shape, limits.ends));
}

/// Coordinate descent with halved steps from the best of the coarse ones.
Scored polished(Scored best, const Limits& limits, const Cost& cost) {
  std::vector<std::pair<double Superellipse::*, double>> steps = {{&Superellipse::half_width_mm, 4},
                                                                  {&Superellipse::depth_mm, 1.5},
                                                                  {&Superellipse::depth_slope, 0.05},
                                                                  {&Superellipse::power, 0.25}};
  if (best.shape.plate_mm > 0) {
    steps.emplace_back(&Superellipse::plate_mm, 2);
    steps.emplace_back(&Superellipse::plate_edge_mm, 4);
    steps.emplace_back(&Superellipse::plate_low_mm, 6);
  }
  for (double share = 1; share > 0.2;) {
    bool better = false;
    for (const auto& [member, step] : steps)
      for (const double sign : {-1.0, 1.0}) {
        Superellipse other = best.shape;
        other.*member += sign * share * step;
        if (!is_a_chest(other, limits)) continue;
        const double value = cost(other);
        if (value >= best.cost) continue;
        best = {other, value};
        better = true;
      }
    if (!better) share /= 2;
  }
  return best;
}

std::vector<Superellipse> bare_shapes(const Limits& limits, double centre_depth_mm, double middle_z_mm) {
  std::vector<Superellipse> shapes;
  for (const double power : {2.0, 2.5, 3.0})
    for (double half_width = limits.least_mm; half_width <= limits.most_mm; half_width += widths_apart_mm)
      for (double under = 3; under <= 45; under += 3)
        for (const double slope : {-0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4})
          shapes.push_back({half_width, centre_depth_mm - under, slope, power, middle_z_mm});
  return shapes;
}

/// What was found bare may have followed the muscles in part: the chest under them is rounder, and lies up to their
/// thickness deeper.
std::vector<Superellipse> with_plates(const Superellipse& bare, const LowerEnds& ends) {
  std::vector<Superellipse> shapes;
  for (const double thickness : {5.0, 9.0, 13.0})
    for (const double edge : {80.0, 90.0, 100.0, 110.0})
      for (const double deeper : {0.0, 0.5, 1.0})
        for (const double rounder : {0.0, 0.5, 1.0})
          for (const double low_mm : {300.0, 70.0, 50.0, 30.0}) {
            if (low_mm < ends.from_mm || low_mm > ends.to_mm) continue;
            Superellipse shape = bare;
            shape.power = std::max(roundest, shape.power - rounder);
            shape.depth_mm -= deeper * thickness;
            shape.plate_mm = thickness;
            shape.plate_edge_mm = edge;
            shape.plate_low_mm = shape.middle_z_mm - low_mm;
            shapes.push_back(shape);
          }
  return shapes;
}

}  // namespace

Superellipse best_superellipse(const Cost& cost, double centre_depth_mm, double middle_z_mm) {
  constexpr Limits any{100, 175};
  return polished(cheapest(bare_shapes(any, centre_depth_mm, middle_z_mm), cost), any, cost).shape;
}

std::vector<std::vector<Superellipse>> superellipses_with_plates(const Cost& cost, double centre_depth_mm,
                                                                 double middle_z_mm) {
  std::vector<std::vector<Superellipse>> of_widths;
  for (Limits limits : {Limits{100, 115}, Limits{122.5, 137.5}, Limits{145, 175}}) {
    std::vector<Scored> scored{
        polished(cheapest(bare_shapes(limits, centre_depth_mm, middle_z_mm), cost), limits, cost)};
    const Superellipse bare = scored.front().shape;
    for (const LowerEnds& ends : {any_end, high_end, low_end}) {
      limits.ends = ends;
      scored.push_back(polished(cheapest(with_plates(bare, ends), cost), limits, cost));
    }
    std::stable_sort(scored.begin(), scored.end(), [](const Scored& a, const Scored& b) { return a.cost < b.cost; });
    std::vector<Superellipse>& shapes = of_widths.emplace_back();
    for (const Scored& one : scored) shapes.push_back(one.shape);
  }
  return of_widths;
}

}  // namespace supine::segmentation
