// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/free_parameters.h"

#include <fmt/format.h>

#include <cmath>

#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::calibration {
namespace {

using simulation::Parameter;
using simulation::Setting;

/// Typical size of a step of a parameter that may be zero or negative.
double scale_of(const Setting& setting, const Parameter& row) {
  if (setting.prior_sd) return *setting.prior_sd;
  if (row.one_sided && row.median > 0) return row.median;
  if (!row.one_sided && row.spread > 0) return row.spread;
  return std::max(std::abs(setting.value), 1e-3);
}

void check_start(const std::string& name, double value, double low, double high) {
  if (value < low || value > high)
    throw InputError(fmt::format("{} = {}: the start must lie in its range, {} to {}", name, value, low, high));
}

void push(Eigen::VectorXd& vector, double value) {
  vector.conservativeResize(vector.size() + 1);
  vector[vector.size() - 1] = value;
}

}  // namespace

FreeParameters::FreeParameters(simulation::Model model, std::vector<std::string> names)
    : model_(std::move(model)), names_(std::move(names)) {
  if (names_.empty()) names_ = simulation::free_parameters(model_);
  if (names_.empty())
    throw InputError(
        "the model has no free parameter, so there is nothing to calibrate; write a parameter as a table, for example "
        "young_modulus_kpa = { value = 0.3, prior_sd = 0.3, lower = 0.02, upper = 20 }");
  for (const std::string& name : names_) {
    const Setting* setting = simulation::find_setting(model_, name);
    if (setting == nullptr) throw InputError(fmt::format("the model has no parameter '{}'", name));
    add(name, *setting);
  }
}

void FreeParameters::add(const std::string& name, const Setting& setting) {
  const Parameter& row = *simulation::find_parameter(name);
  const double low = std::max(setting.lower, row.lower), high = std::min(setting.upper, row.upper);
  check_start(name, setting.value, low, high);
  const auto i = static_cast<Eigen::Index>(scale_.size());
  units_.push_back(row.unit);
  log_.push_back(low > 0);
  scale_.push_back(scale_of(setting, row));
  push(start_, coordinate(i, setting.value));
  push(lower_, coordinate(i, low));
  push(upper_, coordinate(i, high));
  priors_.emplace_back();
  if (!setting.prior_sd) return;
  const double sd = log_.back() ? std::log1p(*setting.prior_sd / setting.value) : *setting.prior_sd / scale_.back();
  priors_.back() = Prior{start_[i], sd};
}

void FreeParameters::begin_with(simulation::Model model) {
  for (Eigen::Index i = 0; i < size(); ++i) {
    const std::string& name = names_[static_cast<std::size_t>(i)];
    const double number = simulation::find_setting(model, name)->value;
    check_start(name, number, value(i, lower_[i]), value(i, upper_[i]));
    start_[i] = coordinate(i, number);
  }
}

Eigen::VectorXd FreeParameters::prior_deviation(const Eigen::VectorXd& u) const {
  Eigen::VectorXd deviation = Eigen::VectorXd::Zero(size());
  for (Eigen::Index i = 0; i < size(); ++i)
    if (const auto& prior = priors_[static_cast<std::size_t>(i)]) deviation[i] = (u[i] - prior->mean) / prior->sd;
  return deviation;
}

Eigen::VectorXd FreeParameters::prior_information() const {
  Eigen::VectorXd information = Eigen::VectorXd::Zero(size());
  for (Eigen::Index i = 0; i < size(); ++i)
    if (const auto& prior = priors_[static_cast<std::size_t>(i)]) information[i] = 1 / (prior->sd * prior->sd);
  return information;
}

double FreeParameters::value(Eigen::Index i, double coordinate) const {
  const auto k = static_cast<std::size_t>(i);
  return log_[k] ? std::exp(coordinate) : coordinate * scale_[k];
}

double FreeParameters::coordinate(Eigen::Index i, double value) const {
  const auto k = static_cast<std::size_t>(i);
  return log_[k] ? std::log(value) : value / scale_[k];
}

Eigen::VectorXd FreeParameters::values(const Eigen::VectorXd& u) const {
  Eigen::VectorXd values(u.size());
  for (Eigen::Index i = 0; i < u.size(); ++i) values[i] = value(i, u[i]);
  return values;
}

Eigen::VectorXd FreeParameters::slope(const Eigen::VectorXd& u) const {
  Eigen::VectorXd slope(u.size());
  for (Eigen::Index i = 0; i < u.size(); ++i)
    slope[i] = is_log(i) ? std::exp(u[i]) : scale_[static_cast<std::size_t>(i)];
  return slope;
}

simulation::Model FreeParameters::model(const Eigen::VectorXd& u) const {
  simulation::Model model = model_;
  for (Eigen::Index i = 0; i < u.size(); ++i)
    simulation::find_setting(model, names_[static_cast<std::size_t>(i)])->value = value(i, u[i]);
  return model;
}

bool FreeParameters::at_bound(const Eigen::VectorXd& u, Eigen::Index i) const {
  constexpr double close = 1e-6;
  return u[i] - lower_[i] < close || upper_[i] - u[i] < close;
}

}  // namespace supine::calibration
