// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/diagnose.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "common/error.h"
#include "diagnosis/range_ends.h"
#include "pipeline/case/population_priors.h"
#include "simulation/catalogue.h"
#include "simulation/parameters.h"
#include "simulation/solve/equilibrium.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

const std::pair<std::string, diagnosis::Allowance> allowances[] = {{"discrepancy", diagnosis::Allowance::discrepancy},
                                                                   {"nuisances", diagnosis::Allowance::nuisances},
                                                                   {"patchiness", diagnosis::Allowance::patchiness}};

void warn_of_missing_mesh(Run& run, const diagnosis::NumericalError& error) {
  if (error.finer_failure.empty() && error.coarser_failure.empty()) return;
  const bool both = error.finer_failure == error.coarser_failure;
  const std::string& why = error.finer_failure.empty() ? error.coarser_failure : error.finer_failure;
  run.warn(fmt::format("the error of the mesh could not be measured: {} ({}). It is taken to be {:.1f} mm",
                       both                          ? "no other mesh gives an answer"
                       : error.finer_failure.empty() ? "a coarser surface gives no answer"
                                                     : "better elements give no answer",
                       why, error.spread_mm));
}

/// What no measurement errs by is no finding but a wrong file.
void refuse_wrong_input(const Case& description, const std::vector<diagnosis::MeasurementAtEnd>& ends) {
  if (ends.empty()) return;
  std::vector<std::string> scans, numbers;
  for (const Pose& pose : description.poses)
    if (pose.surface) scans.push_back(fmt::format("{} ([pose.{}])", pose.surface->filename().string(), pose.name));
  for (const auto& end : ends) {
    const simulation::Effect& effect = *simulation::find_effect(end.name.substr(0, end.name.find('.')));
    numbers.push_back(
        fmt::format("{} = {:.3g} {} ({}; bound {:g})", end.name, end.value, end.unit, effect.meaning(), end.bound));
  }
  throw InputError(
      fmt::format("{}: fits best with an error of measurement at the end of its range: {}. Nothing is measured so "
                  "wrong: check surface and "
                  "gravity of [pose.*], [case] side and frame, the scan's axes and unit, and the labels; a scan that "
                  "lies elsewhere is "
                  "laid on the body by supine-register",
                  fmt::join(scans, ", "), fmt::join(numbers, ", ")));
}

fs::path own_file(const CaseInputs& inputs) { return inputs.description.folder / "model.toml"; }

/// The case's own model, where it has the same effects and free numbers.
std::optional<ModelText> own_model(const CaseInputs& inputs) {
  if (!fs::exists(own_file(inputs))) return std::nullopt;
  ModelText text = read_model_text(own_file(inputs));
  const simulation::Model own = read_model(text), &calibrated = inputs.model;
  const auto same_effect = [](const auto& a, const auto& b) { return a.name == b.name && a.options == b.options; };
  if (simulation::free_parameters(own) != simulation::free_parameters(calibrated) ||
      !std::equal(own.effects.begin(), own.effects.end(), calibrated.effects.begin(), calibrated.effects.end(),
                  same_effect))
    return std::nullopt;
  return text;
}

/// Where priors stand: the calibrated model, with each free number as the case's own model has it, if free there.
simulation::Model given_model(Run& run, const CaseInputs& inputs) {
  simulation::Model given = inputs.model;
  if (const fs::path file = own_file(inputs); fs::exists(file)) {
    simulation::Model own = read_model(run.input(file));
    for (const std::string& name : simulation::free_parameters(given))
      if (const simulation::Setting* prior = simulation::find_setting(own, name); prior && prior->free)
        *simulation::find_setting(given, name) = *prior;
  }
  return with_population(run, inputs.description, std::move(given));
}

std::unique_ptr<MeasuredCase> measure_with_either_model(Run& run, CaseInputs inputs) {
  const fs::path calibrated = inputs.model_text.file, own = own_file(inputs);
  try {
    return measure_case(run, inputs);
  } catch (const simulation::NoEquilibrium& failure) {
    const std::optional<ModelText> other = own_model(inputs);
    if (!other || other->text == inputs.model_text.text) throw;
    run.warn(fmt::format("{} has no equilibrium, the fit begins with {} instead ({})", calibrated.string(),
                         own.string(), failure.what()));
    run.input(own);
    inputs.model = read_model(*other);
    inputs.model_text = *other;
    return measure_case(run, std::move(inputs));
  }
}

}  // namespace

void DiagnoseOptions::check() const {
  if (refits < 0 || refits > 100) throw InputError(fmt::format("refits = {}: must be 0 to 100", refits));
  for (const auto& [name, value] :
       {std::pair("registration_mm", known.registration_mm), std::pair("segmentation_mm", known.segmentation_mm),
        std::pair("chest_wall_mm", known.chest_wall_mm)})
    if (value && !(*value >= 0 && std::isfinite(*value)))
      throw InputError(fmt::format("{} = {}: must be 0 or more, mm", name, *value));
  if (!(unlisted >= 0 && unlisted <= 0.9))
    throw InputError(fmt::format("unlisted = {}: must be a probability from 0 to 0.9", unlisted));
  for (const std::string& name : without)
    if (name != "landmarks" && std::none_of(std::begin(allowances), std::end(allowances),
                                            [&name](const auto& one) { return one.first == name; }))
      throw InputError(fmt::format("without = {}: must be discrepancy, nuisances, patchiness or landmarks", name));
  if (prior_of_sets.size() != 0 && prior_of_sets.size() != 4)
    throw InputError(fmt::format("--prior {}: must be four numbers, of nothing, one, two and three effects",
                                 fmt::join(prior_of_sets, ",")));
  constexpr double rounding = 1e-6;
  if (prior_of_sets.empty()) return;
  const double sum = std::accumulate(prior_of_sets.begin(), prior_of_sets.end(), 0.0);
  const bool positive = std::all_of(prior_of_sets.begin(), prior_of_sets.end(), [](double p) { return p > 0; });
  if (!positive || std::abs(sum - 1) > rounding)
    throw InputError(fmt::format(
        "--prior {}: must be four numbers > 0 that add up to 1 (these: {}), of nothing, one, two and three effects",
        fmt::join(prior_of_sets, ","), sum));
}

CaseToDiagnose measure_to_diagnose(Run& run, CaseInputs inputs, const std::vector<std::string>& without) {
  if (std::find(without.begin(), without.end(), "landmarks") != without.end())
    inputs.description.prone_landmarks.reset();
  if (!without.empty())
    run.warn(fmt::format("examined as if there were no {}: what it says is not what is believed of this patient",
                         fmt::join(without, " and no ")));
  CaseToDiagnose subject{measure_with_either_model(run, std::move(inputs)), {}, {}, {}};
  const MeasuredCase& measured = *subject.measured;
  calibration::Evaluator evaluator(measured.whole_scene(), measured.model);
  subject.noise_mm = measured.noise_mm(evaluator);
  subject.given = given_model(run, measured);
  subject.patchiness = read_patchiness(own_model(measured).value_or(measured.model_text));
  return subject;
}

diagnosis::ExamineOptions examine_options(const CaseToDiagnose& subject, const DiagnoseOptions& asked,
                                          LiveProgress& live) {
  diagnosis::ExamineOptions options;
  options.refits = asked.refits;
  options.other_meshes = asked.other_meshes;
  options.seed = asked.seed;
  options.priors = case_priors(subject.measured->description, asked.known);
  options.priors.patchiness = subject.patchiness;
  options.priors.unlisted = asked.unlisted;
  if (!asked.prior_of_sets.empty())
    std::copy(asked.prior_of_sets.begin(), asked.prior_of_sets.end(), options.priors.of_sets.begin());
  for (const auto& [name, what] : allowances)
    if (std::find(asked.without.begin(), asked.without.end(), name) != asked.without.end())
      options.priors = without(what, options.priors);
  options.progress = [&live](const std::string& what) { live.show(what); };
  return options;
}

DiagnosisResult diagnose(Run& run, const CaseToDiagnose& subject, const diagnosis::ExamineOptions& options,
                         LiveProgress& live) {
  run.stage("examine");
  auto found = diagnosis::examine(subject.subject(), options);
  refuse_wrong_input(subject.measured->description, diagnosis::measurements_at_end(*found));
  if (!found->base.numerical)
    run.warn("the mesh is taken to be exact (--no-other-meshes)");
  else
    warn_of_missing_mesh(run, *found->base.numerical);
  run.stage("next measurement");
  live.show("further measurements");
  return complete(*subject.measured, std::move(found));
}

}  // namespace supine::pipeline
