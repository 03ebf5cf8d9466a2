// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/chest_wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "segmentation/chest/boundary_cost.h"
#include "segmentation/chest/sampler.h"

namespace supine::segmentation {
namespace {

constexpr double farthest_mm = 220;        // from the centre that the wall may lie
constexpr double widest_angle_rad = 1.83;  // 105 degrees to either side
constexpr double one_degree = std::numbers::pi / 180;
constexpr double superellipse_reach_mm = 25;  // a place farther from it is pulled no harder
constexpr double superellipse_blur_mm = 4;    // to either side of the superellipse that counts for it
constexpr double coupling_reach_mm = 20;      // a neighbour farther off pulls no harder
constexpr int most_sweeps = 12;
// Lines are seen best along their own course: the rays start from what is known of it and are averaged over
// their neighbours.
struct Look {
  double reach_mm;     // to either side of what is known
  int angles, levels;  // averaged to either side
};
constexpr Look first_look{0, 1, 1}, closer_looks[] = {{30, 3, 2}, {10, 4, 3}};

using Chains = std::vector<std::vector<int>>;

/// min over j of value[j] + slope |i - j|, and the j it is reached at.
void spread(std::vector<double>& value, std::vector<int>& from, double slope) {
  const int n = static_cast<int>(value.size());
  for (int i = 0; i < n; ++i) from[i] = i;
  for (int i = 1; i < n; ++i)
    if (value[i - 1] + slope < value[i]) {
      value[i] = value[i - 1] + slope;
      from[i] = from[i - 1];
    }
  for (int i = n - 2; i >= 0; --i)
    if (value[i + 1] + slope < value[i]) {
      value[i] = value[i + 1] + slope;
      from[i] = from[i + 1];
    }
}

/// The search for the cheapest surface over the samples of the rays.
class Search {
 public:
  Search(const RayProfiles& profiles, const std::vector<float>& costs, const ChestWall& wall,
         const ChestWallOptions& options)
      : profiles_(profiles), costs_(costs), options_(options) {
    superellipse_.resize(profiles.angles(), profiles.levels());
    for (Eigen::Index k = 0; k < profiles.levels(); ++k)
      for (Eigen::Index a = 0; a < profiles.angles(); ++a)
        superellipse_(a, k) = (wall.superellipse.radius_mm(wall.angle(a), wall.z(k)) - profiles.radius_mm(a, k, 0)) /
                              RayProfiles::step_mm;
  }

  /// Sweeps over the levels until no chain changes.
  Chains settle() const {
    Chains chains;
    const auto n = static_cast<int>(profiles_.levels());
    for (int k = 0; k < n; ++k) chains.push_back(cheapest(k, {}));
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      bool changed = false;
      for (int step = 0; step < n; ++step) {
        const int k = sweep % 2 == 0 ? step : n - 1 - step;
        std::vector<const std::vector<int>*> neighbours;
        if (k > 0) neighbours.push_back(&chains[k - 1]);
        if (k + 1 < n) neighbours.push_back(&chains[k + 1]);
        auto chain = cheapest(k, neighbours);
        changed |= chain != chains[k];
        chains[k] = std::move(chain);
      }
      if (!changed) break;
    }
    return chains;
  }

 private:
  /// Cost of a sample with the pulls of the superellipse and of the neighbouring levels.
  double cost(Eigen::Index a, int k, int i, const std::vector<const std::vector<int>*>& neighbours) const {
    constexpr double step = RayProfiles::step_mm;
    double sum = costs_[profiles_.ray(a, k) * profiles_.count + i] +
                 options_.oval_pull_per_mm * std::min(superellipse_reach_mm, step * std::abs(i - superellipse_(a, k)));
    for (const auto* other : neighbours)
      sum += options_.coupling_per_mm * std::min(coupling_reach_mm, step * std::abs(i - (*other)[a]));
    return sum;
  }
  /// The cheapest chain of samples over the rays of a level.
  std::vector<int> cheapest(int k, const std::vector<const std::vector<int>*>& neighbours) const {
    const auto angles = static_cast<std::size_t>(profiles_.angles());
    const int n = profiles_.count;
    std::vector<std::vector<int>> from(angles, std::vector<int>(n));
    std::vector<double> value(n);
    for (int i = 0; i < n; ++i) value[i] = cost(0, k, i, neighbours);
    for (std::size_t a = 1; a < angles; ++a) {
      spread(value, from[a], options_.stiffness_per_mm * RayProfiles::step_mm);
      for (int i = 0; i < n; ++i) value[i] += cost(static_cast<Eigen::Index>(a), k, i, neighbours);
    }
    std::vector<int> chain(angles);
    chain.back() = static_cast<int>(std::min_element(value.begin(), value.end()) - value.begin());
    for (std::size_t a = angles - 1; a > 0; --a) chain[a - 1] = from[a][chain[a]];
    return chain;
  }

  const RayProfiles& profiles_;
  const std::vector<float>& costs_;
  const ChestWallOptions& options_;
  Eigen::ArrayXXd superellipse_;  // sample of the superellipse on each ray
};

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

/// The superellipse whose border is cheapest, taken over a few millimetres to either side: no chest is one.
Superellipse fit_superellipse(const RayProfiles& profiles, const std::vector<float>& costs, const ChestWall& wall,
                              double centre_depth_mm) {
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
  return best_superellipse(cost, centre_depth_mm, wall.z(profiles.levels() / 2));
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

/// Takes the cheapest border over to the wall.
void settle(const RayProfiles& profiles, const std::vector<float>& costs, const ChestWallOptions& options,
            ChestWall& wall) {
  const Chains chains = Search(profiles, costs, wall, options).settle();
  wall.radius_mm.resize(profiles.angles(), profiles.levels());
  wall.cost.resize(profiles.angles(), profiles.levels());
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a) {
      const int i = chains[k][a];
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
  wall.superellipse = fit_superellipse(profiles, costs, wall, options.centre_depth_mm);
  settle(profiles, costs, options, wall);
  if (!lines) {
    refine(image, options, wall);
    return wall;
  }
  // What the first look saw is too noisy: start from the superellipse.
  for (Eigen::Index k = 0; k < profiles.levels(); ++k)
    for (Eigen::Index a = 0; a < profiles.angles(); ++a)
      wall.radius_mm(a, k) = wall.superellipse.radius_mm(wall.angle(a), wall.z(k));
  for (const Look& look : closer_looks) {
    profiles = sample_rays(image, body, wall, wall.radius_mm, -look.reach_mm, look.reach_mm);
    blur_profiles(profiles, look.angles, look.levels);
    costs = boundary_costs(profiles, options, true);
    hold_back(front, wall, profiles, options, costs);
    settle(profiles, costs, options, wall);
  }
  return wall;
}

}  // namespace supine::segmentation
