// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/core.h>

#include <fstream>

#include "common/error.h"
#include "pipeline/report/answer.h"
#include "pipeline/report/collect.h"
#include "pipeline/report/page.h"
#include "pipeline/report/shapes.h"
#include "pipeline/report/slices.h"
#include "pipeline/report/stages.h"
#include "pipeline/tool/provenance.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

class ReportTool : public Tool {
 public:
  std::string name() const override { return "supine-report"; }

  std::string summary() const override {
    return "Writes one page of everything that is known of a case: what is missing and what to do next, the shapes in "
           "3-D with the distance to the scan, the ladder, candidates, parameters, error budget, mesh, provenance.\n"
           "The page opens from the disk in any browser of today and needs no network. Stages that have not run are "
           "named with the command that runs them. -o names the page (default: report.html in the output folder).\n\n"
           "Examples:\n"
           "  supine-report mycase\n"
           "  supine-report mycase --dir elsewhere -o mycase.html --force\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("--dir", out_folder_, "folder of the case's results (default: CASE/out)");
    app.add_flag("--no-3d", no_view3d_, "leave the 3-D view and the slices out: the page is then about 0.1 MB");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const Case measured = read_case(case_folder_);
    const Places places = find_places();
    const fs::path target = target_file(places);
    run.output(target);  // before the work, so that nobody waits for what cannot be written
    const Collected collected = collect(measured, places.case_folder, places.out);
    const auto stages = stages_of(measured, collected, places);
    for (const Stage& stage : stages)
      if (!stage.stale.empty())
        run.warn(
            fmt::format("{}; run {}", stage.stale, stage.name == "sensitivity" ? "it again" : places.make(stage.name)));
    run.stage("shapes");
    Json data = about(measured);
    try {
      data["answer"] = answer_json(answer_of(measured, collected, stages, places));
    } catch (const Json::exception& error) {
      throw InputError(
          fmt::format("{}: diagnosis.json, ladder.json or comparison.json is not as this version writes it ({}); run "
                      "the stage again that "
                      "wrote it",
                      places.out.string(), error.what()));
    }
    data["stages"] = stages_json(stages);
    data["figures"] = collected.figures;
    data["texts"] = collected.texts;
    data["pictures"] = collected.pictures;
    data["shapes"] = shapes(run, measured, collected, places);
    data["slices"] = no_view3d_ ? Json(nullptr) : slices_json(run, measured, places.out);
    data["commands"] = {{"targets", places.make("targets")}, {"warp", places.make("warp")}};
    data["view3d"] = view3d_remark(run);
    run.stage("write");
    write(run, target, measured, data);
    return Outcome::done;
  }

 private:
  Places find_places() const {
    Places places;
    places.case_folder = case_folder_;
    places.out = out_folder_.empty() ? case_folder_ / "out" : out_folder_;
    // Without a slash at the end, which a shell adds when it completes a name.
    const auto named = [](const fs::path& folder) {
      const std::string text = folder.lexically_normal().generic_string();
      return text.size() > 1 && text.back() == '/' ? text.substr(0, text.size() - 1) : text;
    };
    places.case_name = named(places.case_folder);
    places.out_name = named(places.out);
    if (!fs::is_directory(places.out))
      throw InputError(
          fmt::format("{} is not there: nothing of this case has been computed. Run {}, or name the folder "
                      "of its results with --dir",
                      places.out.string(), places.make("simulate")));
    return places;
  }

  fs::path target_file(const Places& places) const {
    if (output.empty()) return places.out / "report.html";
    if (fs::is_directory(output)) return output / "report.html";
    const std::string end = output.extension().string();
    if (end != ".html" && end != ".htm")
      throw InputError(
          fmt::format("-o {}: the report is a page; name it .html, or an existing folder", output.string()));
    return output;
  }

  static Json about(const Case& measured) {
    Json data;
    data["case"] = {{"name", measured.name}, {"side", measured.side}, {"poses", Json::array()}};
    for (const Pose& pose : measured.poses)
      data["case"]["poses"].push_back({{"name", pose.name},
                                       {"gravity", {pose.gravity.x(), pose.gravity.y(), pose.gravity.z()}},
                                       {"measured", pose.surface.has_value()},
                                       {"noise_mm", pose.noise_mm ? Json(*pose.noise_mm) : Json(nullptr)}});
    data["case"]["imaged"] = measured.imaged_pose;
    data["case"]["predicted"] = measured.predicted().name;
    data["case"]["calibrated_poses"] = measured.calibrated_poses;
    data["version"] = supine_version();
    data["commit"] = supine_commit();
    return data;
  }

  Json shapes(Run& run, const Case& measured, const Collected& collected, const Places& places) const {
    if (no_view3d_) return nullptr;
    const Json& ladder = collected.first({"ladder/ladder.json", "ladder.json"});
    return shapes_json(run, measured, places.out, find_states(places.out, ladder));
  }

  /// Why there is no 3-D view; empty when there is.
  std::string view3d_remark(Run& run) const {
    if (no_view3d_) return "The 3-D view was left out (--no-3d).";
    if (!page_assets().view3d.empty()) return {};
    run.warn(
        "the page has no 3-D view: this supine-report was built without vtk.js, which npm fetches; install npm, allow "
        "it to reach its registry and build again");
    return "The 3-D view is left out: supine-report was built where npm could not fetch vtk.js. Install npm, go "
           "online and build again.";
  }

  void write(Run& run, const fs::path& target, const Case& measured, const Json& data) const {
    PageAssets assets = page_assets();
    if (no_view3d_) assets.view3d = {};
    const std::string page = render_page(assets, measured.name + " – Supine", data);
    std::ofstream stream(run.output(target), std::ios::binary);
    stream << page;
    if (!stream.flush())
      throw InputError(fmt::format("writing {} failed; check the free space on the disk", target.string()));
    Json missing = Json::array();
    for (const Json& stage : data["stages"])
      if (stage["file"] == "") missing.push_back({{"stage", stage["name"]}, {"fill", stage["fill"]}});
    run.figures(target) = {{"case", measured.name},
                           {"answer", data["answer"]},
                           {"not_run", missing},
                           {"view3d", data["view3d"] == "" && !data["shapes"].is_null()},
                           {"bytes", page.size()}};
    run.say(fmt::format("  {}", data["answer"]["sentence"].get<std::string>()));
    for (const Json& gap : missing)
      run.say(fmt::format("  not run: {:<12} {}", gap["stage"].get<std::string>(), gap["fill"].get<std::string>()));
    run.say(fmt::format("  {} ({:.1f} MB)", target.string(), static_cast<double>(page.size()) / 1e6));
  }

  fs::path case_folder_, out_folder_;
  bool no_view3d_ = false;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::ReportTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
