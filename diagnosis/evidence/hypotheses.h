// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/candidates.h"
#include "diagnosis/evidence/base_fit.h"

namespace supine::diagnosis {

/// ln of the evidence: where a refit ends so far from what lines promise, they bend too much to be followed.
inline constexpr double lines_bend_at = 20;

/// A set of effects that may be missing, and how likely it is.
struct Hypothesis {
  std::vector<int> effects;                         ///< rows of the candidates, ascending; none: nothing is missing
  double ln_prior = 0;                              ///< of the set
  double ln_evidence = 0;                           ///< up to what is the same for all
  double screened = 0;                              ///< the same along straight lines
  double probability = 0;                           ///< posterior, over all that were weighed
  bool refitted = false;                            ///< through the whole chain, else along straight lines
  int drawn_at = -1;                                ///< refit from which the lines were drawn; -1: the base fit
  bool from_usual = false;                          ///< lines are those of its effect at its usual size
  bool again = false;                               ///< refitted where it had been: says nothing of lines
  const BaseFit* ground = nullptr;                  ///< whose errors it was weighed under
  double ln_unlisted = 0;                           ///< of what a cause that no effect lists may add (unlisted.h)
  std::array<double, local_kinds> with_unlisted{};  ///< share of its probability with one, by kind
  bool unsolved = false;                            ///< the chain found no equilibrium: stays as screened
  Weighed weighed;                                  ///< by rows
  std::vector<int> rows;                            ///< of the evidence's directions
  std::shared_ptr<const LinearEvidence> evidence;   ///< it was weighed by

  /// Place of a direction in `weighed`, or -1.
  int place_of(const std::string& name) const;
};

/// Whether a set of effects holds another, itself included; both ascending.
bool is_part_of(const std::vector<int>& part, const std::vector<int>& whole);

/// Every hypothesis weighed along straight lines from the base fit: none, all singles, all pairs, triples on the best
/// pairs. An effect of one number that has a usual size goes along the secant to it, the others along their slopes.
class Screening {
 public:
  Screening(const BaseFit& base, const std::vector<Candidate>& candidates, const Priors& priors);

  /// Most probable first.
  const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }

 private:
  Hypothesis weigh(std::vector<int> effects) const;

  Priors priors_;
  const BaseFit& base_;
  std::vector<std::string> effects_;
  std::vector<int> base_rows_;
  std::vector<std::vector<int>> of_effect_, replaced_;  // rows of the directions
  std::shared_ptr<const LinearEvidence> evidence_;
  std::vector<Hypothesis> hypotheses_;
};

/// The set of a refit with each further effect, weighed along straight lines from that refit.
/// @param ground   whose errors count
/// @param at       the refit
/// @param part     its hypothesis
/// @param effects  all that are weighed, in the order that hypotheses count them
/// @param further  those that @p part does not have, with their slopes at the refit
std::vector<Hypothesis> screen_beside(const BaseFit& ground, const JointFit& at, const Hypothesis& part,
                                      const std::vector<std::string>& effects, const std::vector<Candidate>& further,
                                      const Priors& priors);

/// What was not followed through the chain is lowered by the smallest fall of the evidence that following showed, and
/// by the largest that a part of it showed: where lines promise too much of an effect they do so of every set that
/// holds it. It is a gain over nothing that they promise, so not below nothing's.
void lower_unfollowed(std::vector<Hypothesis>& hypotheses);

/// ln of prior, evidence, what an unlisted cause adds, and the weight of the errors it is under.
double ln_weight(const Hypothesis& h);

/// Fills the probabilities and puts the most probable first.
void normalise(std::vector<Hypothesis>& hypotheses);

/// Σ of the probabilities of what holds the effect.
double inclusion(const std::vector<Hypothesis>& hypotheses, int effect);

/// Change of the distances by the usual size of every candidate of one number that has one, solved with the model of
/// a fit: Candidate::secant. Where a nuisance says some of it already, it is what the rest of it changes, as if
/// all of it did.
/// @param keep_shapes  in Candidate::secant_at
void find_secants(const calibration::MeasuredScene& scene, const BaseFit& base, const JointFit& at,
                  std::vector<Candidate>& candidates, bool keep_shapes = false);

}  // namespace supine::diagnosis
