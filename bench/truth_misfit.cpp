// SPDX-License-Identifier: AGPL-3.0-or-later
// Whether errors are as large as the diagnosis takes them to be: a null from the priors at its true numbers, whitened
// with what the diagnosis believes of scan, mesh, uneven tissue and a discrepancy of the size that was drawn. Then the
// misfit is 1 per point, and its share along every number and every effect is a normal draw.
//   bench_truth_misfit CASE MESH.vtu MODEL.toml ANSWER.json [TRUTH.vtu]
// CASE from supine-phantom --prior --tilt. TRUTH.vtu: the mesh the case was computed on (bench_phantom_mesh); with it
// also what the mesh itself errs by. Where it is MESH.vtu, that is taken to be exact.
#include <fmt/core.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/rms.h"
#include "diagnosis/candidates.h"
#include "diagnosis/stand_in.h"
#include "meshing/mesh_io.h"
#include "pipeline/tool/tool.h"
#include "pipeline/work/diagnose.h"

namespace supine {
namespace {

using diagnosis::Nuisance;
using Eigen::Index;
using Eigen::VectorXd;
using Json = nlohmann::json;

/// What the phantom calls a number.
std::string name_in_answer(const Nuisance& nuisance) {
  static const std::map<std::string, std::string> names = {
      {"adhesion.log_factor", "log_tangential"},        {"incompressibility.log_factor", "log_incompressibility"},
      {"gland_stiffness.log_ratio", "log_gland_ratio"}, {"segmentation_offset.offset_mm", "imaged_skin_mm"},
      {"interface.normal_kpa_per_mm", "log_normal"},    {"cut.stiffness_kpa_per_mm", "log_cut"},
      {"chest_wall_motion.amplitude_mm", "breath_mm"},  {"gravity_tilt.roll_rad", "gravity_roll_rad"},
      {"gravity_tilt.pitch_rad", "gravity_pitch_rad"}};
  const std::string setting = nuisance.setting();
  const auto found = names.find(setting);
  return found != names.end() ? found->second : setting.substr(setting.find('.') + 1);
}

/// The true numbers, in sigma; the truth's own mesh has no imaged skin that could lie elsewhere.
std::vector<Nuisance> true_nuisances(std::vector<Nuisance> list, const Json& answer, bool own) {
  const Json& drawn = answer.at("nuisances");
  for (Nuisance& nuisance : list) {
    const std::string name = name_in_answer(nuisance);
    const Json& of = nuisance.pose.empty() ? drawn : drawn.at("poses").at(nuisance.pose);
    nuisance.value = own && name == "imaged_skin_mm" ? 0 : of.at(name).get<double>() / nuisance.sigma;
  }
  return list;
}

VectorXd true_coordinates(const calibration::FreeParameters& parameters, const Json& answer) {
  VectorXd u = parameters.start();
  for (Index i = 0; i < u.size(); ++i)
    u[i] = parameters.coordinate(i, answer.at("base").at(parameters.names()[static_cast<std::size_t>(i)]));
  return u;
}

/// Residuals of the clusters that are independent and of unit size, if errors are what they are taken to be.
VectorXd whitened(const diagnosis::BaseFit& base, const VectorXd& of_clusters, double size_mm) {
  const Eigen::ArrayXd variance = 1 + size_mm * size_mm * base.covariance->lambda().array();
  return base.covariance->turned(of_clusters).col(0).array() / variance.sqrt();
}

/// What the mesh does to the distances at the true numbers, less what is taken away for it.
VectorXd mesh_error(const diagnosis::Subject& at, const diagnosis::BaseFit& base, const meshing::TetMesh& mesh,
                    const VectorXd& u, const Json& answer, const VectorXd& on_given_mm) {
  const meshing::Anatomy anatomy =
      meshing::compute_anatomy(mesh, at.scene.anatomy->side, at.scene.anatomy->imaged_pose);
  calibration::MeasuredScene scene = at.scene;
  scene.mesh = &mesh, scene.anatomy = &anatomy;
  const std::vector<Nuisance> nuisances = true_nuisances(base.nuisances, answer, true);
  const simulation::Model truth =
      diagnosis::with_nuisances(base.parameters->model(u), nuisances, diagnosis::poses_of(scene));
  calibration::Evaluator evaluator(scene, truth, diagnosis::accurate_enough());
  const calibration::Residuals there =
      calibration::residuals_of(scene, evaluator.predict(truth), base.fit.mask, base.noise_mm);
  return on_given_mm - there.distance_mm;
}

/// A truth beside the fit of a model that lacks nothing.
struct Beside {
  const diagnosis::Subject& at;
  const diagnosis::BaseFit& base;
  const Json& answer;
  VectorXd u;                   // true moduli
  VectorXd distance_mm;         // of the truth on the given mesh
  double size_mm;               // of the discrepancy that was drawn
  VectorXd whitened_mm;         // of the truth
  VectorXd whitened_mesh_mm{};  // of them what the mesh does, where the truth's own is known

  VectorXd white(const VectorXd& of_clusters) const { return whitened(base, of_clusters, size_mm); }
  double misfit(const VectorXd& z) const { return z.squaredNorm() / static_cast<double>(z.size()); }
};

/// The truth's numbers on the given mesh.
Beside truth_beside(const diagnosis::Subject& at, calibration::Evaluator& evaluator, const diagnosis::BaseFit& base,
                    const Json& answer, bool own) {
  Beside truth{at, base, answer, true_coordinates(*base.parameters, answer), {}, answer.at("discrepancy").at("size_mm"),
               {}};
  const simulation::Model model = diagnosis::with_nuisances(
      base.parameters->model(truth.u), true_nuisances(base.nuisances, answer, own), diagnosis::poses_of(at.scene));
  const calibration::Prediction prediction = evaluator.predict(model, &base.fit.prediction.solution);
  const calibration::Residuals residuals =
      calibration::residuals_of(at.scene, prediction, base.fit.mask, base.noise_mm);
  truth.distance_mm = residuals.distance_mm;
  truth.whitened_mm = truth.white(base.distances(residuals));
  truth.whitened_mesh_mm = VectorXd::Zero(truth.whitened_mm.size());
  fmt::print("points {} size_mm {:.2f} misfit {:.3f} of_fit {:.3f}\n", truth.whitened_mm.size(), truth.size_mm,
             truth.misfit(truth.whitened_mm), truth.misfit(truth.white(base.distances(base.fit.residuals))));
  return truth;
}

void tell_mesh(const meshing::TetMesh& mesh, Beside& truth) {
  const diagnosis::BaseFit& base = truth.base;
  const VectorXd before_mm = mesh_error(truth.at, base, mesh, truth.u, truth.answer, truth.distance_mm);
  const VectorXd after_mm = base.clusters.means(before_mm + base.mean_mm);
  truth.whitened_mesh_mm = truth.white(after_mm);
  fmt::print("mesh {:.3f} mm, corrected {:.3f}, taken to be {:.3f} and {:.3f}; misfit {:.3f}\n", rms(before_mm),
             rms(after_mm), rms(base.mean_mm), base.numerical->spread_mm, truth.misfit(truth.whitened_mesh_mm));
}

/// The share of the misfit along every number and every effect.
void tell_shares(calibration::Evaluator& evaluator, const Beside& truth) {
  const diagnosis::BaseFit& base = truth.base;
  const auto tell = [&](const char* what, const std::string& name, const VectorXd& of_points) {
    const VectorXd along = truth.white(base.clusters.means(of_points)).normalized();
    fmt::print("{} {} {:.3f} {:.3f}\n", what, name, along.dot(truth.whitened_mm), along.dot(truth.whitened_mesh_mm));
  };
  for (Index i = 0; i < truth.u.size(); ++i)
    tell("number", base.parameters->names()[static_cast<std::size_t>(i)], base.fit.linearisation.slope.col(i));
  for (const Nuisance& nuisance : base.nuisances) tell("number", nuisance.name(), nuisance.shape_mm);
  std::vector<std::string> unseen;
  auto candidates = diagnosis::find_candidates(evaluator, base.model, base.fit, unseen);
  diagnosis::find_secants(truth.at.scene, base, base, candidates, true);
  for (const diagnosis::Candidate& candidate : candidates)
    for (Index k = 0; k < candidate.slope.cols(); ++k)
      tell("effect", candidate.parameters[static_cast<std::size_t>(k)].name,
           candidate.secant.size() > 0 && k == 0 ? candidate.secant : VectorXd(candidate.slope.col(k)));
}

void run(const char* const* words, const std::string& truth_file) {
  const bool own = truth_file == words[2];
  pipeline::Run run("bench_truth_misfit", true, true, false, 1, nlohmann::ordered_json::object());
  const Json answer = Json::parse(std::ifstream(words[4]));
  if (!answer.at("causes").empty()) throw InputError(fmt::format("{}: has causes; a null is asked for", words[4]));
  const pipeline::CaseToDiagnose subject =
      pipeline::measure_to_diagnose(run, pipeline::read_case_inputs(run, words[1], words[2], words[3]));
  pipeline::LiveProgress live(run);
  pipeline::DiagnoseOptions asked;
  asked.other_meshes = !own;
  const diagnosis::ExamineOptions options = pipeline::examine_options(subject, asked, live);
  const diagnosis::Subject at = subject.subject();
  calibration::Evaluator evaluator(at.scene, at.start, diagnosis::accurate_enough());
  const diagnosis::BaseFit base = diagnosis::fit_base_model(evaluator, at.given, at.start, at.noise_mm, at.near,
                                                            {options.priors, options.other_meshes, {}});
  Beside truth = truth_beside(at, evaluator, base, answer, own);
  if (!truth_file.empty() && !own) tell_mesh(meshing::read_mesh(truth_file), truth);
  tell_shares(evaluator, truth);
}

}  // namespace
}  // namespace supine

int main(int count, char** words) {
  try {
    if (count < 5) throw supine::InputError("bench_truth_misfit CASE MESH.vtu MODEL.toml ANSWER.json [TRUTH.vtu]");
    supine::run(words, count > 5 ? words[5] : "");
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_truth_misfit: error: {}\n", error.what());
    return 2;
  }
  return 0;
}
