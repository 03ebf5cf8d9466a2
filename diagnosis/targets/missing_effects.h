// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/evidence/hypotheses.h"
#include "diagnosis/targets/conditioned.h"
#include "diagnosis/targets/moves.h"

namespace supine::diagnosis {

/// A set of effects and how likely it is that the model lacks just these.
struct LikelySet {
  std::vector<std::string> effects;
  double probability;
};

/// What the model may lack, as far as the scans tell: straight lines and secants at the base fit, as a diagnosis
/// screens with (hypotheses.h). Empty: it is taken that it lacks nothing.
struct MissingEffects {
  std::vector<Candidate> candidates;
  std::vector<Hypothesis> hypotheses;  ///< most probable first

  /// The likeliest, up to @p most.
  std::vector<LikelySet> likeliest(std::size_t most) const;
};

/// Screens the catalogue at the base fit.
MissingEffects screen_effects(calibration::Evaluator& evaluator, const BaseFit& base, const Priors& priors);

/// Sets that a diagnosis has followed through the chain are as likely as it says; what it leaves is shared by all
/// others as the screening has them. Effects that the model has by now are not asked for again.
/// @return  effects that it names and nobody here knows
std::vector<std::string> weigh_as(const std::vector<LikelySet>& told, const simulation::Model& model,
                                  MissingEffects& missing);

/// A number of an effect beside the numbers of the model: an offset from its null.
struct EffectNumber {
  std::string effect, parameter;
  double null, mean, sd;        ///< the null; of the offset, before the measurement
  std::optional<double> least;  ///< offsets below do not exist
};

/// Of all effects that the model lacks, by what is believed alone.
struct BelievedEffects {
  std::vector<Candidate> candidates;  ///< without slopes; those of one number with a usual size are secants
  std::vector<EffectNumber> numbers;
  std::vector<LikelySet> sets;     ///< nothing, one, two: together 1
  std::vector<DirectionSet> rows;  ///< of them: rows of parameters and nuisances, then of the numbers; one size
};
/// @param parameters  how many numbers stand before the nuisances
/// @param any         false: it is taken that the model lacks nothing
BelievedEffects believed_effects(const simulation::Model& model, const meshing::TetMesh& mesh,
                                 const meshing::Anatomy& anatomy, Eigen::Index parameters,
                                 const std::vector<Nuisance>& nuisances, const Priors& priors, bool any);

/// What numbers of effects move points by, per unit of it, a column each: along the secant of those that have one, else
/// along their slope. A secant in a pose that was not solved with the effect is solved here.
/// @param mesh, anatomy  of the chain in @p at
Eigen::MatrixXd effect_moves(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const PoseAt& at,
                             const simulation::Embedding& points, const std::vector<Candidate>& candidates);

}  // namespace supine::diagnosis
