// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/anatomy/foot.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"

namespace supine::meshing {
namespace {

constexpr int sectors = 48;
constexpr int harmonics = 3;
constexpr double step_mm = 1.0;          // of the radial profiles
constexpr double radial_width_mm = 2.5;  // standard deviations of the kernel that smooths them
constexpr double angular_width_rad = 0.16;
constexpr double outer_band = 0.82;  // the rim is looked for beyond this share of the edge's radius
constexpr double rise = 0.025;       // share of the mound's height by which the foot stands over the rim

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

struct Polar {
  double radius_mm, theta, thickness_mm, area_mm2;
};

// Largest radius of the inner surface per sector, smoothed over the neighbours.
std::vector<double> edge_radii(const std::vector<Eigen::Vector2d>& inner, const Eigen::Vector2d& centre) {
  std::vector<double> edge(sectors, 0);
  for (const Eigen::Vector2d& p : inner) {
    const Eigen::Vector2d d = p - centre;
    const int s =
        static_cast<int>(std::floor((std::atan2(d.y(), d.x()) / (2 * std::numbers::pi) + 1) * sectors)) % sectors;
    edge[s] = std::max(edge[s], d.norm());
  }
  // A coarse mesh may have no point of its edge in a sector; the chord between neighbours is then a good guess.
  std::vector<double> filled(sectors);
  for (int s = 0; s < sectors; ++s) {
    const double beside = (edge[(s + 1) % sectors] + edge[(s + sectors - 1) % sectors]) / 2;
    filled[s] = std::max(edge[s], 0.98 * beside);
  }
  return filled;
}

// Kernel-smoothed thickness along one azimuth, every step_mm from the centre to the edge; negative where no skin is
// near.
std::vector<double> profile(const std::vector<Polar>& skin, double theta, double edge_mm) {
  std::vector<double> weight(static_cast<std::size_t>(edge_mm / step_mm) + 1, 0.0), sum(weight.size(), 0.0);
  for (const Polar& p : skin) {
    const double turn = wrapped(p.theta - theta) / angular_width_rad;
    if (std::abs(turn) > 2.5 && p.radius_mm > 10) continue;
    const int reach = static_cast<int>(std::ceil(3 * radial_width_mm / step_mm));
    const int nearest = static_cast<int>(std::lround(p.radius_mm / step_mm));
    for (int i = std::max(0, nearest - reach); i <= std::min<int>(nearest + reach, static_cast<int>(sum.size()) - 1);
         ++i) {
      const double away = (p.radius_mm - i * step_mm) / radial_width_mm;
      const double w = p.area_mm2 * std::exp(-(away * away + turn * turn) / 2);
      weight[i] += w;
      sum[i] += w * p.thickness_mm;
    }
  }
  std::vector<double> smooth(sum.size(), -1.0);
  for (std::size_t i = 0; i < sum.size(); ++i) {
    if (weight[i] > 1e-3) smooth[i] = sum[i] / weight[i];
  }
  return smooth;
}

// Radius at which the profile, followed inward, rises over its rim for good.
double foot_of(const std::vector<double>& thickness, double height_mm) {
  const int last = static_cast<int>(thickness.size()) - 1;
  double rim = 1e300;
  int lowest = last;
  for (int i = static_cast<int>(outer_band * last); i <= last; ++i) {
    if (thickness[i] >= 0 && thickness[i] < rim) {
      rim = thickness[i];
      lowest = i;
    }
  }
  const double level = rim + rise * std::max(0.0, height_mm - rim);
  for (int i = lowest; i > 0; --i) {
    if (thickness[i] < level && thickness[i - 1] >= level) {
      return step_mm * (i - 1 + (thickness[i - 1] - level) / (thickness[i - 1] - thickness[i]));
    }
  }
  return step_mm * lowest;
}

Eigen::VectorXd fit_fourier(const std::vector<double>& radius) {
  Eigen::VectorXd fourier = Eigen::VectorXd::Zero(1 + 2 * harmonics);
  for (int s = 0; s < sectors; ++s) {
    const double theta = 2 * std::numbers::pi * (s + 0.5) / sectors;
    fourier[0] += radius[s] / sectors;
    for (int m = 1; m <= harmonics; ++m) {
      fourier[2 * m - 1] += 2 * radius[s] * std::cos(m * theta) / sectors;
      fourier[2 * m] += 2 * radius[s] * std::sin(m * theta) / sectors;
    }
  }
  return fourier;
}

std::vector<Polar> to_polar(const std::vector<SkinSample>& skin, const Eigen::Vector2d& centre) {
  std::vector<Polar> polar;
  polar.reserve(skin.size());
  for (const SkinSample& s : skin) {
    const Eigen::Vector2d d = s.place_mm - centre;
    polar.push_back({d.norm(), std::atan2(d.y(), d.x()), s.thickness_mm, s.area_mm2});
  }
  return polar;
}

double mean_rim(const std::vector<Polar>& skin, const Eigen::VectorXd& fourier, const std::vector<double>& edge) {
  double area = 0, sum = 0;
  for (const Polar& p : skin) {
    const int s = static_cast<int>(std::floor((p.theta / (2 * std::numbers::pi) + 1) * sectors)) % sectors;
    if (p.radius_mm < std::min(fourier_radius(fourier, p.theta), 0.98 * edge[s]) || p.radius_mm > edge[s]) continue;
    area += p.area_mm2;
    sum += p.area_mm2 * p.thickness_mm;
  }
  return area > 0 ? sum / area : 0;
}

}  // namespace

double fourier_radius(const Eigen::VectorXd& fourier, double theta) {
  double radius = fourier[0];
  for (int m = 1; 2 * m < fourier.size(); ++m) {
    radius += fourier[2 * m - 1] * std::cos(m * theta) + fourier[2 * m] * std::sin(m * theta);
  }
  return radius;
}

Foot find_foot(const std::vector<SkinSample>& skin, const std::vector<Eigen::Vector2d>& inner_mm,
               const Eigen::Vector2d& start_mm) {
  double height = 0;
  for (const SkinSample& s : skin) height = std::max(height, s.thickness_mm);
  if (!(height > 0)) throw InputError("no skin lies over the muscle: does the muscle's sheet face the breast?");
  Foot foot{start_mm, {}, 0};
  for (int round = 0; round < 12; ++round) {
    const std::vector<Polar> polar = to_polar(skin, foot.centre_mm);
    const std::vector<double> edge = edge_radii(inner_mm, foot.centre_mm);
    std::vector<double> radius(sectors);
    for (int s = 0; s < sectors; ++s) {
      radius[s] = foot_of(profile(polar, 2 * std::numbers::pi * (s + 0.5) / sectors, edge[s]), height);
    }
    foot.fourier = fit_fourier(radius);
    foot.rim_thickness_mm = mean_rim(polar, foot.fourier, edge);
    const Eigen::Vector2d shift(foot.fourier[1], foot.fourier[2]);
    if (shift.norm() < 0.05) break;
    foot.centre_mm += 0.8 * shift;
  }
  return foot;
}

}  // namespace supine::meshing
