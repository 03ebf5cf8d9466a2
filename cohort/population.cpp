// SPDX-License-Identifier: AGPL-3.0-or-later
#include "cohort/population.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace supine::cohort {
namespace {

using Eigen::ArrayXd;

constexpr int shares = 101, means = 25, spreads = 7, errors = 11;

double ln_normal(double x, double variance) { return -0.5 * (x * x / variance + std::log(2 * M_PI * variance)); }

/// Of weights that add up to 1 over ascending places: the middle and the ends of the 95 % interval, between the places.
Estimate quantiles(const ArrayXd& places, const ArrayXd& weights) {
  const auto at = [&](double share) {
    double sum = 0;
    for (Eigen::Index i = 0; i < places.size(); ++i) {
      if (sum + weights[i] >= share) {
        const double below = i == 0 ? places[0] : 0.5 * (places[i] + places[i - 1]);
        const double above = i + 1 == places.size() ? places[i] : 0.5 * (places[i] + places[i + 1]);
        return below + (above - below) * (share - sum) / weights[i];
      }
      sum += weights[i];
    }
    return places[places.size() - 1];
  };
  return {at(0.5), at(0.025), at(0.975)};
}

/// exp of logarithms, adding up to 1; @p ln_sum their sum's logarithm.
ArrayXd normalised(const ArrayXd& logarithms, double& ln_sum) {
  const double most = logarithms.maxCoeff();
  const ArrayXd weights = (logarithms - most).exp();
  ln_sum = most + std::log(weights.sum());
  return weights / weights.sum();
}

/// Places over ±reach standard deviations, and the logarithm of the prior's mass in each.
struct Grid {
  ArrayXd place, ln_prior;
};

Grid normal_grid(double mean, double sd, int count, double reach) {
  if (sd == 0) return {ArrayXd::Constant(1, mean), ArrayXd::Zero(1)};
  Grid grid{ArrayXd::LinSpaced(count, mean - reach * sd, mean + reach * sd), {}};
  double sum = 0;
  grid.ln_prior = -0.5 * ((grid.place - mean) / sd).square();
  normalised(grid.ln_prior, sum);
  grid.ln_prior -= sum;
  return grid;
}

Grid half_normal_grid(double scale, int count) {
  Grid grid{ArrayXd::LinSpaced(count, 0, 2.5 * scale), {}};
  double sum = 0;
  grid.ln_prior = -0.5 * (grid.place / scale).square();
  normalised(grid.ln_prior, sum);
  grid.ln_prior -= sum;
  return grid;
}

/// The patients as arrays.
struct Patients {
  ArrayXd mean, variance, anchor, ln_factor;  // variance: of the likelihood and of what is never known
  bool with_strength;

  explicit Patients(const EffectEvidence& e) {
    const auto n = static_cast<Eigen::Index>(e.patients.size());
    mean = anchor = ln_factor = ArrayXd::Zero(n);
    variance = ArrayXd::Ones(n);
    with_strength =
        std::any_of(e.patients.begin(), e.patients.end(), [](const auto& p) { return p.strength.has_value(); });
    for (Eigen::Index i = 0; i < n; ++i) {
      const EffectEvidence::Patient& p = e.patients[static_cast<std::size_t>(i)];
      ln_factor[i] = p.ln_bayes_factor;
      if (!p.strength) {
        variance[i] = HUGE_VAL;
        continue;
      }
      const double seen = p.strength->sd * p.strength->sd;
      mean[i] = p.strength->mean, variance[i] = seen + e.null_sd * e.null_sd;
      // The case's own evidence stands; the normal law only says how it changes with the population's strengths.
      anchor[i] = p.ln_bayes_factor -
                  (ln_normal(mean[i] - e.prior_mean, seen + e.prior_sd * e.prior_sd) - ln_normal(mean[i], variance[i]));
    }
  }

  /// ln of the likelihood of having the effect, and of not having it, against nothing at all (δ = 0).
  void weigh(double m, double w, double delta, ArrayXd& with, ArrayXd& without) const {
    with.resize(mean.size()), without.resize(mean.size());
    for (Eigen::Index i = 0; i < mean.size(); ++i) {
      if (std::isinf(variance[i])) {
        with[i] = ln_factor[i], without[i] = 0;
        continue;
      }
      const double nothing = ln_normal(mean[i], variance[i]);
      with[i] = anchor[i] + ln_normal(mean[i] - m - delta, variance[i] + w * w) - nothing;
      without[i] = ln_normal(mean[i] - delta, variance[i]) - nothing;
    }
  }
};

/// Everything summed over the grid.
struct Sums {
  ArrayXd by_share = ArrayXd::Constant(shares, -HUGE_VAL), by_mean, by_error;
  double none = -HUGE_VAL;
  // Σ weight × probability of having it, and Σ weight, both over exp(reference).
  ArrayXd having;
  double weight = 0, reference = -HUGE_VAL;

  void add_having(double ln, const ArrayXd& probability) {
    if (ln > reference) {
      const double less = std::isinf(reference) ? 0 : std::exp(reference - ln);
      having *= less, weight *= less, reference = ln;
    }
    having += std::exp(ln - reference) * probability;
    weight += std::exp(ln - reference);
  }
};

double ln_add(double a, double b) {
  if (a < b) std::swap(a, b);
  return std::isinf(a) ? a : a + std::log1p(std::exp(b - a));
}

}  // namespace

NormalPopulation pool_normal(const std::vector<Likelihood>& patients, double about, double wide) {
  constexpr int count = 200, places = 801;
  const double mean_variance = 100 * wide * wide;
  const Grid grid = half_normal_grid(wide, count);
  ArrayXd ln_weight = grid.ln_prior, mean(count), variance(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    double information = 1 / mean_variance, sum = about / mean_variance, square = about * about / mean_variance,
           ln_det = 0;
    for (const Likelihood& p : patients) {
      const double v = p.sd * p.sd + grid.place[k] * grid.place[k];
      information += 1 / v, sum += p.mean / v, square += p.mean * p.mean / v, ln_det += std::log(v);
    }
    variance[k] = 1 / information, mean[k] = sum / information;
    ln_weight[k] += -0.5 * (ln_det + std::log(information) + square - sum * sum / information);
  }
  double none = 0;
  const ArrayXd weight = normalised(ln_weight, none);
  const double middle = (weight * mean).sum();
  const double total = (weight * (variance + (mean - middle).square())).sum();
  const ArrayXd at = ArrayXd::LinSpaced(places, middle - 6 * std::sqrt(total), middle + 6 * std::sqrt(total));
  ArrayXd density = ArrayXd::Zero(places);
  for (Eigen::Index k = 0; k < count; ++k)
    density += weight[k] * (-0.5 * (at - mean[k]).square() / variance[k]).exp() / std::sqrt(variance[k]);
  density /= density.sum();
  const double within = (weight * grid.place.square()).sum();
  return {quantiles(at, density), quantiles(grid.place, weight), {middle, std::sqrt(total + within)}, patients.size()};
}

Prevalence pool_effect(const EffectEvidence& evidence, double prior_probability) {
  const Patients patients(evidence);
  const auto n = static_cast<Eigen::Index>(evidence.patients.size());
  const bool strength = patients.with_strength;
  const Grid m = strength ? normal_grid(evidence.prior_mean, evidence.prior_sd, means, 3)
                          : Grid{ArrayXd::Zero(1), ArrayXd::Zero(1)};
  const Grid w =
      strength ? half_normal_grid(0.5 * evidence.prior_sd, spreads) : Grid{ArrayXd::Zero(1), ArrayXd::Zero(1)};
  const Grid d = normal_grid(0, strength ? evidence.shared_sd : 0, errors, 2.5);
  // Shares in the middles of their bins: neither none nor all.
  const ArrayXd share = (ArrayXd::LinSpaced(shares, 0, shares - 1) + 0.5) / shares;
  Sums sums;
  sums.by_mean = ArrayXd::Constant(m.place.size(), -HUGE_VAL);
  sums.by_error = ArrayXd::Constant(d.place.size(), -HUGE_VAL);
  sums.having = ArrayXd::Zero(n);
  ArrayXd with, without;
  for (Eigen::Index k = 0; k < d.place.size(); ++k) {
    patients.weigh(0, 0, d.place[k], with, without);
    sums.none = ln_add(sums.none, d.ln_prior[k] + without.sum());
    for (Eigen::Index i = 0; i < m.place.size(); ++i)
      for (Eigen::Index j = 0; j < w.place.size(); ++j) {
        patients.weigh(m.place[i], w.place[j], d.place[k], with, without);
        const double before = d.ln_prior[k] + m.ln_prior[i] + w.ln_prior[j] - std::log(shares);
        const ArrayXd most = with.max(without), a = (with - most).exp(), b = (without - most).exp();
        for (Eigen::Index s = 0; s < shares; ++s) {
          const ArrayXd mixed = share[s] * a + (1 - share[s]) * b;
          const double ln = before + (most + mixed.log()).sum();
          sums.by_share[s] = ln_add(sums.by_share[s], ln);
          sums.by_mean[i] = ln_add(sums.by_mean[i], ln);
          sums.by_error[k] = ln_add(sums.by_error[k], ln);
          sums.add_having(ln, share[s] * a / mixed);
        }
      }
  }
  Prevalence found;
  double some = 0, unused = 0;
  const ArrayXd share_weight = normalised(sums.by_share, some);
  found.ln_bayes_factor = some - sums.none;
  found.probability =
      1 / (1 + std::exp(std::log1p(-prior_probability) - std::log(prior_probability) - found.ln_bayes_factor));
  found.share = quantiles(share, share_weight);
  if (strength) found.mean = quantiles(m.place, normalised(sums.by_mean, unused));
  if (strength && evidence.shared_sd > 0) found.shared = quantiles(d.place, normalised(sums.by_error, unused));
  for (const double having : sums.having) found.in_patient.push_back(found.probability * having / sums.weight);
  return found;
}

}  // namespace supine::cohort
