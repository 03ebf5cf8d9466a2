// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/cmaes.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <pagmo/algorithms/cmaes.hpp>
#include <pagmo/population.hpp>
#include <pagmo/problem.hpp>

#include "common/error.h"
#include "simulation/parameters.h"

namespace supine::calibration {
namespace {

constexpr double half_box = 100;   // in σ; the ends of the parameters' ranges are kept by the penalty
constexpr double failed_mm = 1e6;  // ranks behind everything
constexpr double penalty_mm = 1;   // per σ²
constexpr int flat_generations = 3;

/// Either notes what is asked or answers from a table, in the order of the questions.
struct Table {
  bool noting = true;
  std::vector<pagmo::vector_double> asked;
  std::vector<double> answers;
  std::size_t next = 0;
};

struct TableProblem {
  std::shared_ptr<Table> table;
  std::size_t dimension = 1;

  pagmo::vector_double fitness(const pagmo::vector_double& x) const {
    if (!table->noting) return {table->answers.at(table->next++)};
    table->asked.push_back(x);
    return {0.0};
  }
  std::pair<pagmo::vector_double, pagmo::vector_double> get_bounds() const {
    return {pagmo::vector_double(dimension, -half_box), pagmo::vector_double(dimension, half_box)};
  }
};

/// Start, σ and range of every parameter, in its own unit.
struct Axes {
  Eigen::VectorXd start, sigma, lower, upper;

  explicit Axes(const FreeParameters& parameters)
      : start(parameters.values(parameters.start())),
        sigma(parameters.size()),
        lower(parameters.values(parameters.lower())),
        upper(parameters.values(parameters.upper())) {
    simulation::Model model = parameters.base();
    for (Eigen::Index i = 0; i < sigma.size(); ++i) {
      const auto* setting = simulation::find_setting(model, parameters.names()[static_cast<std::size_t>(i)]);
      sigma[i] = setting->prior_sd.value_or((upper[i] - lower[i]) / 6);
    }
  }

  Eigen::VectorXd inside(const pagmo::vector_double& x, double& penalty) const {
    const Eigen::Map<const Eigen::VectorXd> z(x.data(), static_cast<Eigen::Index>(x.size()));
    const Eigen::VectorXd wanted = start + sigma.cwiseProduct(z);
    const Eigen::VectorXd values = wanted.cwiseMax(lower).cwiseMin(upper);
    penalty = penalty_mm * (wanted - values).cwiseQuotient(sigma).squaredNorm();
    return values;
  }
};

/// The state of one minimisation.
class Minimisation {
 public:
  Minimisation(EvaluatorPool& pool, const FreeParameters& parameters, const CmaesOptions& options, RunJournal& journal)
      : pool_(pool), options_(options), journal_(journal), axes_(parameters) {
    best_.mae_study_mm = std::numeric_limits<double>::infinity();
  }

  CmaesResult run(int population_size) {
    const auto n = static_cast<std::size_t>(axes_.start.size());
    auto table = std::make_shared<Table>();
    pagmo::population population{pagmo::problem{TableProblem{table, n}}, 0u, options_.seed};
    for (int i = 0; i < population_size; ++i) population.push_back(pagmo::vector_double(n, 0.0), {0.0});
    const pagmo::cmaes algorithm(1u, -1, -1, -1, -1, 1 / (2 * half_box), 0, 0, true, false, options_.seed);
    while (best_.message.empty()) {
      table->noting = true;
      table->asked.clear();
      const pagmo::cmaes copy = algorithm;
      copy.evolve(population);
      table->answers = generation(table->asked);
      table->noting = false;
      table->next = 0;
      population = algorithm.evolve(population);
    }
    if (best_.values.size() == 0)
      throw NumericalFailure(fmt::format(
          "calibration: none of {} runs found an equilibrium; start from stiffer tissue or smaller prior_sd",
          best_.evaluations));
    return best_;
  }

 private:
  /// Runs one generation; the objective of each of its draws.
  std::vector<double> generation(const std::vector<pagmo::vector_double>& asked) {
    std::vector<Eigen::VectorXd> values(asked.size());
    std::vector<double> objective(asked.size());
    for (std::size_t i = 0; i < asked.size(); ++i) values[i] = axes_.inside(asked[i], objective[i]);
    const double before = best_.mae_study_mm;
    const auto results = pool_.run(values, journal_, live_progress());
    double least = failed_mm, most = 0;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      note(values[i], results[i]);
      objective[i] = results[i].failed ? failed_mm : objective[i] + results[i].mae_study_mm;
      least = std::min(least, objective[i]);
      most = std::max(most, objective[i]);
    }
    ++best_.generations;
    const bool flat = most - least < options_.flat_mm && before - best_.mae_study_mm < options_.flat_mm;
    flat_ = flat ? flat_ + 1 : 0;
    decide();
    return objective;
  }

  /// Told run by run; best_ is brought up to date only after the generation, in the order of its draws.
  std::function<void(const RunResult&)> live_progress() const {
    if (!options_.progress) return {};
    return [this, done = best_.evaluations, failed = best_.failed,
            least = best_.mae_study_mm](const RunResult& result) mutable {
      ++done;
      failed += result.failed;
      if (!result.failed) least = std::min(least, result.mae_study_mm);
      options_.progress(done, failed, least);
    };
  }

  void note(const Eigen::VectorXd& values, const RunResult& result) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    ++best_.evaluations;
    FitEvaluation row{values, none, none, none, result.failed, false, best_.generations};
    if (result.failed) {
      ++best_.failed;
    } else {
      row = {values, result.mae_study_mm, result.mae_mm, result.rms_mm, false, false, best_.generations};
      row.accepted = result.mae_study_mm < best_.mae_study_mm;
    }
    if (row.accepted) {
      best_.mae_study_mm = result.mae_study_mm;
      best_.values = values;
    }
    best_.history.push_back(row);
  }

  void decide() {
    best_.target_met = options_.until_mae_mm && best_.mae_study_mm <= *options_.until_mae_mm;
    if (best_.target_met)
      best_.message = fmt::format("the MAE is under {} mm", *options_.until_mae_mm);
    else if (flat_ >= flat_generations)
      best_.message = fmt::format("{} generations without a change above {} mm", flat_generations, options_.flat_mm);
    else if (best_.evaluations >= options_.max_evaluations)
      best_.message = fmt::format("{} evaluations", options_.max_evaluations);
  }

  EvaluatorPool& pool_;
  const CmaesOptions& options_;
  RunJournal& journal_;
  Axes axes_;
  CmaesResult best_;
  int flat_ = 0;
};

}  // namespace

void CmaesOptions::check() const {
  if (population != 0 && population < least_population)
    throw InputError(fmt::format("population = {}: must be 0 or at least {}", population, least_population));
  if (max_evaluations < 1) throw InputError(fmt::format("max_evaluations = {}: must be > 0", max_evaluations));
  if (until_mae_mm && !(*until_mae_mm > 0)) throw InputError(fmt::format("until_mae = {}: must be > 0", *until_mae_mm));
}

CmaesResult minimise_cmaes(EvaluatorPool& pool, const FreeParameters& parameters, const CmaesOptions& options,
                           RunJournal& journal) {
  options.check();
  const int usual = std::max(6, 4 + static_cast<int>(3 * std::log(static_cast<double>(parameters.size()))));
  return Minimisation(pool, parameters, options, journal).run(options.population > 0 ? options.population : usual);
}

}  // namespace supine::calibration
