// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/curved_density.h"

#include <algorithm>
#include <boost/math/interpolators/makima.hpp>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index fine = 2000;         // trapezoids
constexpr double forgotten = 30;     // of ln: what is further down has no mass
constexpr double least_slope = 0.1;  // of ln per width of all places, beyond them

/// How far the curve is followed beyond an outermost place where it falls by @p slope per unit.
double reach(double slope, double width) { return forgotten / std::max(slope, least_slope / width); }

}  // namespace

CurvedDensity::CurvedDensity(std::vector<double> at, std::vector<double> ln, double lower, double upper) {
  if (at.size() < 4 || at.size() != ln.size() ||
      std::adjacent_find(at.begin(), at.end(), std::greater_equal<>()) != at.end())
    throw std::invalid_argument("a density needs four ascending places");
  const double first = at.front(), last = at.back(), width = last - first;
  const double at_first = ln.front(), at_last = ln.back();
  const double most = *std::max_element(ln.begin(), ln.end());
  const double rises = std::max(0.0, (ln[1] - ln[0]) / (at[1] - at[0]));
  const double falls = std::max(0.0, (ln[ln.size() - 2] - ln.back()) / (at.back() - at[at.size() - 2]));
  const boost::math::interpolators::makima<std::vector<double>> curve(std::move(at), std::move(ln));
  const double from = std::max(lower, first - reach(rises, width)), to = std::min(upper, last + reach(falls, width));
  place_ = VectorXd::LinSpaced(fine + 1, from, to);
  VectorXd density(fine + 1);
  for (Index k = 0; k <= fine; ++k) {
    const double u = place_[k];
    const double here = u < first ? at_first - (first - u) * rises : u > last ? at_last - (u - last) * falls : curve(u);
    density[k] = std::exp(here - most);
  }
  below_ = VectorXd::Zero(fine + 1);
  const double step = (to - from) / static_cast<double>(fine);
  for (Index k = 1; k <= fine; ++k) below_[k] = below_[k - 1] + 0.5 * step * (density[k - 1] + density[k]);
  ln_mass_ = most + std::log(below_[fine]);
  below_ /= below_[fine];
}

double CurvedDensity::quantile(double p) const {
  const auto above = std::lower_bound(below_.begin(), below_.end(), p);
  const Index k = std::max<Index>(1, above - below_.begin());
  const double share = (p - below_[k - 1]) / std::max(below_[k] - below_[k - 1], 1e-300);
  return place_[k - 1] + share * (place_[k] - place_[k - 1]);
}

}  // namespace supine::diagnosis
