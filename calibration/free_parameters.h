// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "simulation/model.h"

namespace supine::calibration {

/// What is believed of one coordinate before the measurement: normal, in the coordinate. For a positive parameter,
/// whose coordinate is ln(value), that is log-normal with the median `value` and log-sd ln(1 + prior_sd/value).
struct Prior {
  double mean, sd;
};

/// The free numbers of a model as one vector, in coordinates in which steps of equal size mean about the same.
///
/// A parameter whose range is above zero has the coordinate u = ln(value); one that may be zero or negative has
/// u = value / scale, its scale being the prior's spread, or the typical size the catalogue gives.
class FreeParameters {
 public:
  /// @param names  parameters to be varied; empty = those the model declares free (simulation::free_parameters)
  /// @throws InputError  no free parameter; a name the model does not have; a start outside its range
  explicit FreeParameters(simulation::Model model, std::vector<std::string> names = {});

  Eigen::Index size() const { return start_.size(); }
  const std::vector<std::string>& names() const { return names_; }
  const std::string& unit(Eigen::Index i) const { return units_[static_cast<std::size_t>(i)]; }
  bool is_log(Eigen::Index i) const { return log_[static_cast<std::size_t>(i)]; }
  const simulation::Model& base() const { return model_; }

  const Eigen::VectorXd& start() const { return start_; }
  /// Searches begin with the numbers of @p model, which has all of these parameters; priors stay where they are.
  /// @throws InputError  a number outside its range
  void begin_with(simulation::Model model);
  const Eigen::VectorXd& lower() const { return lower_; }
  const Eigen::VectorXd& upper() const { return upper_; }
  /// One per parameter; none where the model names no prior_sd.
  const std::vector<std::optional<Prior>>& priors() const { return priors_; }
  /// (u − mean) / sd, 0 where there is no prior.
  Eigen::VectorXd prior_deviation(const Eigen::VectorXd& u) const;
  /// 1 / sd², 0 where there is no prior.
  Eigen::VectorXd prior_information() const;

  double value(Eigen::Index i, double coordinate) const;
  double coordinate(Eigen::Index i, double value) const;
  Eigen::VectorXd values(const Eigen::VectorXd& u) const;
  /// d value / d coordinate.
  Eigen::VectorXd slope(const Eigen::VectorXd& u) const;
  /// The model with these numbers, everything else as given.
  simulation::Model model(const Eigen::VectorXd& u) const;
  /// @p u moved into the range.
  Eigen::VectorXd clamped(const Eigen::VectorXd& u) const { return u.cwiseMax(lower_).cwiseMin(upper_); }
  /// Whether coordinate i lies within 1e-6 of an end of its range.
  bool at_bound(const Eigen::VectorXd& u, Eigen::Index i) const;

 private:
  void add(const std::string& name, const simulation::Setting& setting);

  simulation::Model model_;
  std::vector<std::string> names_, units_;
  std::vector<bool> log_;
  std::vector<double> scale_;
  Eigen::VectorXd start_, lower_, upper_;
  std::vector<std::optional<Prior>> priors_;
};

}  // namespace supine::calibration
