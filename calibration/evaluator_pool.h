// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "calibration/evaluator.h"
#include "calibration/run_journal.h"

namespace supine::calibration {

/// Many chain runs, one evaluator per thread. Each run starts from the same solution, so that its result depends on
/// nothing but its own numbers: neither on the threads nor on the runs before it.
class EvaluatorPool {
 public:
  /// @param reference  solution of @p parameters' start, or of another model near what will be asked
  /// @param threads    at least 1
  EvaluatorPool(const MeasuredScene& scene, const FreeParameters& parameters, simulation::ChainSolution reference,
                int threads);

  /// @param values   of the parameters, one vector per run
  /// @param journal  asked first, told after
  /// @param done     called after every run that was not in the journal, by any thread, one at a time; may be empty
  std::vector<RunResult> run(const std::vector<Eigen::VectorXd>& values, RunJournal& journal,
                             const std::function<void(const RunResult&)>& done = {});

 private:
  RunResult evaluate(Evaluator& evaluator, const Eigen::VectorXd& values) const;

  const FreeParameters& parameters_;
  simulation::ChainSolution reference_;
  std::vector<std::unique_ptr<Evaluator>> evaluators_;
};

}  // namespace supine::calibration
