// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/diagnose.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>

#include "calibration/compare.h"
#include "calibration/uncertainty.h"
#include "common/error.h"
#include "diagnosis/diagnosis_file.h"
#include "pipeline/measured_case.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::FreeParameters;
using diagnosis::Score;
using diagnosis::ScoreTable;
using diagnosis::Verdict;
using Json = nlohmann::ordered_json;

const std::string caveat =
    "scores are linear, from the fitted model alone; p values take the errors of model and mesh to be "
    "like those that neighbouring points share here. With white noise (bic_white) every error of the mesh looks like "
    "an "
    "effect";

class DiagnoseTool : public Tool {
 public:
  std::string name() const override { return "supine-diagnose"; }

  std::string summary() const override {
    return "Asks of every effect of the catalogue that a calibrated model lacks: would the error fall if it were "
           "there? "
           "No equilibrium is solved for that, so the whole catalogue takes seconds.\n"
           "Writes diagnosis.json and diagnosis.vtp (scan points with the shape of each effect). -o names their folder "
           "(default: that of the mesh).\n\n"
           "Examples:\n"
           "  supine-diagnose mycase mycase/out/mesh.vtu\n"
           "  supine-diagnose mycase mycase/out/mesh.vtu --model mycase/out/model.toml -o trial\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option("--model", model_file_,
                   "calibrated model (default: model.toml beside the mesh, as supine-calibrate writes it)");
    app.add_option("--refit", refit_,
                   "the first N candidates of either score are added and fitted again (about six chain runs each); 0 = "
                   "none, linear predictions only")
        ->check(CLI::Range(0, 100))
        ->capture_default_str();
    app.add_option("--seed", seed_, "of the draws behind the p values")->capture_default_str();
  }

  Outcome run(Run& run) override {
    run.stage("read");
    measured_ = read_measured_case(run, case_folder_, mesh_file_, model());
    const FreeParameters parameters(measured_->model);
    calibration::Evaluator evaluator(measured_->fitted_scene(), measured_->model);
    calibration::FitOptions options;
    options.noise_mm = measured_->noise_mm(evaluator);
    options.near = &measured_->start;
    run.stage("sensitivities");
    const calibration::Fit fit = calibration::evaluate_fit(evaluator, parameters, options, parameters.start());
    const calibration::Uncertainty worth = calibration::judge(fit, parameters, false);
    doubt_calibration(run, parameters, fit, worth);
    std::vector<std::string> unseen;
    const auto candidates = diagnosis::find_candidates(evaluator, measured_->model, fit, unseen);
    run.stage("scores");
    const auto score = [&](const diagnosis::Whitening& whitening) {
      return diagnosis::score_candidates(fit.residuals, fit.linearisation.slope, candidates, whitening, seed_);
    };
    const double noise = mean_noise(fit);
    const ScoreTable table = score(diagnosis::Whitening::correlated(fit.residuals, worth.errors));
    const ScoreTable white = score(diagnosis::Whitening::independent(fit.residuals));
    run.stage("refits");
    const auto refits = refit(run, evaluator, options, fit, candidates, table, white);
    const auto result = refit_ == 0 ? diagnosis::decide(table, white, unseen, noise)
                                    : diagnosis::decide(table, white, unseen, refits, noise);
    run.stage("write");
    write(run, fit, worth, candidates, result);
    say(run, candidates, result);
    return Outcome::done;
  }

 private:
  fs::path model() const {
    if (!model_file_.empty()) return model_file_;
    const fs::path beside = mesh_file_.parent_path() / "model.toml";
    if (!fs::exists(beside))
      throw InputError(fmt::format(
          "{} is not there: a diagnosis starts from a calibrated model. Run supine-calibrate first, or name a model "
          "with --model",
          beside.string()));
    return beside;
  }

  fs::path folder() const { return output.empty() ? mesh_file_.parent_path() : output; }

  static double mean_noise(const calibration::Fit& fit) {
    return std::sqrt(fit.residuals.sigma_mm.squaredNorm() / static_cast<double>(fit.residuals.size()));
  }

  /// A model far from its optimum: the linear scores allow for it, but only so far.
  static void doubt_calibration(Run& run, const FreeParameters& parameters, const calibration::Fit& fit,
                                const calibration::Uncertainty& worth) {
    constexpr double far = 1;  // standard deviations
    const Eigen::VectorXd step =
        -fit.linearisation.slope.completeOrthogonalDecomposition().solve(fit.residuals.distance_mm);
    for (Eigen::Index i = 0; i < step.size(); ++i) {
      if (parameters.at_bound(fit.u, i)) continue;
      if (std::abs(step[i]) < far * std::sqrt(worth.covariance(i, i))) continue;
      run.warn(
          fmt::format("{} = {:.4g} is not at its optimum (a linear step leads to {:.4g}): run supine-calibrate and "
                      "diagnose the model it writes",
                      parameters.names()[static_cast<std::size_t>(i)], parameters.value(i, fit.u[i]),
                      parameters.value(i, fit.u[i] + step[i])));
    }
  }

  std::vector<diagnosis::Refit> refit(Run& run, calibration::Evaluator& evaluator,
                                      const calibration::FitOptions& base_options, const calibration::Fit& fit,
                                      const std::vector<diagnosis::Candidate>& candidates, const ScoreTable& table,
                                      const ScoreTable& white) const {
    LiveProgress live(run);
    std::vector<diagnosis::Refit> refits;
    for (const std::string& effect : diagnosis::worth_refitting(table, white, static_cast<std::size_t>(refit_))) {
      calibration::FitOptions options = base_options;
      options.max_iterations = 20;
      options.progress = [&live, &effect](const calibration::FitProgress& p) {
        live.show(fmt::format("refit with {}: run {}, RMS {:.3f} mm", effect, p.evaluations, p.rms_mm));
      };
      const auto one =
          diagnosis::refit_candidates(evaluator, measured_->model, options, fit, candidates, table, {effect});
      refits.insert(refits.end(), one.begin(), one.end());
    }
    return refits;
  }

  static const diagnosis::Refit* refit_of(const diagnosis::FirstDiagnosis& result, const std::string& effect) {
    for (const auto& refit : result.refits)
      if (refit.effect == effect && refit.solved) return &refit;
    return nullptr;
  }

  static const diagnosis::Candidate& candidate_of(const std::vector<diagnosis::Candidate>& all, const Score& score) {
    for (const auto& candidate : all)
      if (candidate.effect == score.effect) return candidate;
    throw InputError("no candidate " + score.effect);
  }

  static Json candidate_json(const diagnosis::Candidate& candidate, const Score& score, const Score& white,
                             const diagnosis::Refit* refit) {
    constexpr double quantile = 1.959964;
    Json parameters = Json::array();
    for (Eigen::Index k = 0; k < score.step.size(); ++k) {
      const auto& p = candidate.parameters[static_cast<std::size_t>(k)];
      const double reach = quantile * score.step_sd[k];
      parameters.push_back({{"name", p.name},
                            {"value", score.step[k]},
                            {"unit", p.unit},
                            {"interval95", {score.step[k] - reach, score.step[k] + reach}}});
    }
    return {{"effect", score.effect},
            {"p_value", score.p_value},
            {"predicted_rms_mm", score.predicted_rms_mm},
            {"refit_rms_mm", refit ? Json(refit->rms_mm) : Json(nullptr)},
            {"held_out_rms_mm", refit ? refit->held_out_rms_mm : score.predicted_held_out_rms_mm},
            {"predicted_held_out_rms_mm", score.predicted_held_out_rms_mm},
            {"parameters", parameters},
            {"not_told_apart_from", score.not_told_apart_from},
            {"statistic", score.statistic},
            {"freedom", score.freedom},
            {"bic", score.bic},
            {"bic_white", white.bic},
            {"wrong_sign", score.wrong_sign},
            {"beyond_range", score.beyond_range},
            {"noncentrality", score.noncentrality},
            {"refit_values", refit ? refit_values(*refit) : Json(nullptr)}};
  }

  static Json refit_values(const diagnosis::Refit& refit) {
    Json values = Json::object();
    for (std::size_t i = 0; i < refit.parameters.size(); ++i)
      values[refit.parameters[i]] = refit.values[static_cast<Eigen::Index>(i)];
    return values;
  }

  void write(Run& run, const calibration::Fit& fit, const calibration::Uncertainty& worth,
             const std::vector<diagnosis::Candidate>& candidates, const diagnosis::FirstDiagnosis& result) const {
    const fs::path picture = folder() / "diagnosis.vtp";
    std::vector<std::pair<std::string, Eigen::VectorXd>> shapes;
    for (const Score& score : result.table.scores) {
      const auto& candidate = candidate_of(candidates, score);
      Eigen::VectorXd shape = Eigen::VectorXd::Zero(fit.residuals.size());
      for (Eigen::Index k = 0; k < score.step.size(); ++k)
        shape += (score.step[k] - candidate.parameters[static_cast<std::size_t>(k)].null) * candidate.slope.col(k);
      shapes.emplace_back(score.effect, shape);
    }
    std::vector<std::string> poses;
    for (const auto& m : measured_->fitted) poses.push_back(m.pose.name);
    diagnosis::write_diagnosis(fit.residuals, poses, shapes, run.output(picture));
    Json& f = run.figures(picture);  // diagnosis.json
    f["verdict"] = diagnosis::verdict_name(result.verdict);
    f["missing"] = result.missing;
    f["candidates"] = Json::array();
    for (const Score& score : result.table.scores)
      for (const Score& white : result.white.scores)
        if (white.effect == score.effect)
          f["candidates"].push_back(
              candidate_json(candidate_of(candidates, score), score, white, refit_of(result, score.effect)));
    f["base_rms_mm"] = result.table.base_rms_mm;
    f["base_held_out_rms_mm"] = result.table.base_held_out_rms_mm;
    f["budget_mm"] = budget(fit, worth);
    f["hot_spots"] = hot_spots(fit);
    f["cannot_see"] = Json::array();
    for (const Score& score : result.table.scores)
      if (score.noncentrality < 9) f["cannot_see"].push_back({{"effect", score.effect}, {"power", score.power}});
    for (const std::string& effect : result.unseen) f["cannot_see"].push_back({{"effect", effect}, {"power", 0.05}});
    f["next_measurement"] = Json::array();
    f["effective_points"] = result.table.effective_points;
    f["error_model"] = {{"nugget_mm", worth.errors.nugget_mm},
                        {"shared_mm", worth.errors.spread_mm},
                        {"length_mm", worth.errors.length_mm}};
    f["caveat"] = caveat;
  }

  /// What is known of the parts of the error. Registration and mesh are not measured here.
  static Json budget(const calibration::Fit& fit, const calibration::Uncertainty& worth) {
    const Eigen::MatrixXd& j = fit.linearisation.slope;
    const double parameters = (j * worth.covariance).cwiseProduct(j).sum() / static_cast<double>(j.rows());
    return {{"noise", mean_noise(fit)},
            {"registration", nullptr},
            {"numerical", nullptr},
            {"parameters", std::sqrt(parameters)},
            {"model_form", worth.errors.spread_mm}};
  }

  Json hot_spots(const calibration::Fit& fit) const {
    constexpr double hot_mm = 0.5;
    Json spots = Json::array();
    const auto areas = calibration::anatomical_areas(measured_->mesh, measured_->anatomy);
    for (std::size_t m = 0; m < measured_->fitted.size(); ++m) {
      const calibration::ModelSkin skin(measured_->mesh, fit.prediction.solution.poses[m].x);
      for (const auto& area : calibration::compare(skin, measured_->fitted[m].scan, areas).areas)
        if (std::abs(area.mean_signed_mm) > hot_mm)
          spots.push_back({{"area", area.name},
                           {"pose", measured_->fitted[m].pose.name},
                           {"area_cm2", area.area_cm2},
                           {"mean_signed_mm", area.mean_signed_mm}});
    }
    return spots;
  }

  static void say(const Run& run, const std::vector<diagnosis::Candidate>& candidates,
                  const diagnosis::FirstDiagnosis& result) {
    const ScoreTable& t = result.table;
    run.say(fmt::format("  RMS {:.3f} mm, held out {:.3f} mm; the scan is worth {:.0f} independent points",
                        t.base_rms_mm, t.base_held_out_rms_mm, t.effective_points));
    run.say(fmt::format("  {:<20}{:>9}{:>4}{:>9}{:>9}{:>8}{:>10}{:>10}   {}", "if it had", "T", "q", "BIC", "white",
                        "p", "RMS, mm", "held out", "one-step size"));
    run.say(fmt::format("  {:>59}{:>10}{:>10}", "", "predicted", "predicted"));
    for (const Score& score : t.scores) {
      const auto& candidate = candidate_of(candidates, score);
      double white = 0;
      for (const Score& w : result.white.scores)
        if (w.effect == score.effect) white = w.bic;
      std::string sizes;
      for (Eigen::Index k = 0; k < score.step.size(); ++k) {
        const auto& p = candidate.parameters[static_cast<std::size_t>(k)];
        sizes += fmt::format("{}{:.3g} ± {:.2g}{}", k > 0 ? ", " : "", score.step[k], score.step_sd[k],
                             p.unit == "1" ? "" : " " + p.unit);
      }
      run.say(fmt::format("  {:<20}{:>9.1f}{:>4}{:>9.1f}{:>9.1f}{:>8.3f}{:>10.3f}{:>10.3f}   {}{}{}", score.effect,
                          score.statistic, score.freedom, score.bic, white, score.p_value, score.predicted_rms_mm,
                          score.predicted_held_out_rms_mm, sizes, score.wrong_sign ? " (wrong sign)" : "",
                          score.beyond_range ? " (implausible size)" : ""));
    }
    if (!result.refits.empty())
      run.say(fmt::format("  {:<20}{:>10}{:>10}   {}", "added, fitted again", "RMS, mm", "held out", "values"));
    for (const auto& refit : result.refits) {
      if (!refit.solved) {
        run.say(fmt::format("  {:<20}  no equilibrium", refit.effect));
        continue;
      }
      std::string values;
      for (std::size_t i = 0; i < refit.parameters.size(); ++i)
        values += fmt::format("{}{} {:.3g}", i > 0 ? ", " : "", refit.parameters[i],
                              refit.values[static_cast<Eigen::Index>(i)]);
      run.say(
          fmt::format("  {:<20}{:>10.3f}{:>10.3f}   {}", refit.effect, refit.rms_mm, refit.held_out_rms_mm, values));
    }
    if (!result.unseen.empty())
      run.say(fmt::format("  cannot be felt by these points: {}", fmt::join(result.unseen, ", ")));
    run.say("  Caution: " + caveat + ".");
    say_verdict(run, result);
  }

  static void say_verdict(const Run& run, const diagnosis::FirstDiagnosis& result) {
    const std::string names = fmt::format("{}", fmt::join(result.missing, ", "));
    switch (result.verdict) {
      case Verdict::nothing_missing:
        return run.say("Nothing in the catalogue is seen to be missing.");
      case Verdict::missing:
        return run.say(fmt::format("Missing: {}. Add it and calibrate again: supine-model add {} model.toml", names,
                                   result.missing[0]));
      case Verdict::ambiguous:
        return run.say(fmt::format("Missing, one of (not told apart): {}", names));
      case Verdict::unexplained:
        return run.say(fmt::format("Something is missing that the catalogue does not explain (best: {})", names));
    }
  }

  fs::path case_folder_, mesh_file_, model_file_;
  int refit_ = 4;
  unsigned seed_ = 1;
  std::unique_ptr<MeasuredCase> measured_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::DiagnoseTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
