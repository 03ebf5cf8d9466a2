// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/next_measurement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/model_skin.h"
#include "calibration/scan_motion.h"
#include "common/error.h"
#include "common/first_failure.h"
#include "common/rms.h"
#include "diagnosis/further_poses.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::diagnosis {
namespace {

constexpr double seen_power = 0.5;
constexpr double as_good_as = 0.05;  // of the power: what asks for less comes first

/// A measurement that could be made: where "down" points. The fitted pose again needs no solve.
struct Option {
  std::string name;
  Eigen::Vector3d down;
  bool again = false;
  std::string area = {};  ///< of the skin that is measured beside what was; empty: all of the skin
};

/// Of an object: skin that the scan did not see, in the pose it was seen in and in one scan with what it saw, or the
/// body turned round; what asks for less before what asks for more.
std::vector<Option> options_of_object(const Subject& subject) {
  const simulation::PoseLoad& pose = subject.scene.measurements[0]->pose;
  std::vector<Option> options = {{pose.name + ", once more", pose.gravity, true}};
  for (const std::string& area : subject.scene.anatomy->all_area_names())
    options.push_back({pose.name + ", with the skin " + (area == "near the support" ? area : "of the " + area),
                       pose.gravity, false, area});
  options.push_back({pose.name + ", all of the skin", pose.gravity});
  options.push_back({"turned upside down", -pose.gravity});
  const Eigen::Vector3d side = pose.gravity.cross(subject.scene.anatomy->lateral);
  if (side.norm() > 0.1) options.push_back({"turned on its side", side.normalized()});
  return options;
}

/// From the gravity of the fitted pose and the patient's own directions (LPS: +z is the head).
std::vector<Option> options_of(const Subject& subject) {
  if (subject.scene.anatomy->is_object()) return options_of_object(subject);
  const Eigen::Vector3d& down = subject.scene.measurements[0]->pose.gravity;
  const bool several = subject.scene.measurements.size() > 1;
  const std::string again = several ? "all that was fitted" : subject.scene.measurements[0]->pose.name;
  std::vector<Option> options = {{again + ", once more", down, true}};
  for (const FurtherPose& pose : further_poses(down, subject.scene.anatomy->lateral))
    options.push_back({pose.name, pose.down});
  return options;
}

/// Whitened slopes of what is free in the base model and of some effects, at one measurement, and what the effects'
/// stand-ins leave there; empty where an effect has none.
struct Slopes {
  Eigen::MatrixXd base;
  std::vector<Eigen::MatrixXd> effect;
  std::vector<Eigen::VectorXd> left;
};

Slopes present(const Findings& found, const std::vector<const Candidate*>& effects) {
  const Whitening& white = found.errors->whitening();
  Slopes slopes{white.apply(found.base.fit.linearisation.slope), {}, {}};
  for (const Candidate* effect : effects) {
    slopes.effect.push_back(white.apply(effect->slope));
    slopes.left.push_back(effect->stand_in ? Eigen::VectorXd(white.apply(effect->stand_in->left_mm))
                                           : Eigen::VectorXd());
  }
  return slopes;
}

/// Nodes of a skin that the scan of the first pose saw: the nearest of each of its points.
std::vector<bool> seen_nodes(const Points& nodes, const calibration::Residuals& residuals) {
  std::vector<bool> seen(static_cast<std::size_t>(nodes.rows()));
  for (Eigen::Index r = 0; r < residuals.skin_rows(); ++r) {
    if (residuals.pose[r] != 0) continue;
    Eigen::Index nearest;
    (nodes.rowwise() - residuals.on_skin.row(r)).rowwise().squaredNorm().minCoeff(&nearest);
    seen[static_cast<std::size_t>(nearest)] = true;
  }
  return seen;
}

/// The skin of a pose as its scan would see it.
class Pose {
 public:
  Pose(const Subject& subject, const Findings& found, const Option& option)
      : found_(found),
        load_{option.name, option.down},
        chain_(*subject.scene.mesh, *subject.scene.anatomy, found.base.model, {subject.scene.prone, load_}) {
    simulation::ChainSolution near = found.base.fit.prediction.solution;
    near.poses.resize(1);
    near.poses[0].name = option.name;
    solution_ = chain_.solve(found.base.model, &near);
    sensitivities_ = std::make_unique<simulation::Sensitivities>(chain_, found.base.model, solution_);
    find_nodes(subject, option.area);
    factorise();
  }

  Eigen::MatrixXd white(const Eigen::MatrixXd& columns) const { return factor_.matrixL().solve(columns); }

  Eigen::Index points() const { return place_.rows(); }

  Eigen::VectorXd slope(const std::string& parameter) {
    const simulation::ChainDerivative derivative = sensitivities_->of(parameter);
    const auto fields = chain_.fields(found_.base.model, load_, parameter);
    Points moved = Points::Zero(place_.rows(), 3);
    if (!simulation::derivatives_of(fields).scan_motion.isZero(0))
      moved = calibration::corrected_derivative(fields.scan_motion, place_, place_);
    moved -= derivative.poses[0](nodes_, Eigen::all);
    return moved.cwiseProduct(normal_).rowwise().sum();
  }

  /// What the stand-in of an effect does otherwise than the base model.
  Eigen::VectorXd left_by(const Subject& subject, const StandIn& stand_in) const {
    simulation::Chain chain(*subject.scene.mesh, *subject.scene.anatomy, stand_in.model, {subject.scene.prone, load_});
    simulation::ChainSolution near = stand_in.solution;
    near.poses.resize(1);
    near.poses[0].name = load_.name;
    const simulation::ChainSolution solution = chain.solve(stand_in.model, &near);
    const Points apart = solution.poses[0].x - solution_.poses[0].x;
    return -apart(nodes_, Eigen::all).cwiseProduct(normal_).rowwise().sum();
  }

 private:
  /// All of the skin, or what was seen and an area.
  void find_nodes(const Subject& subject, const std::string& area) {
    const calibration::ModelSkin skin(*subject.scene.mesh, solution_.poses[0].x);
    std::vector<bool> chosen(skin.nodes().size(), area.empty());
    if (!area.empty()) chosen = seen_nodes(skin.node_points(), found_.base.fit.residuals);
    std::vector<int> rows;
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (chosen[i] || subject.scene.anatomy->area_name_of(skin.nodes()[i]) == area) {
        nodes_.push_back(skin.nodes()[i]);
        rows.push_back(static_cast<int>(i));
      }
    place_ = skin.node_points()(rows, Eigen::all);
    normal_ = skin.node_normals()(rows, Eigen::all);
  }

  /// Noise of as many points per node as the fitted scan has, what the mesh does, and the scan's own place.
  void factorise() {
    const Eigen::Index n = place_.rows();
    const auto scans = found_.base.fit.prediction.poses.size();
    const double points = static_cast<double>(found_.base.fit.residuals.skin_rows()) / static_cast<double>(scans * n);
    const double nugget = mean_square(found_.base.noise_of_point_mm.cwiseProduct(found_.base.repeats.cwiseSqrt())
                                          .head(found_.base.fit.residuals.skin_rows())) /
                          std::max(1.0, points);
    const auto& mesh = found_.base.numerical;
    const double shared = mesh ? mesh->spread_mm * mesh->spread_mm : 0, length_mm = mesh ? mesh->length_mm : 1;
    Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(n, n);
    const simulation::Effect& place = simulation::place_of_scan();
    for (const auto& row : place.parameters()) {
      const Eigen::VectorXd mode =
          place.tolerance(row.unit, found_.priors.known) * slope(simulation::parameter_name(place, row));
      sigma.noalias() += mode * mode.transpose();
    }
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j <= i; ++j)
        sigma(i, j) += shared * std::exp(-(place_.row(i) - place_.row(j)).norm() / length_mm) + (i == j ? nugget : 0);
    factor_.compute(sigma);
  }

  const Findings& found_;
  simulation::PoseLoad load_;
  simulation::Chain chain_;
  simulation::ChainSolution solution_;
  std::unique_ptr<simulation::Sensitivities> sensitivities_;
  std::vector<int> nodes_;
  Points place_, normal_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

Slopes further(const Subject& subject, const Findings& found, const Option& option,
               const std::vector<const Candidate*>& effects, const Slopes& now) {
  if (option.again) return now;
  Pose pose(subject, found, option);
  const calibration::FreeParameters& parameters = *found.base.parameters;
  const Eigen::VectorXd unit = parameters.slope(found.base.fit.u);
  const auto rows = pose.points();
  Slopes slopes{Eigen::MatrixXd(rows, parameters.size()), {}, {}};
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    slopes.base.col(i) = unit[i] * pose.slope(parameters.names()[static_cast<std::size_t>(i)]);
  slopes.base = pose.white(slopes.base);
  for (const Candidate* effect : effects) {
    Eigen::MatrixXd columns(rows, effect->slope.cols());
    for (std::size_t k = 0; k < effect->parameters.size(); ++k)
      columns.col(static_cast<Eigen::Index>(k)) = pose.slope(effect->parameters[k].name);
    slopes.effect.push_back(pose.white(columns));
    slopes.left.push_back(effect->stand_in ? Eigen::VectorXd(pose.white(pose.left_by(subject, *effect->stand_in)))
                                           : Eigen::VectorXd());
  }
  return slopes;
}

Eigen::MatrixXd stacked(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  Eigen::MatrixXd both(a.rows() + b.rows(), a.cols());
  both << a, b;
  return both;
}

/// The effect at its size, or as something to be fitted. A scan that lies elsewhere lies elsewhere in its own way each
/// time: its parameters are others in the further pose.
Eigen::MatrixXd fitted_columns(const Candidate& effect, const Eigen::MatrixXd& now, const Eigen::MatrixXd& then) {
  if (!simulation::traits_of(effect.effect).moves_scan) return stacked(now, then);
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(now.rows() + then.rows(), 2 * now.cols());
  both.topLeftCorner(now.rows(), now.cols()) = now;
  both.bottomRightCorner(then.rows(), then.cols()) = then;
  return both;
}

double left_over(const Eigen::VectorXd& signal, const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd left = signal - columns * columns.completeOrthogonalDecomposition().solve(signal);
  return left.squaredNorm();
}

/// Fitted value less null where there was a refit, the usual size else.
Eigen::VectorXd size_of(const Findings& found, const Candidate& effect) {
  Eigen::VectorXd size(static_cast<Eigen::Index>(effect.parameters.size()));
  for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
    size[static_cast<Eigen::Index>(k)] = effect.parameters[k].typical / std::sqrt(static_cast<double>(size.size()));
    for (const Refit& refit : found.refits)
      for (const FittedParameter& p : refit.parameters)
        if (refit.solved && p.name == effect.parameters[k].name)
          size[static_cast<Eigen::Index>(k)] = p.value - effect.parameters[k].null;
  }
  return size;
}

/// Whether another effect was free to make up for this one.
bool made_up_by(const Candidate& effect, const std::string& other) {
  return effect.stand_in &&
         std::any_of(effect.stand_in->made_up.begin(), effect.stand_in->made_up.end(),
                     [&other](const MadeUp& number) { return number.name.starts_with(other + "."); });
}

void rate_pairs(const Findings& found, const std::vector<const Candidate*>& effects, std::size_t in_set,
                const Slopes& now, const Slopes& then, Separation& result) {
  result.separation = std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd base = stacked(now.base, then.base);
  for (std::size_t i = 0; i < in_set; ++i)
    for (std::size_t j = 0; j < in_set; ++j) {
      if (i == j) continue;
      const bool moves = simulation::traits_of(effects[i]->effect).moves_scan;
      const Eigen::VectorXd size = size_of(found, *effects[i]);
      Eigen::VectorXd signal(base.rows());
      if (made_up_by(*effects[i], effects[j]->effect))
        signal << now.left[i], then.left[i];
      else
        signal << now.effect[i] * size, (moves ? 0.0 : 1.0) * (then.effect[i] * size);
      const Eigen::MatrixXd rival = fitted_columns(*effects[j], now.effect[j], then.effect[j]);
      Eigen::MatrixXd columns(base.rows(), base.cols() + rival.cols());
      columns << base, rival;
      const double separation = left_over(signal, columns);
      if (separation >= result.separation) continue;
      result.separation = separation;
      result.closest_pair = effects[i]->effect + " / " + effects[j]->effect;
    }
  if (in_set < 2) result.separation = 0;
}

/// λ along the slopes, at the usual size.
double noncentrality(const Candidate& effect, const Eigen::MatrixXd& columns) {
  double lambda = 0;
  for (Eigen::Index k = 0; k < columns.cols(); ++k)
    lambda += columns.col(k).squaredNorm() * std::pow(effect.parameters[static_cast<std::size_t>(k)].typical, 2) /
              static_cast<double>(columns.cols());
  return lambda;
}

/// λ now over λ along the slopes now: how much less than its slope promises the effect does at its usual size.
double shrinkage(const Findings& found, const Candidate& effect, const Slopes& now, const Eigen::MatrixXd& columns) {
  const double along =
      noncentrality(effect, columns - now.base * now.base.completeOrthogonalDecomposition().solve(columns));
  for (const Score& score : found.table.scores)
    if (score.effect == effect.effect && along > 0) return score.noncentrality / along;
  return 1;
}

void rate_unseen(const Findings& found, const std::vector<const Candidate*>& effects,
                 const std::vector<std::string>& unseen, const Slopes& now, const Slopes& then, Separation& result) {
  const Eigen::MatrixXd base = stacked(now.base, then.base);
  const auto solver = base.completeOrthogonalDecomposition();
  double best = 0, sum = 0, weights = 0;
  for (std::size_t e = 0; e < effects.size(); ++e) {
    if (std::find(unseen.begin(), unseen.end(), effects[e]->effect) == unseen.end()) continue;
    double lambda;
    if (effects[e]->stand_in) {
      lambda = left_over(stacked(now.left[e], then.left[e]), base);
    } else {
      Eigen::MatrixXd columns = stacked(now.effect[e], then.effect[e]);
      columns -= base * solver.solve(columns);
      lambda = shrinkage(found, *effects[e], now, now.effect[e]) * noncentrality(*effects[e], columns);
    }
    const double power = power_of(found.table, static_cast<int>(effects[e]->slope.cols()), lambda);
    const double weight = found.priors.of_effect(found.effects(), effects[e]->effect);
    sum += weight * power;
    weights += weight;
    if (power > seen_power && weight * power > best) best = weight * power, result.shows = effects[e]->effect;
  }
  if (weights > 0) result.single_power = sum / weights;
}

}  // namespace

std::vector<std::string> not_seen(const Findings& found) {
  std::vector<std::string> effects = unsettled(found.table);
  const auto& named = found.diagnosis.missing;
  std::erase_if(effects, [&](const std::string& effect) {
    const bool left_open = found.diagnosis.verdict == Verdict::ambiguous && found.priors.is_expected(effect);
    return !left_open && std::find(named.begin(), named.end(), effect) != named.end();
  });
  return effects;
}

std::vector<Separation> next_measurements(const Subject& subject, const Findings& found,
                                          const std::vector<std::string>& set) {
  std::vector<const Candidate*> effects;
  const auto add = [&](const std::string& name) {
    for (const Candidate& candidate : found.candidates)
      if (candidate.effect == name) effects.push_back(&candidate);
  };
  for (const std::string& name : set) add(name);
  const std::size_t in_set = effects.size();
  const std::vector<std::string> unseen = not_seen(found);
  for (const std::string& name : unseen)
    if (std::find(set.begin(), set.end(), name) == set.end()) add(name);
  std::vector<Separation> list;
  if (effects.empty()) return list;
  const Slopes now = present(found, effects);
  const std::vector<Option> options = options_of(subject);
  std::vector<Separation> rated(options.size());
  const auto rate = [&](std::size_t o) {
    try {
      const Slopes then = further(subject, found, options[o], effects, now);
      rated[o].measurement = options[o].name;
      rate_pairs(found, effects, in_set, now, then, rated[o]);
      rate_unseen(found, effects, unseen, now, then, rated[o]);
    } catch (const NumericalFailure&) {
      rated[o].measurement.clear();  // no equilibrium in that pose: nothing can be promised
    }
  };
  FirstFailure failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t o = 0; o < options.size(); ++o) failure.guard([&] { rate(o); });
  failure.rethrow();
  for (Separation& s : rated)
    if (!s.measurement.empty()) list.push_back(std::move(s));
  std::stable_sort(list.begin(), list.end(), [](const Separation& a, const Separation& b) {
    return a.separation != b.separation ? a.separation > b.separation : a.single_power > b.single_power;
  });
  if (list.empty() || list.front().separation > 0) return list;
  const auto asks_for = [&](const Separation& s) {
    return std::find_if(options.begin(), options.end(), [&s](const Option& o) { return o.name == s.measurement; });
  };
  const auto as_good = std::find_if(list.begin(), list.end(), [&](const Separation& s) {
    return s.single_power < list.front().single_power - as_good_as;
  });
  const auto least = std::min_element(
      list.begin(), as_good, [&](const Separation& a, const Separation& b) { return asks_for(a) < asks_for(b); });
  std::rotate(list.begin(), least, least + 1);
  return list;
}

}  // namespace supine::diagnosis
