// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "common/error.h"
#include "common/suggestion.h"
#include "pipeline/case/case.h"
#include "pipeline/case/case_volume.h"
#include "pipeline/tool/tool.h"
#include "segmentation/doubt/doubt.h"
#include "segmentation/formats/labels_io.h"
#include "segmentation/label_map.h"
#include "segmentation/overlay.h"
#include "segmentation/recipes/shipped.h"
#include "segmentation/steps/recipe_toml.h"
#include "segmentation/steps/run_recipe.h"

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
  std::vector<segmentation::CutPlane> planes;         ///< of an automatic recipe
  std::array<segmentation::TissueCounts, 2> sides{};  ///< voxels left and right of the sternum plane, when there is one
  std::vector<segmentation::Doubt> doubts;
  std::vector<float> gland_share;  ///< per voxel; empty when no step found it
  segmentation::SupportVoxels supports;
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
           "  supine-segment mycase --recipe t1_auto --overlays mycase/out/overlays\n"
           "  supine-segment mycase --recipe t1.toml -o labels.vti --force\n"
           "  supine-segment --recipes\n"
           "  supine-segment mycase --truth labels.nrrd\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("--recipe", recipe_,
                   "a recipe's name, or a file with a [segmentation] table, instead of case.toml's");
    app.add_flag_callback("--recipes", list_recipes, "lists the recipes that come with the program, and ends");
    app.add_option("--overlays", overlay_folder_,
                   "folder for three PNG mosaics, one per axis, with the outlines of the tissues");
    app.add_option("--slices", overlay_options_.slices, "slices per mosaic")->check(CLI::Range(1, 64));
    app.add_option("--truth", truth_file_,
                   "label volume on the same grid, mapped by [image.labels] of the case: prints Dice overlaps");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    run.input(fs::path(case_folder_) / "case.toml");
    const Case measured = read_case(case_folder_);
    if (measured.image_kind == "surface")
      throw InputError(
          fmt::format("{}: [image] is a surface: there is nothing to segment; supine-reconstruct {} reads it",
                      case_folder_ + "/case.toml", case_folder_));
    Findings findings;
    LabelImage labels = make_labels(measured, run, findings);
    run.stage("check");
    check(measured, labels);
    segmentation::check_supports(findings.supports, labels, measured.image_file.string());
    findings.voxels = segmentation::count_tissues(labels);
    if (!measured.is_object()) check_volume(measured, labels, findings);
    count_sides(labels, findings);
    run.progress("counting components");
    findings.components = segmentation::count_components(labels);
    if (findings.components.meshed > 1)
      run.warn(fmt::format("the tissue lies in {} separate pieces; each needs {} or a cut to hold it",
                           findings.components.meshed, measured.is_object() ? "a support" : "muscle"));
    if (!truth_file_.empty()) findings.dice = compare_with_truth(measured, labels, run);
    run.stage("write");
    const fs::path target = output.empty() ? fs::path(case_folder_) / "out" / "labels.vti" : output;
    if (target.extension() != ".vti")
      throw InputError(fmt::format("-o {}: the label file ends in .vti", target.string()));
    run.progress("writing");
    segmentation::write_labels(labels, run.output(target), notes_of(measured), findings.gland_share, findings.supports);
    fill(run.figures(target), measured, labels.grid, findings);
    if (!overlay_folder_.empty()) write_overlays(labels, run);
    say(run, labels.grid, findings, target);
    return doubtful(findings, labels, target, run);
  }

 private:
  /// A body of the wrong size is one in the wrong unit.
  static void check_volume(const Case& measured, const LabelImage& labels, const Findings& findings) {
    constexpr double least_ml = 2, most_ml = 20000;
    const double ml = volume_ml(labels.grid, meshed(findings.voxels));
    if (ml >= least_ml && ml <= most_ml) return;
    throw InputError(
        fmt::format("{}: the tissue to be meshed has {:.3g} ml (bound {:g} to {:g}): the spacing of the "
                    "volume must be in mm; was it written in cm or metres?",
                    measured.image_file.string(), ml, least_ml, most_ml));
  }

  LabelImage make_labels(const Case& measured, Run& run, Findings& findings) {
    const std::string file = measured.image_file.string();
    if (!recipe_.empty() && measured.image_kind != "mri")
      throw InputError(fmt::format("--recipe {}: the case has image.kind = \"{}\"; a recipe needs \"mri\"", recipe_,
                                   measured.image_kind));
    run.progress("reading " + file);
    segmentation::ImageFile volume = read_case_volume(run, measured, measured.image_file);
    findings.file_frame = volume.frame;
    check_frame(measured, volume.frame, run);
    if (measured.image_kind == "labels") {
      run.stage("map");
      segmentation::MappedLabels mapped = segmentation::map_labels(volume.image, measured.labels, file);
      for (const auto& warning : mapped.warnings) run.warn(warning);
      findings.supports = segmentation::mark_supports(volume.image, measured.label_supports);
      return std::move(mapped.image);
    }
    run.stage("recipe");
    const segmentation::Recipe recipe = find_recipe(measured, run);
    grey_ = volume.image;
    auto result = segmentation::run_recipe(
        std::move(volume.image), recipe, [&run](const std::string& line) { run.progress(line); },
        second_series(run, measured));
    findings.recipe_log = std::move(result.log);
    findings.planes = std::move(result.planes);
    findings.gland_share = std::move(result.fraction_gland);
    findings.doubts = std::move(result.doubts);
    return std::move(result.labels);
  }

  static std::optional<segmentation::GreyImage> second_series(Run& run, const Case& measured) {
    if (!measured.second_file) return {};
    run.progress("reading " + measured.second_file->string());
    Case second = measured;
    second.image_series = measured.second_series;
    return read_case_volume(run, second, *measured.second_file).image;
  }

  static void check_frame(const Case& measured, const std::string& named, Run& run) {
    if (!measured.image_frame.empty() && !named.empty())
      throw InputError(
          fmt::format("{}: the file names its own frame, {}; take image.frame = \"{}\" out of case.toml, or "
                      "correct the file",
                      measured.image_file.string(), named, measured.image_frame));
    if (measured.image_frame.empty() && named.empty())
      run.warn(fmt::format("the volume names no patient frame; taken as {} (case.frame; image.frame names another)",
                           measured.frame));
    if (measured.imaged_pose != "prone" || measured.is_object()) return;
    constexpr double least_to_front = 0.5;  // of a unit vector: 60 degrees
    const Eigen::Vector3d& falls = measured.imaged().gravity;
    if (-falls.y() < least_to_front)
      run.warn(
          fmt::format("[pose.prone] gravity is LPS ({:.2f}, {:.2f}, {:.2f}); a prone patient's breast falls to the "
                      "front, (0, -1, 0). If the volume's axes are not the patient's, say so by image.frame and "
                      "give gravity in case.frame",
                      falls.x(), falls.y(), falls.z()));
  }

  static void list_recipes() {
    for (const auto& recipe : segmentation::shipped_recipes()) fmt::print("{:<16}{}\n", recipe.name, recipe.about);
    throw CLI::Success();
  }

  segmentation::Recipe find_recipe(const Case& measured, Run& run) const {
    using Side = segmentation::Planes::Side;
    segmentation::Recipe recipe = named_recipe(measured, run);
    recipe.set_side(measured.side == "left" ? Side::left : measured.side == "right" ? Side::right : Side::both);
    return recipe;
  }

  segmentation::Recipe named_recipe(const Case& measured, Run& run) const {
    if (segmentation::shipped_recipe(recipe_)) return segmentation::read_shipped_recipe(recipe_, measured.frame);
    if (!recipe_.empty() && !fs::exists(recipe_))
      throw InputError(fmt::format("--recipe {}: no such file, and no recipe of that name; {}", recipe_,
                                   suggestion(recipe_, segmentation::recipe_names())));
    if (!recipe_.empty()) return segmentation::read_recipe_file(run.input(recipe_), measured.frame);
    if (measured.recipe) return *measured.recipe;
    throw InputError(fmt::format(
        "{}: image.kind = \"mri\" needs a recipe: add [segmentation] with recipe = \"t1_auto\" (supine-segment "
        "--recipes lists them) or steps to case.toml, or give --recipe NAME or FILE",
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
    const auto volume = read_case_volume(run, measured, truth_file_);
    return segmentation::dice(labels, segmentation::map_labels(volume.image, measured.labels, truth_file_).image);
  }

  static void count_sides(const LabelImage& labels, Findings& findings) {
    const auto sternum = std::find_if(findings.planes.begin(), findings.planes.end(),
                                      [](const auto& plane) { return plane.name == "sternum"; });
    if (sternum == findings.planes.end()) return;
    const Grid& grid = labels.grid;
    for (int k = 0; k < grid.size.z(); ++k)
      for (int j = 0; j < grid.size.y(); ++j)
        for (int i = 0; i < grid.size.x(); ++i) {
          const bool right = grid.point(Eigen::Vector3d(i, j, k)).x() < sternum->at_mm;  // LPS: +x is the left
          ++findings.sides[right][labels.at(i, j, k)];
        }
  }

  static void fill_sides(Json& json, const Grid& grid, const Findings& findings) {
    for (const auto& plane : findings.planes)
      json["planes"][plane.name] = {
          {"axis", std::string(1, plane.axis)}, {"at_mm", plane.at_mm}, {"given", plane.given}};
    if (findings.planes.empty()) return;
    for (int t = 0; t < tissue_count; ++t)
      for (const int side : {0, 1})
        json["sides_ml"][side == 0 ? "left" : "right"][std::string(tissue_names[t])] =
            volume_ml(grid, findings.sides[side][t]);
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
    for (const auto& doubt : findings.doubts)
      json["doubts"].push_back({{"what", doubt.what}, {"place_mm", numbers(doubt.place_mm)}});
    if (!findings.gland_share.empty())
      json["gland_by_share_ml"] = std::accumulate(findings.gland_share.begin(), findings.gland_share.end(), 0.0) *
                                  grid.voxel_volume_mm3() / 1000;
    for (std::size_t s = 0; s < findings.supports.names.size(); ++s)
      json["supports_ml"][findings.supports.names[s]] = volume_ml(grid, voxels_of(findings.supports, s));
    fill_sides(json, grid, findings);
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
    for (std::size_t s = 0; s < findings.supports.names.size(); ++s)
      run.say(fmt::format("support {:<12}{:>10.1f} ml", findings.supports.names[s],
                          volume_ml(grid, voxels_of(findings.supports, s))));
    if (!findings.planes.empty())
      run.say(fmt::format("left breast {:.1f} ml (gland {:.1f}), right breast {:.1f} ml (gland {:.1f})",
                          volume_ml(grid, meshed(findings.sides[0])), volume_ml(grid, findings.sides[0][2]),
                          volume_ml(grid, meshed(findings.sides[1])), volume_ml(grid, findings.sides[1][2])));
    if (findings.dice) run.say(fmt::format("whole breast (adipose, gland, skin): Dice {:.4f}", findings.dice->breast));
    run.say(target.string());
  }

  void write_overlays(const LabelImage& labels, Run& run) const {
    for (const auto& [axis, name] : {std::pair(0, "sagittal"), {1, "coronal"}, {2, "axial"}}) {
      std::vector<double> places_mm;
      const auto picture =
          segmentation::overlay(labels, grey_.voxels.empty() ? nullptr : &grey_, axis, overlay_options_, places_mm);
      const fs::path target = fs::path(overlay_folder_) / fmt::format("labels_{}.png", name);
      segmentation::write_png(picture, run.output(target));
      Json& json = run.figures(target);
      json["axis"] = std::string(1, "xyz"[axis]);
      json["slices_mm"] = places_mm;
      json["columns"] = overlay_options_.columns;
    }
  }

  /// Says what does not look right, and draws its place beside the labels.
  Outcome doubtful(const Findings& findings, const LabelImage& labels, const fs::path& target, Run& run) const {
    constexpr std::array<const char*, 3> views{"axial", "sagittal", "coronal"};
    for (std::size_t n = 0; n < findings.doubts.size(); ++n) {
      const segmentation::Doubt& doubt = findings.doubts[n];
      const auto pictures = segmentation::pictures_of(doubt, labels, grey_);
      std::string files;
      for (std::size_t view = 0; view < views.size(); ++view) {
        const fs::path file =
            target.parent_path() / fmt::format("{}_doubt_{}_{}.png", target.stem().string(), n + 1, views[view]);
        segmentation::write_png(pictures[view], run.output(file));
        if (view == 0) files = file.string();
        run.figures(file)["place_mm"] = numbers(doubt.place_mm);
      }
      const Eigen::Vector3d& at = doubt.place_mm;
      run.warn(fmt::format("in doubt at ({:.0f}, {:.0f}, {:.0f}) mm: {} (see {})", at.x(), at.y(), at.z(), doubt.what,
                           files));
    }
    return findings.doubts.empty() ? Outcome::done : Outcome::target_not_met;
  }

  static double volume_ml(const Grid& grid, std::size_t voxels) {
    return static_cast<double>(voxels) * grid.voxel_volume_mm3() / 1000;
  }
  static std::size_t voxels_of(const segmentation::SupportVoxels& supports, std::size_t row) {
    return static_cast<std::size_t>(std::count(supports.number.begin(), supports.number.end(), row + 1));
  }
  static std::size_t meshed(const segmentation::TissueCounts& voxels) {
    std::size_t sum = 0;
    for (int t = 0; t < tissue_count; ++t)
      if (segmentation::is_meshed(static_cast<segmentation::Tissue>(t))) sum += voxels[t];
    return sum;
  }

  std::string case_folder_, recipe_, truth_file_, overlay_folder_;
  segmentation::OverlayOptions overlay_options_;
  GreyImage grey_;  ///< the volume as read, for the pictures; empty for kind = "labels"
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::SegmentTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
