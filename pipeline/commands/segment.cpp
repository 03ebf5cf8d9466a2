// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "common/error.h"
#include "pipeline/case.h"
#include "pipeline/tool.h"
#include "segmentation/data_file.h"
#include "segmentation/image_io.h"
#include "segmentation/label_map.h"
#include "segmentation/labels_io.h"
#include "segmentation/recipe_toml.h"
#include "segmentation/run_recipe.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using segmentation::GreyImage;
using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::tissue_count;
using segmentation::tissue_names;

/// What the later tools need of the case: the cuts it allows and the side.
segmentation::LabelNotes notes_of(const Case& measured) {
  const AllowedCuts& cut = measured.cut;
  std::string list;
  for (const auto& [name, allowed] : {std::pair("excluded", cut.excluded), {"edge", cut.edge}, {"rim", cut.rim}})
    if (allowed) list += fmt::format("{}{}", list.empty() ? "" : ",", name);
  return {{"cut", list}, {"rim_mm", fmt::format("{}", cut.rim_mm)}, {"side", measured.side}};
}

/// What the tool found out about the labels.
struct Findings {
  segmentation::TissueCounts voxels;
  segmentation::ComponentCounts components;
  std::optional<segmentation::Dice> dice;
  std::vector<std::string> recipe_log;
  std::string file_frame;
};

Json numbers(const Eigen::Ref<const Eigen::VectorXd>& v) { return std::vector<double>(v.begin(), v.end()); }

Json grid_json(const Grid& grid) {
  Json json;
  json["size"] = std::vector<int>(grid.size.begin(), grid.size.end());
  json["spacing_mm"] = numbers(grid.spacing_mm);
  json["origin_mm"] = numbers(grid.origin_mm);
  for (int a = 0; a < 3; ++a) json["axes"].push_back(numbers(grid.direction.col(a)));
  return json;
}

class SegmentTool : public Tool {
 public:
  std::string name() const override { return "supine-segment"; }

  std::string summary() const override {
    return "Makes the label volume of a case: maps the labels of another program to tissues (kind = \"labels\") or "
           "runs a "
           "segmentation recipe on a grey MRI volume (kind = \"mri\"), and checks it.\n"
           "Writes labels.vti (default CASE/out/labels.vti).\n\n"
           "Examples:\n"
           "  supine-segment mycase\n"
           "  supine-segment mycase --recipe t1.toml -o labels.vti --force\n"
           "  supine-segment mycase --truth labels.nrrd\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("--recipe", recipe_file_, "file with a [segmentation] table, instead of the one in case.toml");
    app.add_option("--truth", truth_file_,
                   "label volume on the same grid, mapped by [image.labels] of the case: prints Dice overlaps");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    run.input(fs::path(case_folder_) / "case.toml");
    const Case measured = read_case(case_folder_);
    Findings findings;
    LabelImage labels = make_labels(measured, run, findings);
    run.stage("check");
    check(measured, labels);
    findings.voxels = segmentation::count_tissues(labels);
    run.progress("counting components");
    findings.components = segmentation::count_components(labels);
    if (findings.components.meshed > 1)
      run.warn(fmt::format("the tissue lies in {} separate pieces; each needs muscle or a cut to hold it",
                           findings.components.meshed));
    if (!truth_file_.empty()) findings.dice = compare_with_truth(measured, labels, run);
    run.stage("write");
    const fs::path target = output.empty() ? fs::path(case_folder_) / "out" / "labels.vti" : output;
    if (target.extension() != ".vti")
      throw InputError(fmt::format("-o {}: the label file ends in .vti", target.string()));
    run.progress("writing");
    segmentation::write_labels(labels, run.output(target), notes_of(measured));
    fill(run.figures(target), measured, labels.grid, findings);
    say(run, labels.grid, findings, target);
    return Outcome::done;
  }

 private:
  LabelImage make_labels(const Case& measured, Run& run, Findings& findings) const {
    const std::string file = measured.image_file.string();
    if (!recipe_file_.empty() && measured.image_kind != "mri")
      throw InputError(fmt::format("--recipe {}: the case has image.kind = \"{}\"; a recipe needs \"mri\"",
                                   recipe_file_, measured.image_kind));
    run.progress("reading " + file);
    segmentation::ImageFile volume = read_volume(measured.image_file, measured, run);
    findings.file_frame = volume.frame;
    if (volume.frame.empty())
      run.warn(fmt::format("the volume names no patient frame; taken as {} (case.frame)", measured.frame));
    if (measured.image_kind == "labels") {
      run.stage("map");
      segmentation::MappedLabels mapped = segmentation::map_labels(volume.image, measured.labels, file);
      for (const auto& warning : mapped.warnings) run.warn(warning);
      return std::move(mapped.image);
    }
    run.stage("recipe");
    const segmentation::Recipe recipe = find_recipe(measured, run);
    auto result = segmentation::run_recipe(std::move(volume.image), recipe,
                                           [&run](const std::string& line) { run.progress(line); });
    findings.recipe_log = std::move(result.log);
    return std::move(result.labels);
  }

  static segmentation::ImageFile read_volume(const fs::path& file, const Case& measured, Run& run) {
    if (fs::is_directory(file))
      throw InputError(
          fmt::format("{}: a DICOM folder is not read by this version; convert the series to one .nrrd, .mha or "
                      ".nii.gz file (for example with 3D Slicer or dcm2niix)",
                      file.string()));
    segmentation::ImageFile volume = segmentation::read_image(run.input(file), measured.frame);
    if (const auto voxels = segmentation::detached_data_file(file)) run.input(*voxels);
    for (const auto& warning : volume.warnings) run.warn(warning);
    return volume;
  }

  segmentation::Recipe find_recipe(const Case& measured, Run& run) const {
    if (!recipe_file_.empty()) return segmentation::read_recipe_file(run.input(recipe_file_), measured.frame);
    if (measured.recipe) return *measured.recipe;
    throw InputError(fmt::format("{}: image.kind = \"mri\" needs a [segmentation] table in case.toml, or --recipe FILE",
                                 (measured.folder / "case.toml").string()));
  }

  static void check(const Case& measured, const LabelImage& labels) {
    const std::string name = measured.image_file.string();
    segmentation::check_tissues(labels, name);
    if (!measured.cut.edge) segmentation::check_edge(labels, name);
    if (!measured.cut.excluded) segmentation::check_excluded(labels, name);
  }

  segmentation::Dice compare_with_truth(const Case& measured, const LabelImage& labels, Run& run) const {
    run.stage("truth");
    if (measured.labels.empty())
      throw InputError(
          fmt::format("--truth {}: case.toml has no table [image.labels] to map its values by", truth_file_));
    const auto volume = read_volume(truth_file_, measured, run);
    return segmentation::dice(labels, segmentation::map_labels(volume.image, measured.labels, truth_file_).image);
  }

  static void fill(Json& json, const Case& measured, const Grid& grid, const Findings& findings) {
    json["case"] = measured.name;
    json["kind"] = measured.image_kind;
    json["file_frame"] = findings.file_frame;
    json["grid"] = grid_json(grid);
    for (int t = 0; t < tissue_count; ++t) {
      const std::string tissue(tissue_names[t]);
      json["voxels"][tissue] = findings.voxels[t];
      json["volume_ml"][tissue] = volume_ml(grid, findings.voxels[t]);
      json["components"][tissue] = findings.components.tissue[t];
    }
    json["meshed_components"] = findings.components.meshed;
    json["meshed_volume_ml"] = volume_ml(grid, meshed(findings.voxels));
    if (!findings.recipe_log.empty()) json["recipe"] = findings.recipe_log;
    if (!findings.dice) return;
    for (int t = 0; t < tissue_count; ++t)
      if (std::isfinite(findings.dice->tissue[t]))
        json["dice"][std::string(tissue_names[t])] = findings.dice->tissue[t];
    json["dice_breast"] = findings.dice->breast;
  }

  static void say(const Run& run, const Grid& grid, const Findings& findings, const fs::path& target) {
    for (const auto& line : findings.recipe_log) run.say("  " + line);
    run.say(fmt::format("{} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm", grid.size.x(), grid.size.y(),
                        grid.size.z(), grid.spacing_mm.x(), grid.spacing_mm.y(), grid.spacing_mm.z()));
    run.say(
        fmt::format("{:<10}{:>12}{:>11}{:>8}{}", "tissue", "voxels", "ml", "pieces", findings.dice ? "    Dice" : ""));
    for (int t = 0; t < tissue_count; ++t) {
      if (findings.voxels[t] == 0) continue;
      const std::string overlap = findings.dice ? fmt::format("{:8.4f}", findings.dice->tissue[t]) : "";
      run.say(fmt::format("{:<10}{:>12}{:>11.1f}{:>8}{}", tissue_names[t], findings.voxels[t],
                          volume_ml(grid, findings.voxels[t]), findings.components.tissue[t], overlap));
    }
    run.say(fmt::format("{:<10}{:>12}{:>11.1f}{:>8}", "meshed", meshed(findings.voxels),
                        volume_ml(grid, meshed(findings.voxels)), findings.components.meshed));
    if (findings.dice) run.say(fmt::format("whole breast (adipose, gland, skin): Dice {:.4f}", findings.dice->breast));
    run.say(target.string());
  }

  static double volume_ml(const Grid& grid, std::size_t voxels) {
    return static_cast<double>(voxels) * grid.voxel_volume_mm3() / 1000;
  }
  static std::size_t meshed(const segmentation::TissueCounts& voxels) {
    std::size_t sum = 0;
    for (int t = 0; t < tissue_count; ++t)
      if (segmentation::is_meshed(static_cast<segmentation::Tissue>(t))) sum += voxels[t];
    return sum;
  }

  std::string case_folder_, recipe_file_, truth_file_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::SegmentTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
