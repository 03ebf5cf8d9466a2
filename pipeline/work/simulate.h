// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/case/case_inputs.h"
#include "pipeline/tool/tool.h"
#include "simulation/solve/chain.h"

namespace supine::pipeline {

/// newton, fixed-point and reversed-gravity, as --inverse takes them.
const std::map<std::string, simulation::InverseMethod>& inverse_methods();

/// What is asked for beside case and model.
struct SimulateOptions {
  std::vector<std::string> poses = {};  ///< of the case; empty = all
  std::string inverse = "newton";       ///< of inverse_methods()
};

/// A chain that was solved, and how.
struct Simulated {
  std::vector<simulation::PoseLoad> loads;  ///< the imaged pose, then those of solution.poses
  std::string inverse;
  simulation::ChainSolution solution;
};

/// The imaged pose and the wanted ones, in the order of the case.
/// @throws InputError  no such pose
std::vector<simulation::PoseLoad> loads_of(const Case& description, const std::vector<std::string>& wanted);

/// Where linear cells are too stiff for the model's Poisson ratio.
void warn_of_locking(Run& run, const CaseInputs& inputs);

/// What supine-simulate does between reading and writing. Says how far it is; warns of what the chain
/// warns of.
/// @throws InputError, NumericalFailure  as simulation::solve_chain(); no such inverse or pose
Simulated simulate(Run& run, const CaseInputs& inputs, const SimulateOptions& options);

/// Whether the answer is certain: one balanced shape per pose, and a round trip that ends where it began. Warns
/// otherwise.
Outcome judge(Run& run, const Simulated& simulated);

/// Solves that say how far they are.
simulation::SolveOptions solve_options(Run& run);

/// The shape of that name, #N by 3, mm: the imaged pose, undeformed, or another pose that was solved.
/// @throws InputError  listing the shapes there are
const Points& shape_of(const simulation::ChainSolution& solution, const std::string& imaged_pose,
                       const std::string& name);
const Points& shape_of(const Simulated& simulated, const std::string& name);

/// The figures of a shape's sidecar, as in docs/supine-simulate.md.
/// @throws InputError  as shape_of()
nlohmann::ordered_json shape_figures(const CaseInputs& inputs, const Simulated& simulated, const std::string& name);

/// Writes the shape as POSE.vtu of supine-simulate: with `displacement_mm`, `det_f`, and of the imaged pose
/// `round_trip_error_mm`.
/// @throws InputError  as shape_of(); the file cannot be written
void write_shape(const CaseInputs& inputs, const Simulated& simulated, const std::string& name,
                 const std::filesystem::path& file);

/// The lines a person reads.
void say_simulated(const Run& run, const CaseInputs& inputs, const Simulated& simulated);

}  // namespace supine::pipeline
