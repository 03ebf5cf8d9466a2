// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/simulate.h"

#include <fmt/format.h>

#include <fstream>

#include "common/error.h"
#include "common/landmarks.h"
#include "pipeline/case/case_inputs.h"
#include "pipeline/case/model_edit.h"
#include "pipeline/tool/tool.h"
#include "pipeline/work/passengers.h"
#include "reconstruction/surface_io.h"
#include "simulation/embedding.h"
#include "simulation/export/exported_pose.h"
#include "simulation/parameters.h"
#include "simulation/solve/carrying_modulus.h"
#include "simulation/solve/chain.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using simulation::PoseSolution;

const std::map<std::string, simulation::Solver> solvers = {{"calculix", simulation::Solver::calculix},
                                                           {"febio", simulation::Solver::febio},
                                                           {"sofa", simulation::Solver::sofa}};

class SimulateTool : public Tool {
 public:
  std::string name() const override { return "supine-simulate"; }

  std::string summary() const override {
    return "Finds the gravity-free (undeformed) shape of the imaged body and from it the shape in every other pose of "
           "the case.\n"
           "Writes prone.vtu (the imaged pose), undeformed.vtu, supine.vtu (and the case's other poses), the organ "
           "surfaces and "
           "landmarks "
           "in each pose. -o names their folder (default: that of the mesh).\n\n"
           "Examples:\n"
           "  supine-simulate mycase mycase/out/mesh.vtu\n"
           "  supine-simulate mycase mycase/out/mesh.vtu --model stiff.toml --pose supine -o trial\n"
           "  supine-simulate mycase mycase/out/mesh.vtu --export calculix -o trial\n"
           "  supine-simulate mycase mycase/out/mesh.vtu --find-modulus -o trial     (then --model trial/model.toml)\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("mesh", mesh_file_, "imaged mesh, as supine-tetrahedralise writes it (.vtu)")->required();
    app.add_option("--model", model_file_, "what is believed of the tissue (default: CASE/model.toml)");
    app.add_option("--pose", asked_.poses, "predict this pose only; may be given several times (default: all)");
    app.add_option("--inverse", asked_.inverse,
                   "how the undeformed shape is found: newton (true inverse), fixed-point, "
                   "reversed-gravity")
        ->check(CLI::IsMember({"newton", "fixed-point", "reversed-gravity"}))
        ->capture_default_str();
    app.add_option("--export", export_to_,
                   "also write every pose, from the undeformed shape, as input for another solver: calculix, febio, "
                   "sofa (docs/second-opinion.md)")
        ->check(CLI::IsMember({"calculix", "febio", "sofa"}));
    app.add_flag(
           "--find-modulus", find_modulus_,
           "only find the softest breast.young_modulus_kpa (kPa, to 5 %) that carries the body in every pose, and "
           "write model.toml with it")
        ->excludes("--export")
        ->excludes("--inverse");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const CaseInputs in = read_case_inputs(run, case_folder_, mesh_file_, model_file_);
    warn_of_locking(run, in);
    const auto loads = loads_of(in.description, asked_.poses);
    if (!export_to_.empty()) simulation::check_exportable(solvers.at(export_to_), in.mesh, in.anatomy, in.model, loads);
    if (find_modulus_) return find_modulus(run, in, loads);
    const Passengers passengers = read_passengers(run, in, mesh_file_.parent_path());
    run.stage("solve");
    const Simulated simulated = simulate(run, in, asked_);
    run.stage("write");
    write(run, in, passengers, simulated);
    if (!export_to_.empty()) write_exports(run, in, simulated);
    say_simulated(run, in, simulated);
    return judge(run, simulated);
  }

 private:
  /// The model as it stands with the modulus that was found: a value or a table { value = … }.
  Outcome find_modulus(Run& run, const CaseInputs& in, const std::vector<simulation::PoseLoad>& loads) const {
    run.stage("solve");
    simulation::ModulusSearch search;
    search.progress = [&run](double kpa) { run.progress(fmt::format("breast.young_modulus_kpa = {:.3g}", kpa)); };
    const auto found = simulation::find_carrying_modulus(in.mesh, in.anatomy, in.model, loads, search);
    const fs::path target = folder() / "model.toml";
    std::ofstream(run.output(target), std::ios::binary) << model_that_carries(in, found.carries_kpa);
    read_model(run.output(target));
    Json& f = run.figures(target);
    f["carries_kpa"] = found.carries_kpa;
    f["fails_kpa"] = found.fails_kpa ? Json(*found.fails_kpa) : Json(nullptr);
    f["chains"] = found.chains;
    run.say(fmt::format(
        "breast.young_modulus_kpa = {:.3g} carries the body in every pose, {} ({} chains); {} has it",
        found.carries_kpa,
        found.fails_kpa ? fmt::format("{:.3g} does not", *found.fails_kpa) : std::string("nothing softer was tried"),
        found.chains, target.string()));
    return Outcome::done;
  }

  /// The model's text with the modulus that was found; where it is free, in a range that holds it.
  static std::string model_that_carries(const CaseInputs& in, double kpa) {
    const std::string name = "breast.young_modulus_kpa";
    std::map<std::string, double> values = {{name, kpa}};
    const simulation::Setting& setting = in.model.breast.young_modulus_kpa;
    const simulation::Parameter& row = *simulation::find_parameter(name);
    if (setting.free && kpa < setting.lower) values[name + ".lower"] = std::max(row.lower, kpa / 2);
    if (setting.free && kpa > setting.upper) values[name + ".upper"] = std::min(row.upper, 2 * kpa);
    return with_values(in.model_text, values);
  }

  fs::path folder() const { return output.empty() ? mesh_file_.parent_path() : output; }

  void write(Run& run, const CaseInputs& in, const Passengers& passengers, const Simulated& simulated) const {
    std::vector<std::string> names = {simulation::free_of_load};
    if (in.description.imaged_pose != simulation::free_of_load) names.push_back(in.description.imaged_pose);
    for (const PoseSolution& pose : simulated.solution.poses) names.push_back(pose.name);
    for (const std::string& name : names) {
      const fs::path file = folder() / (name + ".vtu");
      write_shape(in, simulated, name, run.output(file));
      run.figures(file) = shape_figures(in, simulated, name);
      const Points& x = shape_of(simulated, name);
      write_passengers(run, passengers, x, folder(), name);
    }
  }

  /// Every pose for another solver, and beside it the displacements that ours found.
  void write_exports(Run& run, const CaseInputs& in, const Simulated& simulated) const {
    const simulation::Solver solver = solvers.at(export_to_);
    const auto& [loads, inverse, solution] = simulated;
    for (std::size_t p = 0; p < loads.size(); ++p) {
      const Points& x = p == 0 ? solution.prone : solution.poses[p - 1].x;
      const auto pose = simulation::export_pose(in.mesh, in.anatomy, in.model, loads[p], solution.X, x);
      const fs::path file = folder() / (loads[p].name + "_" + export_to_ + simulation::export_extension(solver));
      simulation::write_export(solver, pose, run.output(file));
      const fs::path table = folder() / (loads[p].name + "_displacement.csv");
      simulation::write_displacements(pose, run.output(table));
      Json& f = run.figures(file);
      f["solver"] = export_to_;
      f["nodes"] = pose.nodes;
      f["skin_tetrahedra"] = pose.skin.rows();
      f["springs"] = pose.springs.size();
      f["materials"] = pose.materials.size();
      f["compare_with"] = table.filename().string();
      run.say(fmt::format("  {} for {}: {} springs, {} skin tetrahedra; compare with {}", file.string(), export_to_,
                          pose.springs.size(), pose.skin.rows(), table.filename().string()));
    }
  }

  fs::path case_folder_, mesh_file_, model_file_;
  SimulateOptions asked_;
  std::string export_to_;
  bool find_modulus_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::SimulateTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
