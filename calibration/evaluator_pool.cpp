// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/evaluator_pool.h"

#include <omp.h>

#include <mutex>
#include <optional>

#include "common/error.h"
#include "common/first_failure.h"
#include "simulation/parameters.h"

namespace supine::calibration {
namespace {

/// Among many draws some tissue is too soft to carry itself. Creeping up to the load at which it collapses would cost
/// as much as dozens of runs, and tells nothing.
const simulation::SolveOptions brief{.max_iterations = 25, .smallest_load_step = 1.0 / 8, .progress = {}};

}  // namespace

EvaluatorPool::EvaluatorPool(const MeasuredScene& scene, const FreeParameters& parameters,
                             simulation::ChainSolution reference, int threads)
    : parameters_(parameters), reference_(std::move(reference)) {
  for (int t = 0; t < std::max(1, threads); ++t)
    evaluators_.push_back(std::make_unique<Evaluator>(scene, parameters.base(), brief));
}

RunResult EvaluatorPool::evaluate(Evaluator& evaluator, const Eigen::VectorXd& values) const {
  simulation::Model model = parameters_.base();
  for (Eigen::Index i = 0; i < values.size(); ++i)
    simulation::find_setting(model, parameters_.names()[static_cast<std::size_t>(i)])->value = values[i];
  try {
    const Prediction prediction = evaluator.predict(model, &reference_);
    const DistanceFigures figures = figures_of(prediction.scan_distances());
    return {false, prediction.mae_study_mm(), figures.mae_mm, figures.rms_mm};
  } catch (const NumericalFailure&) {
    return {};
  }
}

std::vector<RunResult> EvaluatorPool::run(const std::vector<Eigen::VectorXd>& values, RunJournal& journal,
                                          const std::function<void(const RunResult&)>& done) {
  std::vector<RunResult> results(values.size());
  FirstFailure failure;
  std::mutex mutex;
  const auto run_one = [&](std::size_t i) {
    if (const auto known = journal.find(values[i])) {
      results[i] = *known;
      return;
    }
    results[i] = evaluate(*evaluators_[static_cast<std::size_t>(omp_get_thread_num())], values[i]);
    journal.add(values[i], results[i]);
    const std::lock_guard lock(mutex);
    if (done) done(results[i]);
  };
#pragma omp parallel for schedule(dynamic) num_threads(static_cast <int>(evaluators_.size()))
  for (std::size_t i = 0; i < values.size(); ++i) failure.guard([&] { run_one(i); });
  failure.rethrow();
  return results;
}

}  // namespace supine::calibration
