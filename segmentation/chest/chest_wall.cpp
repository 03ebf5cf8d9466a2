// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/chest_wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/error.h"
#include "segmentation/chest/boundary_cost.h"
#include "segmentation/chest/cheapest_surface.h"
#include "segmentation/chest/sampler.h"

namespace supine::segmentation {
namespace {

constexpr double farthest_mm = 220;        // from the centre that the wall may lie
constexpr double widest_angle_rad = 1.83;  // 105 degrees to either side
constexpr double one_degree = std::numbers::pi / 180;
constexpr double superellipse_reach_mm = 25;  // a place farther from it is pulled no harder
constexpr double superellipse_blur_mm = 4;    // to either side of the superellipse that counts for it
constexpr double coupling_reach_mm = 20;      // a neighbour farther off pulls no harder
// Lines are seen best along their own course: the rays start from what is known of it and are averaged over
// their neighbours.
struct Look {
  double reach_mm;     // to either side of what is known
  int angles, levels;  // averaged to either side
  bool even;           // looks for one wall that fits both sides: false lines of one side are not lines of the other
};
constexpr Look first_look{0, 1, 1, false}, closer_looks[] = {{30, 3, 2, true}, {10, 4, 3, false}};
constexpr double uneven_mm = 3;  // that the two sides of a chest differ

/// The cheapest border over the samples of the rays, with the pull of the superellipse.
std::vector<int> search(const RayProfiles& profiles, const std::vector<float>& costs, const ChestWall& wall,
                        const ChestWallOptions& options) {
  constexpr double step = RayProfiles::step_mm;
  SurfaceProblem problem{static_cast<int>(profiles.angles()),
                         static_cast<int>(profiles.levels()),
                         profiles.count,
                         costs,
                         options.stiffness_per_mm * step,
                         options.coupling_per_mm * step,
                         options.coupling_per_mm * coupling_reach_mm};
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      const double oval = (wall.superellipse.radius_mm(wall.angle(a), wall.z(k)) - profiles.radius_mm(a, k, 0)) / step;
      float* cost = problem.costs.data() + profiles.ray(a, k) * profiles.count;
      for (int i = 0; i < profiles.count; ++i)
        cost[i] +=
            static_cast<float>(options.oval_pull_per_mm * std::min(superellipse_reach_mm, step * std::abs(i - oval)));
    }
  return cheapest_surface(problem);
}

/// Makes places dear that lie far in front of the skin over the sternum of their level: there is breast.
void hold_back(const FrontSkin& front, const ChestWall& wall, const RayProfiles& profiles,
               const ChestWallOptions& options, std::vector<float>& costs) {
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < profiles.levels(); ++k) {
    const double skin = front.at(wall.torso.sternum_x(wall.z(k)), wall.z(k)),
                 foremost = (std::isnan(skin) ? wall.torso.sternum_skin_y_mm : skin) - options.ahead_mm;
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      if (!profiles.seen(a, k)) continue;
      const double ahead = std::cos(wall.angle(a));
      float* cost = costs.data() + profiles.ray(a, k) * profiles.count;
      for (int i = 0; i < profiles.count; ++i) {
        const double too_far = foremost - (wall.centre_y_mm - ahead * profiles.radius_mm(a, k, i));
        if (too_far > 0) cost[i] += static_cast<float>(options.ahead_cost_per_mm * too_far);
      }
    }
  }
}

/// The superellipses whose border is cheapest, taken over a few millimetres to either side: no chest is one. By their
/// widths, as of superellipses_with_plates.
std::vector<std::vector<Superellipse>> fit_superellipses(const RayProfiles& profiles, const std::vector<float>& costs,
                                                         const ChestWall& wall, const ChestWallOptions& options) {
  const int blur = static_cast<int>(superellipse_blur_mm / RayProfiles::step_mm), n = profiles.count;
  std::vector<float> near(costs.size());
#pragma omp parallel for schedule(static)
  for (std::size_t ray = 0; ray < profiles.end.size(); ++ray)
    for (int i = 0; i < n; ++i) {
      double sum = 0, weight = 0;
      for (int j = std::max(0, i - blur); j <= std::min(n - 1, i + blur); ++j) {
        const double w = blur + 1 - std::abs(i - j);
        sum += w * costs[ray * n + j];
        weight += w;
      }
      near[ray * n + i] = static_cast<float>(sum / weight);
    }
  const auto cost = [&](const Superellipse& shape) {
    double sum = 0;  // every sixth ray is plenty for four numbers
    for (Eigen::Index k = 0; k < profiles.levels(); k += 2)
      for (Eigen::Index a = 0; a < profiles.angles(); a += 3) {
        const double i =
            (shape.radius_mm(wall.angle(a), wall.z(k)) - profiles.radius_mm(a, k, 0)) / RayProfiles::step_mm;
        sum += near[profiles.ray(a, k) * n + std::clamp(static_cast<int>(std::lround(i)), 0, n - 1)];
      }
    return sum;
  };
  const double middle_z_mm = wall.z(profiles.levels() / 2);
  if (options.border == ChestWallOptions::Border::line)
    return superellipses_with_plates(cost, options.centre_depth_mm, middle_z_mm);
  return {{best_superellipse(cost, options.centre_depth_mm, middle_z_mm)}};
}

/// The radius nearest to `radius` at which the grey rises through the half-way level; `radius` when there is none.
double half_way(const GreyImage& image, const ChestWallOptions& options, const Eigen::Vector3d& from,
                const Eigen::Vector3d& along, double radius) {
  const double fine_mm = 0.25;
  const float level = (options.dark + options.bright) / 2;
  double best = radius, best_distance = INFINITY;
  float before = sample(image, from + along * (radius - options.refine_mm));
  for (double r = radius - options.refine_mm + fine_mm; r <= radius + options.refine_mm; r += fine_mm) {
    const float grey = sample(image, from + along * r);
    if (before < level && grey >= level) {
      const double at = r - fine_mm * (grey - level) / (grey - before);
      if (std::abs(at - radius) < best_distance) {
        best_distance = std::abs(at - radius);
        best = at;
      }
    }
    before = grey;
  }
  return best;
}

/// Gives a ray and its mirror image the mean of their costs, each over uneven_mm to either side.
void make_even(const RayProfiles& profiles, std::vector<float>& costs) {
  const int blur = static_cast<int>(uneven_mm / RayProfiles::step_mm), n = profiles.count;
  const std::vector<float> before = costs;
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      const float* own = before.data() + profiles.ray(a, k) * n;
      const float* other = before.data() + profiles.ray(profiles.angles() - 1 - a, k) * n;
      float* cost = costs.data() + profiles.ray(a, k) * n;
      for (int i = 0; i < n; ++i) {
        float sum = 0, weight = 0;
        for (int j = std::max(0, i - blur); j <= std::min(n - 1, i + blur); ++j) {
          const auto w = static_cast<float>(blur + 1 - std::abs(i - j));
          sum += w * (own[j] + other[j]) / 2;
          weight += w;
        }
        cost[i] = sum / weight;
      }
    }
}

/// Takes the cheapest border over to the wall.
void settle(const RayProfiles& profiles, const std::vector<float>& costs, const ChestWallOptions& options,
            ChestWall& wall) {
  const std::vector<int> chosen = search(profiles, costs, wall, options);
  wall.radius_mm.resize(profiles.angles(), profiles.levels());
  wall.cost.resize(profiles.angles(), profiles.levels());
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      const int i = chosen[profiles.ray(a, k)];
      wall.cost(a, k) = profiles.seen(a, k) ? costs[profiles.ray(a, k) * profiles.count + i] : NAN;
      wall.radius_mm(a, k) = profiles.radius_mm(a, k, i);
    }
}

void refine(const GreyImage& image, const ChestWallOptions& options, ChestWall& wall) {
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a)
      wall.radius_mm(a, k) = half_way(image, options, wall.centre(k), wall.direction(a), wall.radius_mm(a, k));
}

/// Looks along the border itself, from a superellipse on: what the first look saw is too noisy.
/// @return cost of the data there
double look_closer(const GreyImage& image, const Mask& body, const FrontSkin& front, const ChestWallOptions& options,
                   ChestWall& wall) {
  for (Eigen::Index k = 0; k < wall.radius_mm.cols(); ++k)
    for (Eigen::Index a = 0; a < wall.radius_mm.rows(); ++a)
      wall.radius_mm(a, k) = wall.superellipse.radius_mm(wall.angle(a), wall.z(k));
  for (const Look& look : closer_looks) {
    RayProfiles profiles = sample_rays(image, body, wall, wall.radius_mm, -look.reach_mm, look.reach_mm);
    blur_profiles(profiles, look.angles, look.levels);
    std::vector<float> costs = boundary_costs(profiles, options, true);
    hold_back(front, wall, profiles, options, costs);
    if (look.even) make_even(profiles, costs);
    settle(profiles, costs, options, wall);
  }
  return wall.cost.isNaN().select(0, wall.cost).sum();
}

/// The wall along the cheapest border that is found from one of the shapes: first which width it has, from the
/// likeliest of each, then which of that width.
ChestWall closest_look(const GreyImage& image, const Mask& body, const FrontSkin& front,
                       const ChestWallOptions& options, const std::vector<std::vector<Superellipse>>& of_widths,
                       ChestWall wall) {
  ChestWall best;
  double least = std::numeric_limits<double>::infinity();
  const auto is_better = [&](const Superellipse& shape) {
    wall.superellipse = shape;
    const double cost = look_closer(image, body, front, options, wall);
    if (cost >= least) return false;
    best = wall;
    least = cost;
    return true;
  };
  const std::vector<Superellipse>* width = &of_widths.front();
  for (const std::vector<Superellipse>& shapes : of_widths)
    if (is_better(shapes.front())) width = &shapes;
  for (std::size_t n = 1; n < width->size(); ++n) is_better((*width)[n]);
  return best;
}

void check(const ChestWallOptions& o) {
  if (!(o.bright > o.dark))
    throw InputError(fmt::format("chest_wall: bright = {} must be above dark = {}", o.bright, o.dark));
  for (const auto& [name, value] : {std::pair("band_mm", o.band_mm), {"centre_depth_mm", o.centre_depth_mm}})
    if (!(value > 0)) throw InputError(fmt::format("chest_wall: {} = {} must be > 0", name, value));
}

}  // namespace

Eigen::Vector3d ChestWall::point(Eigen::Index a, Eigen::Index k) const {
  return centre(k) + radius_mm(a, k) * direction(a);
}

double ChestWall::depth_mm(const Eigen::Vector3d& p) const {
  const double x = p.x() - torso.sternum_x(p.z()), y = centre_y_mm - p.y();
  const double a = (std::atan2(x, y) - first_angle_rad) / step_angle_rad, k = (p.z() - z0_mm) / step_z_mm;
  const auto last_a = radius_mm.rows() - 1, last_k = radius_mm.cols() - 1;
  const double ca = std::clamp<double>(a, 0, static_cast<double>(last_a)),
               ck = std::clamp<double>(k, 0, static_cast<double>(last_k));
  const auto ia = std::min(static_cast<Eigen::Index>(ca), std::max<Eigen::Index>(0, last_a - 1));
  const auto ik = std::min(static_cast<Eigen::Index>(ck), std::max<Eigen::Index>(0, last_k - 1));
  const double ta = ca - static_cast<double>(ia), tk = ck - static_cast<double>(ik);
  const auto ja = std::min(ia + 1, last_a), jk = std::min(ik + 1, last_k);
  const double r = (1 - tk) * ((1 - ta) * radius_mm(ia, ik) + ta * radius_mm(ja, ik)) +
                   tk * ((1 - ta) * radius_mm(ia, jk) + ta * radius_mm(ja, jk));
  return r - std::hypot(x, y);
}

ChestWall find_chest_wall(const GreyImage& image, const Mask& body, const Torso& torso,
                          const ChestWallOptions& options) {
  check(options);
  const FrontSkin front = front_skin(body, image.grid);  // for its levels
  ChestWall wall;
  wall.torso = torso;
  wall.border = options.border;
  wall.centre_y_mm = torso.sternum_skin_y_mm + options.centre_depth_mm;
  wall.z0_mm = front.z0_mm;
  wall.step_z_mm = front.step_z_mm;
  const auto half = static_cast<Eigen::Index>(widest_angle_rad / one_degree);
  wall.first_angle_rad = -static_cast<double>(half) * one_degree;
  wall.step_angle_rad = one_degree;
  const bool lines = options.border == ChestWallOptions::Border::line;
  RayProfiles profiles =
      sample_rays(image, body, wall, Eigen::ArrayXXd::Zero(2 * half + 1, front.y_mm.cols()), 0, farthest_mm);
  if (lines) blur_profiles(profiles, first_look.angles, first_look.levels);
  std::vector<float> costs = boundary_costs(profiles, options);
  hold_back(front, wall, profiles, options, costs);
  const std::vector<std::vector<Superellipse>> shapes = fit_superellipses(profiles, costs, wall, options);
  if (!lines) {
    wall.superellipse = shapes.front().front();
    settle(profiles, costs, options, wall);
    refine(image, options, wall);
    return wall;
  }
  wall.radius_mm.resize(profiles.angles(), profiles.levels());
  return closest_look(image, body, front, options, shapes, std::move(wall));
}

}  // namespace supine::segmentation
