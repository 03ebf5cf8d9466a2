// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/monte_carlo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::calibration {
namespace {

constexpr int most_tries = 1000;  // of one draw

double spread_of(const FreeParameters& parameters, Eigen::Index i) {
  simulation::Model model = parameters.base();
  const std::string& name = parameters.names()[static_cast<std::size_t>(i)];
  const auto& sd = simulation::find_setting(model, name)->prior_sd;
  if (!sd) throw InputError(fmt::format("{} has no prior_sd, so there is no law to draw it from", name));
  return *sd;
}

/// One draw of all parameters; false when one of them is outside its range.
bool draw(const FreeParameters& parameters, DrawKind kind, std::mt19937_64& generator, Eigen::VectorXd& values) {
  std::normal_distribution<double> normal;
  bool inside = true;
  for (Eigen::Index i = 0; i < parameters.size(); ++i) {
    const double step = normal(generator);
    if (kind == DrawKind::prior) {
      const Prior& prior = *parameters.priors()[static_cast<std::size_t>(i)];
      values[i] = parameters.value(i, prior.mean + step * prior.sd);
    } else {
      values[i] = parameters.value(i, parameters.start()[i]) + step * spread_of(parameters, i);
    }
    inside = inside && values[i] >= parameters.value(i, parameters.lower()[i]) &&
             values[i] <= parameters.value(i, parameters.upper()[i]);
  }
  return inside;
}

}  // namespace

Draws draw_parameters(const FreeParameters& parameters, DrawKind kind, int count, unsigned seed) {
  if (count < 1) throw InputError(fmt::format("samples = {}: must be > 0", count));
  for (Eigen::Index i = 0; i < parameters.size(); ++i) spread_of(parameters, i);
  Draws draws;
  Eigen::VectorXd values(parameters.size());
  for (int sample = 0; sample < count; ++sample) {
    std::seed_seq sequence{seed, static_cast<unsigned>(sample)};
    std::mt19937_64 generator(sequence);
    int tries = 1;
    while (!draw(parameters, kind, generator, values)) {
      if (++tries > most_tries)
        throw InputError(
            fmt::format("{} draws in a row lay outside the parameters' ranges; widen the ranges or make "
                        "prior_sd smaller",
                        most_tries));
      ++draws.refused;
    }
    draws.values.push_back(values);
  }
  return draws;
}

Eigen::VectorXd first_order_shares(const Eigen::MatrixXd& values, const Eigen::VectorXd& result) {
  const Eigen::Index n = values.rows();
  const auto classes = std::max<Eigen::Index>(2, static_cast<Eigen::Index>(std::sqrt(static_cast<double>(n))));
  const double mean = result.mean(), total = (result.array() - mean).square().sum();
  if (!(total > 0)) return Eigen::VectorXd::Zero(values.cols());
  if (values.cols() == 1) return Eigen::VectorXd::Ones(1);
  Eigen::VectorXd shares(values.cols());
  std::vector<Eigen::Index> order(static_cast<std::size_t>(n));
  for (Eigen::Index p = 0; p < values.cols(); ++p) {
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&values, p](Eigen::Index a, Eigen::Index b) { return values(a, p) < values(b, p); });
    double between = 0;
    for (Eigen::Index c = 0; c < classes; ++c) {
      const Eigen::Index begin = c * n / classes, end = (c + 1) * n / classes;
      double sum = 0;
      for (Eigen::Index k = begin; k < end; ++k) sum += result[order[static_cast<std::size_t>(k)]] - mean;
      between += sum * sum / static_cast<double>(end - begin);
    }
    // ω² of analysis of variance: chance alone gives (classes − 1) times the variance within classes.
    const double within = (total - between) / static_cast<double>(n - classes);
    shares[p] = std::clamp((between - static_cast<double>(classes - 1) * within) / (total + within), 0.0, 1.0);
  }
  return shares;
}

}  // namespace supine::calibration
