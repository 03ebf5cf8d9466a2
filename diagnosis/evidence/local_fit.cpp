// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/local_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "common/error.h"
#include "common/log_sum.h"
#include "common/statistics.h"
#include "simulation/catalogue.h"
#include "simulation/effects/local_muscle.h"
#include "simulation/effects/local_stiffness.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double strength_sd = 4;      // standard deviations of the field: the middle one of what lines are drawn to
constexpr double out_of_reach = 12;    // of the logarithm: what following may gain
constexpr double worth_following = 1;  // gain along lines, of the logarithm
constexpr double likely_beside = 0.5;  // probability of one beside the likeliest effects: may it do without them?
constexpr double spread_of_length = 0.35;  // of itself
constexpr int most_steps = 10;

/// The effect that a kind is followed as.
struct FollowedAs {
  std::string effect;
  const char* strength;
  double furthest_start;  // of the strength: further than that lines do not hold
  std::vector<const char*> coordinates;
  std::string full_name(const char* parameter) const { return effect + "." + parameter; }
};

FollowedAs followed_as(LocalKind kind) {
  if (kind == LocalKind::muscle)
    return {simulation::LocalMuscle().name(), "offset_mm", 10, {"centre_lateral", "centre_head"}};
  return {simulation::LocalStiffness().name(), "log_ratio", 1, {"centre_lateral", "centre_head", "height"}};
}

/// Mean and standard deviation of the places of a kind.
std::pair<Vector3d, Vector3d> spread_of(const LocalCauses& causes, LocalKind kind) {
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  int places = 0;
  for (Index c = 0; c < causes.anatomy.rows(); ++c) {
    if (causes.kind[static_cast<std::size_t>(c)] != kind) continue;
    const Vector3d at = causes.anatomy.row(c);
    sum += at, squares += at.cwiseAbs2(), ++places;
  }
  const Vector3d mean = sum / places;
  return {mean, (squares / places - mean.cwiseAbs2()).cwiseMax(1e-4).cwiseSqrt()};
}

/// A number free about where it stands, within its own range.
void set_free(simulation::EffectSetting& setting, const char* parameter, double value, double sd) {
  const simulation::Parameter& row = *simulation::find_parameter(setting.name + "." + parameter);
  setting.parameters.at(parameter) = {std::clamp(value, row.lower, row.upper), true, sd, row.lower, row.upper};
}

/// Where the base fit has its numbers; the cause as @p cause has it, by name and in units.
VectorXd start_of(const JointFit& joint, const BaseFit& base, const std::map<std::string, double>& cause) {
  VectorXd u = start_at(joint, base);
  const auto& names = joint.parameters->names();
  for (Index i = 0; i < u.size(); ++i)
    if (const auto value = cause.find(names[static_cast<std::size_t>(i)]); value != cause.end())
      u[i] = joint.parameters->coordinate(i, value->second);
  return joint.parameters->clamped(u);
}

/// Evidence of a fit whose strength may be of several sizes, each alike.
double over_sizes(const BaseFit& base, const JointFit& joint, const FollowedAs& as, const Hypothesis& h) {
  const auto& names = joint.parameters->names();
  const Index strength = std::find(names.begin(), names.end(), as.full_name(as.strength)) - names.begin();
  VectorXd logs(static_cast<Index>(local_cause_sizes.size()));
  for (std::size_t k = 0; k < local_cause_sizes.size(); ++k) {
    Directions all = h.evidence->directions();
    all.sd[strength] *= local_cause_sizes[k] / strength_sd;
    logs[static_cast<Index>(k)] =
        LinearEvidence(*base.covariance, h.evidence->distances(), std::move(all)).weigh(h.rows).ln_evidence;
  }
  return log_sum(logs) - std::log(static_cast<double>(logs.size()));
}

/// The point of the mesh with the nearest anatomy coordinates.
Vector3d place_mm(const calibration::MeasuredScene& scene, const Vector3d& at) {
  const meshing::Anatomy& anatomy = *scene.anatomy;
  Index nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (Index n = 0; n < anatomy.q.rows(); ++n) {
    const Vector3d there(anatomy.q(n, 0), anatomy.q(n, 1), anatomy.thickness_mm[n] / anatomy.foot_radius_mm);
    if (const double distance = (there - at).squaredNorm(); distance < least) least = distance, nearest = n;
  }
  return scene.mesh->points.row(nearest);
}

/// Size and place where the fit ended.
void tell(const calibration::MeasuredScene& scene, const JointFit& joint, const FollowedAs& as, const Hypothesis& h,
          FollowedCause& found) {
  const auto& names = joint.parameters->names();
  const auto number = [&](const char* parameter) {
    const Index i = std::find(names.begin(), names.end(), as.full_name(parameter)) - names.begin();
    const auto [offset, sd] = h.weighed.number(i);
    const double u = joint.fit.u[i] + offset;
    const auto value = [&](double at) {
      return joint.parameters->value(i, std::clamp(at, joint.parameters->lower()[i], joint.parameters->upper()[i]));
    };
    const double reach = normal_reach95() * sd;
    return std::array{value(u), value(u - reach), value(u + reach), std::abs(value(u + sd) - value(u - sd)) / 2};
  };
  const auto size = number(as.strength);
  found.size = size[0], found.low = size[1], found.high = size[2];
  Vector3d at = Vector3d::Zero();  // the muscle's height over itself is 0
  double squares = 0;
  for (std::size_t i = 0; i < as.coordinates.size(); ++i) {
    const auto one = number(as.coordinates[i]);
    at[static_cast<Index>(i)] = one[0];
    squares += one[3] * one[3];
  }
  found.place_mm = place_mm(scene, at);
  found.within_mm = scene.anatomy->foot_radius_mm * std::sqrt(squares);
  for (const simulation::EffectSetting& effect : joint.parameters->model(joint.fit.u).effects)
    if (effect.name == as.effect) found.effect = effect;
  found.effect.parameters.at(as.strength).value = found.size;
}

/// Whether an effect of the catalogue is the same.
bool is_listed(const FollowedCause& found) {
  if (found.kind != LocalKind::muscle) return false;
  const auto& numbers = found.effect.parameters;
  return simulation::LocalMuscle::is_listed({numbers.at("centre_lateral").value, numbers.at("centre_head").value},
                                            numbers.at("length").value);
}

/// Whether a verdict may hang on it: an effect that would be told, or something local.
bool may_decide(const std::vector<Hypothesis>& hypotheses) {
  std::map<int, double> included;
  double unlisted = 0;
  for (const Hypothesis& h : hypotheses) {
    for (const int effect : h.effects) included[effect] += h.probability;
    for (const double share : h.with_unlisted) unlisted += h.probability * share;
  }
  return unlisted >= worth_telling ||
         std::any_of(included.begin(), included.end(), [](const auto& one) { return one.second >= worth_telling; });
}

/// The likeliest of what following from several starts leads to.
template <class Follow>
std::optional<FollowedCause> best_from(const std::vector<LikeliestCause>& starts, Follow follow) {
  std::optional<FollowedCause> best;
  for (const LikeliestCause& start : starts) {
    std::optional<FollowedCause> found = follow(start);
    if (found && (!best || found->ln_gain > best->ln_gain)) best = std::move(found);
  }
  return best;
}

double length_mm(LocalKind kind, const Patchiness& patchiness) {
  switch (kind) {
    case LocalKind::tissue:
      return patchiness.tissue_length_mm;
    case LocalKind::skin:
      return patchiness.skin_length_mm;
    default:
      return patchiness.muscle_length_mm;
  }
}

}  // namespace

bool can_follow(LocalKind kind, const calibration::MeasuredScene& scene, const simulation::Model& given) {
  const FollowedAs as = followed_as(kind);
  return simulation::find_effect(as.effect)->belongs_to(*scene.mesh, *scene.anatomy, given) &&
         std::none_of(given.effects.begin(), given.effects.end(), [&as](const auto& e) { return e.name == as.effect; });
}

simulation::EffectSetting free_local_cause(const calibration::MeasuredScene& scene, const LocalCauses& causes,
                                           LocalKind kind, double length_mm) {
  const FollowedAs as = followed_as(kind);
  simulation::EffectSetting setting = simulation::null_setting(*simulation::find_effect(as.effect));
  if (const auto of = setting.options.find("of"); of != setting.options.end()) of->second = local_kind_name(kind);
  const auto of_kind = std::find(causes.kind.begin(), causes.kind.end(), kind) - causes.kind.begin();
  set_free(setting, as.strength, 0, strength_sd * causes.unit[of_kind]);
  const auto [middle, spread] = spread_of(causes, kind);
  for (std::size_t i = 0; i < as.coordinates.size(); ++i)
    set_free(setting, as.coordinates[i], middle[static_cast<Index>(i)], spread[static_cast<Index>(i)]);
  const double length = length_mm / scene.anatomy->foot_radius_mm;
  set_free(setting, "length", length, spread_of_length * length);
  return setting;
}

std::optional<FollowedCause> follow_local_cause(const calibration::MeasuredScene& scene, const simulation::Model& given,
                                                const BaseFit& base, const Hypothesis& nothing,
                                                const LikeliestCause& from, double length_mm) {
  FollowedCause found;
  found.kind = base.local.kind[static_cast<std::size_t>(from.cause)];
  const FollowedAs as = followed_as(found.kind);
  simulation::Model model = given;
  model.effects.push_back(free_local_cause(scene, base.local, found.kind, length_mm));
  JointFit joint;
  joint.parameters.emplace(model);
  joint.nuisances = base.nuisances;
  joint.fit.mask = base.fit.mask;
  joint.size_mm = base.size_of(nothing.weighed);
  const double size = base.local.unit[from.cause] * from.size;
  std::map<std::string, double> start{
      {as.full_name(as.strength), std::clamp(size, -as.furthest_start, as.furthest_start)}};
  for (std::size_t i = 0; i < as.coordinates.size(); ++i)
    start[as.full_name(as.coordinates[i])] = base.local.anatomy(from.cause, static_cast<Index>(i));
  Hypothesis h;
  try {
    fit_jointly(scene, base, {start_of(joint, base, start), base.nuisances}, &base.fit.prediction.solution, most_steps,
                joint, h);
  } catch (const NumericalFailure&) {
    return {};
  }
  found.ln_gain = over_sizes(base, joint, as, h) - nothing.ln_evidence;
  tell(scene, joint, as, h, found);
  if (is_listed(found)) return {};
  return found;
}

std::vector<FollowedCause> follow_local_causes(const calibration::MeasuredScene& scene, const simulation::Model& given,
                                               const BaseFit& base, const Priors& priors,
                                               const std::vector<Hypothesis>& hypotheses) {
  std::vector<FollowedCause> all;
  if (!(priors.unlisted > 0) || base.local.columns.cols() == 0 || !may_decide(hypotheses)) return all;
  double most = -std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : hypotheses) most = std::max(most, ln_weight(h));
  const Hypothesis& nothing =
      *std::find_if(hypotheses.begin(), hypotheses.end(), [](const Hypothesis& h) { return h.effects.empty(); });
  const Hypothesis& first = hypotheses.front();
  const auto alone = likeliest_causes(base.local, nothing), beside_first = likeliest_causes(base.local, first);
  const double without =
      nothing.ln_prior + nothing.ln_evidence + (nothing.ground != nullptr ? nothing.ground->ln_weight : 0);
  for (std::size_t k = 0; k < local_kinds; ++k) {
    const auto kind = static_cast<LocalKind>(k);
    if (!can_follow(kind, scene, given)) continue;
    const double with = without + std::log(priors.unlisted / static_cast<double>(local_kinds)) + alone[k].ln_of_kind;
    std::vector<LikeliestCause> starts;
    if (alone[k].cause >= 0 && alone[k].ln_gain >= worth_following && with >= most - out_of_reach)
      starts.push_back(alone[k]);
    if (!first.effects.empty() && first.with_unlisted[k] >= likely_beside && beside_first[k].cause >= 0)
      starts.push_back(beside_first[k]);
    if (auto found = best_from(starts, [&](const LikeliestCause& start) {
          return follow_local_cause(scene, given, base, nothing, start, length_mm(kind, priors.patchiness));
        }))
      all.push_back(std::move(*found));
  }
  return all;
}

}  // namespace supine::diagnosis
