// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/calibrate.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/cmaes.h"
#include "calibration/held_out.h"
#include "common/error.h"
#include "common/suggestion.h"
#include "diagnosis/evidence/base_fit.h"
#include "diagnosis/evidence/never_known.h"
#include "diagnosis/evidence/nuisance_words.h"
#include "diagnosis/weighted_fit.h"
#include "pipeline/case/case_priors.h"
#include "pipeline/case/model_edit.h"
#include "pipeline/case/population_priors.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"

namespace supine::pipeline {
namespace {

using calibration::Evaluator;
using calibration::Fit;
using calibration::FreeParameters;

/// The fit as the statistics of surfaces take it: without landmarks.
Fit skin_of(Fit fit) {
  fit.linearisation.slope.conservativeResize(fit.residuals.skin_rows(), Eigen::NoChange);
  fit.residuals = fit.residuals.skin();
  return fit;
}

/// The scan's place as six more unknowns, with the catalogue's priors.
/// @throws InputError  the model says where the scan lies
void add_scan_offset(simulation::Model& model) {
  for (const auto& effect : model.effects)
    if (simulation::traits_of(effect.name).moves_scan)
      throw InputError(
          fmt::format("--scan-offset: the model has the effect {} already; free its numbers there and leave "
                      "the option out, or remove the effect",
                      effect.name));
  const simulation::Effect& effect = simulation::place_of_scan();
  simulation::EffectSetting setting = simulation::null_setting(effect);
  for (const simulation::Parameter& row : effect.parameters())
    setting.parameters[row.name] = {row.null, true, row.spread, row.lower, row.upper};
  model.effects.push_back(setting);
}

diagnosis::Priors priors_of(const MeasuredCase& measured) {
  diagnosis::Priors priors = case_priors(measured.description, {});
  priors.patchiness = read_patchiness(measured.model_text);
  return priors;
}

class Calibration {
 public:
  Calibration(Run& run, const MeasuredCase& measured, const FreeParameters& parameters, const CalibrateOptions& asked,
              calibration::RunJournal& journal)
      : run_(run), measured_(measured), parameters_(parameters), asked_(asked), journal_(journal), live_(run) {}

  CalibrationResult run() {
    Evaluator evaluator(measured_.fitted_scene(), parameters_.base());
    const calibration::FitOptions options = fit_options(evaluator);
    CalibrationResult result;
    result.method = asked_.method;
    result.object = measured_.description.is_object();
    result.noise_mm = options.noise_mm;
    run_.stage("fit");
    run_.say("  method " + asked_.method);
    Eigen::MatrixXd posterior;
    if (asked_.method == "joint")
      posterior = fit_jointly(options, result);
    else
      result.fit = asked_.method == "cmaes" ? search_cmaes(evaluator, options)
                                            : calibration::fit_least_squares(evaluator, parameters_, options);
    run_.stage("worth");
    find_worth(evaluator, options, result);
    result.used_priors = options.use_priors;
    result.likelihoods =
        calibration::likelihoods(skin_of(result.fit), parameters_, result.uncertainty, options.use_priors);
    if (asked_.method == "joint") take_posterior(posterior, result);
    result.interval_kind = asked_.method == "joint" ? "posterior" : asked_.intervals;
    if (asked_.method == "cmaes") result.interval_kind = "linear";  // another optimum than that of the profiled cost
    result.intervals = calibration::linear_intervals(result.fit, parameters_, result.uncertainty);
    if (result.interval_kind == "profile") find_profiles(evaluator, options, result);
    hold_out(options, result);
    return result;
  }

 private:
  /// The joint fit's own posterior allows for what is never known already.
  void find_worth(Evaluator& evaluator, const calibration::FitOptions& options, CalibrationResult& result) const {
    const Fit skin = skin_of(result.fit);
    Eigen::MatrixXd shapes;
    if (asked_.method != "joint") {
      diagnosis::NeverKnown all =
          diagnosis::never_known_at(evaluator, parameters_.model(skin.u), skin, priors_of(measured_));
      result.never_known = std::move(all.sources);
      shapes = std::move(all.shapes_mm);
    }
    result.uncertainty = calibration::judge(skin, parameters_, options.use_priors, shapes);
  }

  void find_profiles(Evaluator& evaluator, const calibration::FitOptions& options, CalibrationResult& result) const {
    const auto wanted = [this](const std::string& name) {
      return asked_.profile_of.empty() || std::count(asked_.profile_of.begin(), asked_.profile_of.end(), name) > 0;
    };
    for (Eigen::Index i = 0; i < parameters_.size(); ++i) {
      const std::string& name = parameters_.names()[static_cast<std::size_t>(i)];
      const auto known = asked_.known_profiles.find(name);
      if (known == asked_.known_profiles.end() && !wanted(name)) continue;
      const calibration::Profile profile =
          known != asked_.known_profiles.end()
              ? known->second
              : calibration::profile_interval(evaluator, parameters_, options, result.fit, result.uncertainty, i);
      result.profiles[name] = profile;
      result.intervals[static_cast<std::size_t>(i)] = profile.interval;
    }
  }

  calibration::FitOptions fit_options(Evaluator& evaluator) {
    calibration::FitOptions options;
    options.robust_mm = asked_.robust_mm;
    options.use_priors = asked_.use_priors;
    options.starts = asked_.starts;
    options.seed = asked_.seed;
    options.noise_mm = measured_.noise_mm(evaluator);
    options.near = &measured_.start;
    options.own = asked_.own;
    options.progress = [this](const calibration::FitProgress& p) {
      live_.show(fmt::format("run {}: RMS {:.3f} mm, best {:.3f} mm, {} without equilibrium{}", p.evaluations, p.rms_mm,
                             p.best_rms_mm, p.failed, p.outside_tissue ? "; at moduli that no tissue has" : ""));
    };
    for (std::size_t m = 0; m < options.noise_mm.size(); ++m)
      if (!measured_.fitted[m].noise_mm)
        run_.say(fmt::format("  noise of {} not given, estimated: {:.2f} mm", measured_.fitted[m].pose.name,
                             options.noise_mm[m]));
    return options;
  }

  /// Moduli together with all that is never known. @return  covariance of the coordinates, over all else
  Eigen::MatrixXd fit_jointly(const calibration::FitOptions& options, CalibrationResult& result) {
    diagnosis::BaseFitOptions joint;
    joint.priors = priors_of(measured_);
    joint.keeps_history = true;
    joint.progress = [this](const std::string& what) { live_.show(what); };
    Evaluator evaluator(measured_.marked_scene(), parameters_.base(), diagnosis::accurate_enough());
    diagnosis::BaseFit base =
        diagnosis::fit_base_model(evaluator, parameters_.base(), measured_.begin_with(parameters_.base()),
                                  options.noise_mm, &measured_.start, joint);
    const diagnosis::JointPosterior posterior = diagnosis::posterior_of(base);
    for (Eigen::Index k = parameters_.size(); k < posterior.value.size(); ++k)
      result.nuisances.push_back({posterior.names[static_cast<std::size_t>(k)], posterior.value[k], posterior.sd[k]});
    warn_of_makeshift(base);
    result.as_given = as_given(evaluator, base);
    result.fit = std::move(base.fit);
    result.fit.history = std::move(base.history);
    result.fit.failed = static_cast<int>(std::count_if(result.fit.history.begin(), result.fit.history.end(),
                                                       [](const auto& row) { return row.failed; }));
    result.fit.evaluations = base.evaluations + result.fit.failed;
    result.fit.iterations = base.steps;
    result.fit.converged = true;
    result.fit.message = "joint fit with all that is never known";
    return posterior.of_parameters;
  }

  /// A fit that moves what is never known very far, or leaves as much as is ever believed, makes up for something else.
  void warn_of_makeshift(const diagnosis::BaseFit& base) const {
    std::string what = diagnosis::too_far_words(base.nuisances);
    if (what.empty() && base.size_mm >= base.covariance->sizes_mm().maxCoeff())
      what =
          fmt::format("nothing in the model explains some {:.0f} mm of where the skin lies, the most that is believed",
                      base.size_mm);
    if (what.empty()) return;
    run_.warn(what +
              ": the fit makes up for something else, and the moduli with it. Look at the scan beside the model "
              "(supine-compare, supine-register), fit without it (--method least-squares), or ask what is missing "
              "(supine-diagnose)");
  }

  /// The fitted model's errors where scans lie as they were given and nothing else is moved: what supine-compare says.
  std::optional<calibration::DistanceFigures> as_given(Evaluator& evaluator, const diagnosis::BaseFit& base) const {
    const simulation::Model model = base.parameters->model(base.fit.u);
    try {
      const calibration::Prediction prediction = evaluator.predict(model, &base.fit.prediction.solution);
      return calibration::figures_of(prediction.scan_distances());
    } catch (const NumericalFailure& why) {
      run_.warn(fmt::format("with gravity, breath and the rest as given the fitted model has no equilibrium ({})",
                            why.what()));
      return {};
    }
  }

  void take_posterior(const Eigen::MatrixXd& covariance, CalibrationResult& result) const {
    result.uncertainty.covariance = covariance;
    for (Eigen::Index i = 0; i < parameters_.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto& prior = parameters_.priors()[k];
      result.likelihoods[k] = likelihood_of({result.fit.u[i], std::sqrt(covariance(i, i))},
                                            prior ? std::optional<Likelihood>({prior->mean, prior->sd}) : std::nullopt);
    }
  }

  Fit search_cmaes(Evaluator& evaluator, const calibration::FitOptions& fit_options) {
    calibration::CmaesOptions options;
    options.seed = asked_.seed;
    options.population = asked_.population;
    options.max_evaluations = asked_.max_evaluations;
    options.until_mae_mm = asked_.until_mae_mm;
    options.progress = [this](int evaluations, int failed, double best) {
      live_.show(fmt::format("after {} runs: best MAE {:.3f} mm, {} without equilibrium", evaluations, best, failed));
    };
    if (journal_.known() > 0) run_.say(fmt::format("  going on after {} chain runs", journal_.known()));
    calibration::EvaluatorPool pool(measured_.fitted_scene(), parameters_, measured_.start, run_.threads());
    const calibration::CmaesResult found = calibration::minimise_cmaes(pool, parameters_, options, journal_);
    Eigen::VectorXd u(parameters_.size());
    for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = parameters_.coordinate(i, found.values[i]);
    Fit fit = calibration::evaluate_fit(evaluator, parameters_, fit_options, u);
    fit.history = found.history;
    fit.evaluations = found.evaluations, fit.failed = found.failed, fit.iterations = found.generations;
    fit.message = found.message;
    fit.converged = found.evaluations < asked_.max_evaluations || found.target_met;
    return fit;
  }

  void hold_out(const calibration::FitOptions& options, CalibrationResult& result) const {
    const Fit fit = skin_of(result.fit);
    const auto& residuals = fit.residuals;
    const auto as_list = [](const Eigen::VectorXd& d) { return std::vector<double>(d.begin(), d.end()); };
    result.in_sample = calibration::figures_of(as_list(residuals.distance_mm));
    Eigen::VectorXd priors = parameters_.prior_information();
    if (!options.use_priors) priors.setZero();
    result.held_out_blocks = calibration::figures_of(as_list(calibration::held_out_distances(
        residuals, fit.linearisation.slope, priors, calibration::spatial_blocks(residuals))));
    for (std::size_t m = 0; m < measured_.held_out.size(); ++m) hold_out_pose(m, result);
  }

  /// The pose predicted by the fit; without figures, and told, where these moduli carry no body in it.
  void hold_out_pose(std::size_t m, CalibrationResult& result) const {
    const calibration::Measurement& held_out = measured_.held_out[m];
    calibration::MeasuredScene scene = measured_.fitted_scene();
    scene.measurements = {&held_out};
    const simulation::Model model = parameters_.model(result.fit.u);
    Evaluator other(scene, model);
    simulation::ChainSolution near = result.fit.prediction.solution;
    near.poses = {measured_.start.poses[measured_.fitted.size() + m]};
    try {
      const calibration::Prediction prediction = other.predict(model, &near);
      result.held_out_poses.push_back(
          {held_out.pose.name, prediction.mae_study_mm(), calibration::figures_of(prediction.scan_distances())});
    } catch (const NumericalFailure& why) {
      run_.warn(
          fmt::format("no figures of the held-out pose {}: the fitted model has no equilibrium there ({}). Fit it "
                      "as well ([calibration] poses){}",
                      held_out.pose.name, why.what(),
                      asked_.method == "joint" ? "" : ", or the places of the scans with the moduli (--method joint)"));
    }
  }

  Run& run_;
  const MeasuredCase& measured_;
  const FreeParameters& parameters_;
  const CalibrateOptions& asked_;
  calibration::RunJournal& journal_;
  LiveProgress live_;
};

void check_range(const char* name, double value, double lower, double upper) {
  if (!(value >= lower && value <= upper))
    throw InputError(fmt::format("{} = {}: must be {} to {}", name, value, lower, upper));
}

void check_choice(const char* name, const std::string& value, const std::vector<std::string>& values) {
  if (std::find(values.begin(), values.end(), value) == values.end())
    throw InputError(fmt::format("{} = {}: must be {}", name, value, listed(values)));
}

}  // namespace

/// An option that was given, and the methods that use it.
struct CalibrateOptions::Use {
  bool given;
  const char* option;
  std::vector<std::string> methods;
  bool by(const std::string& name) const { return std::find(methods.begin(), methods.end(), name) != methods.end(); }
};

std::vector<CalibrateOptions::Use> CalibrateOptions::uses() const {
  const CalibrateOptions usual;
  return {
      {!use_priors, "--no-priors", {"least-squares", "cmaes"}},
      {scan_offset, "--scan-offset", {"least-squares", "cmaes"}},
      {map, "--map", {"least-squares", "cmaes"}},
      {intervals == "profile", "--intervals profile", {"least-squares"}},
      {starts != usual.starts, "--starts", {"least-squares"}},
      {robust_mm != usual.robust_mm, "--robust", {"least-squares"}},
      {!own.empty(), "own residuals", {"least-squares"}},
      {population != usual.population, "--population", {"cmaes"}},
      {max_evaluations != usual.max_evaluations, "--max-evaluations", {"cmaes"}},
  };
}

void CalibrateOptions::choose_method() {
  if (!method.empty()) return;
  const auto all = uses();
  const bool least_squares = std::any_of(
      all.begin(), all.end(), [](const Use& use) { return use.given && !use.by("joint") && use.by("least-squares"); });
  method = least_squares || until_mae_mm ? "least-squares" : "joint";
}

void CalibrateOptions::check() const {
  constexpr double any = std::numeric_limits<double>::max(), above_zero = std::numeric_limits<double>::min();
  check_choice("method", method, {"least-squares", "joint", "cmaes"});
  check_choice("intervals", intervals, {"linear", "profile"});
  check_range("starts", starts, 1, 1000);
  check_range("robust_mm", robust_mm, above_zero, any);
  if (population != 0) check_range("population (0 is the usual one)", population, calibration::least_population, 10000);
  check_range("max_evaluations", max_evaluations, 1, any);
  if (until_mae_mm && !(*until_mae_mm > 0 && *until_mae_mm <= any))
    throw InputError(fmt::format("until_mae_mm = {}: must be above 0", *until_mae_mm));
  if (!profile_of.empty() && (intervals != "profile" || method != "least-squares"))
    throw InputError("--profile-of goes with --intervals profile and the method least-squares");
  if (!own.empty() && intervals == "profile")
    throw InputError("own residuals go with linear intervals: profiles are of the distances alone");
  for (const Use& use : uses())
    if (use.given && !use.by(method))
      throw InputError(fmt::format("{} has no effect on --method {}{}; leave it out, or take --method {}", use.option,
                                   method,
                                   method == "joint" ? ", which has priors, the scans' places and the intervals of its "
                                                       "posterior in it"
                                                     : "",
                                   listed(use.methods)));
}

FreeParameters parameters_to_fit(Run& run, const MeasuredCase& measured, const CalibrateOptions& options) {
  if (options.method == "cmaes") measured.check_covers_skin("--method cmaes");
  if (options.until_mae_mm) measured.check_covers_skin("--until-mae");
  simulation::Model model = with_population(run, measured.description, measured.model);
  if (options.scan_offset) add_scan_offset(model);
  FreeParameters parameters(model);
  parameters.begin_with(measured.begin_with(model));
  for (const std::string& name : options.profile_of)
    if (std::count(parameters.names().begin(), parameters.names().end(), name) == 0)
      throw InputError(fmt::format("--profile-of {}: the model has no such free number; it has {}", name,
                                   listed(parameters.names())));
  return parameters;
}

CalibrationResult calibrate(Run& run, const MeasuredCase& measured, const FreeParameters& parameters,
                            const CalibrateOptions& options, calibration::RunJournal& journal) {
  return Calibration(run, measured, parameters, options, journal).run();
}

ModelText fitted_model(const MeasuredCase& measured, const FreeParameters& parameters,
                       const CalibrationResult& result) {
  ModelText fitted = measured.model_text;
  if (parameters.base().effects.size() > measured.model.effects.size())
    fitted.text = with_effect(fitted, simulation::place_of_scan().name());
  std::map<std::string, double> values;
  for (Eigen::Index i = 0; i < parameters.size(); ++i)
    values[parameters.names()[static_cast<std::size_t>(i)]] = parameters.value(i, result.fit.u[i]);
  fitted.text = with_values(fitted, values);
  read_model(fitted);
  return fitted;
}

Outcome judge(Run& run, const CalibrateOptions& options, const CalibrationResult& result) {
  const double mae = result.fit.prediction.mae_study_mm();
  if (options.until_mae_mm && !(mae <= *options.until_mae_mm)) {
    run.warn(
        fmt::format("the MAE model to scan is {:.3f} mm, above the {} mm of --until-mae", mae, *options.until_mae_mm));
    return Outcome::target_not_met;
  }
  if (result.fit.converged) return Outcome::done;
  run.warn(fmt::format("the fit stopped before it converged: {}", result.fit.message));
  return Outcome::target_not_met;
}

}  // namespace supine::pipeline
