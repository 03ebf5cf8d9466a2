// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/evidence/linear_evidence.h"
#include "diagnosis/evidence/patchiness.h"
#include "simulation/model.h"

namespace supine::diagnosis {

struct BaseFit;
struct Hypothesis;
struct Priors;

/// Kinds of local causes that no effect lists, and how many there are.
enum class LocalKind { tissue, skin, muscle };
inline constexpr std::size_t local_kinds = 3;
/// Standard deviations of a cause's size about nothing, each alike, in those of its field.
inline constexpr std::array<double, 3> local_cause_sizes{2, 4, 8};
/// Probability from which a local cause is worth telling: twice what it is before anything is measured, by and large.
inline constexpr double worth_telling = 0.2;
/// "tissue", "skin", "muscle".
std::string local_kind_name(LocalKind kind);

/// Local causes as rivals of listed ones: tissue or skin of another stiffness at some place, a muscle that lies
/// elsewhere there. Each is a bump as wide as its field of patchiness.h is alike (where a body is uneven there, what it
/// is in the mean about it), at one of up to 50 places spread over the body.
struct LocalCauses {
  Eigen::MatrixXd columns;      ///< what one standard deviation of its field there does to the distances, mm, over the
                                ///< clusters, #clusters by #causes
  std::vector<LocalKind> kind;  ///< of each
  Points place;                 ///< of each, mm, in the imaged shape
  Points anatomy;               ///< of each: lateral, head, height over the muscle, in foot radii
  Eigen::VectorXd unit;         ///< the standard deviation: of ln of the stiffness, of the muscle's place mm
};

/// @param shapes  patchiness_shapes() over the clusters, of the same @p mechanics and @p patchiness
LocalCauses local_causes(const simulation::Mechanics& mechanics, const Patchiness& patchiness,
                         const Eigen::MatrixXd& shapes);

/// A local cause that was followed through the chain, its place and width free (local_fit.h), beside nothing else.
struct FollowedCause {
  LocalKind kind = LocalKind::tissue;
  double ln_gain = 0;  ///< of the evidence with it, at any place and of any size, over that without
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  double within_mm = 0;                   ///< rms distance of what is likely from there
  double size = 0, low = 0, high = 0;     ///< as those of Unlisted; 95 %
  simulation::EffectSetting effect = {};  ///< as an effect of a model, of that size
};

/// How likely a cause is there that no effect lists, whatever else is.
struct Unlisted {
  double probability = 0;
  std::array<double, local_kinds> by_kind = {};  ///< Σ = probability
  /// The likeliest, beside the set it is likeliest beside.
  LocalKind kind = LocalKind::tissue;
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  double within_mm = 0;                ///< rms distance of the other places of its kind, each as likely as it is
  double size = 0, low = 0, high = 0;  ///< ln of how many times as stiff; mm outward of the muscle; 95 %
  std::optional<simulation::EffectSetting> effect = {};  ///< that it is in a model; none where it was not followed
};

/// Whether one such cause more is there, beside each hypothesis: before, with Priors::unlisted, of each kind and at
/// each place alike, of a size that is normal about nothing with 2, 4 or 8 standard deviations of its field (any of
/// these alike). Along straight lines from the base fit; of a hypothesis that was refitted beside its own numbers.
/// Fills Hypothesis::ln_unlisted and with_unlisted of those that may count, and the probabilities anew.
/// @param followed  beside nothing: counts where that is more than lines say of its kind
/// @pre  hypotheses are weighed, base.local is filled
Unlisted weigh_unlisted(const BaseFit& base, const Priors& priors, std::vector<Hypothesis>& hypotheses,
                        const std::vector<FollowedCause>& followed = {});

/// The likeliest cause of each kind beside a hypothesis, along straight lines.
struct LikeliestCause {
  Eigen::Index cause = -1;  ///< row of the local causes; -1 where there is none of the kind
  double ln_gain = 0;       ///< over all sizes it may have
  double ln_of_kind = 0;    ///< the mean over the places of the kind
  double size = 0;          ///< in standard deviations of its field
};
std::array<LikeliestCause, local_kinds> likeliest_causes(const LocalCauses& causes, const Hypothesis& h);

/// ln of how much likelier the distances are where one number more may be anything, for each of @p columns: normal
/// about 0 with @p sd. One-sided numbers keep the mass they have without it.
/// @param weighed  of rows @p which of the evidence's directions
Eigen::VectorXd ln_gain_of_one_more(const LinearEvidence& evidence, const std::vector<int>& which,
                                    const Weighed& weighed, const Eigen::MatrixXd& columns, double sd);

}  // namespace supine::diagnosis
