// SPDX-License-Identifier: AGPL-3.0-or-later
#include "reconstruction/reconstruct.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>

#include "common/error.h"
#include "meshing/surface/sound_surface.h"
#include "pipeline/case/body_places.h"
#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"
#include "reconstruction/surface_io.h"
#include "segmentation/formats/labels_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using reconstruction::CutRules;
using reconstruction::OrganSurface;
using reconstruction::Reconstruction;
using reconstruction::Region;
using reconstruction::region_names;

constexpr double good_volume_error = 0.01;

class ReconstructTool : public Tool {
 public:
  std::string name() const override { return "supine-reconstruct"; }

  std::string summary() const override {
    return "Makes smooth closed surfaces of a label volume, with the region (inner, skin, cut) of every triangle.\n"
           "Writes breast.vtp, muscle.vtp and a surface per organ into the folder -o (default: that of the labels).\n"
           "Where cut faces are allowed is what labels.vti says (written there by supine-segment from case.toml).\n\n"
           "Examples:\n"
           "  supine-reconstruct mycase/out/labels.vti\n"
           "  supine-reconstruct samples/silicone_bar/e -o out      (kind = \"surface\": its regions from the "
           "supports)\n"
           "  supine-reconstruct labels.vti --cut edge,rim --rim-mm 12 -o surfaces --force\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("labels", labels_, "label volume (.vti), or the folder of a case whose image is a surface")
        ->required();
    app.add_option("--smooth-mm", smooth_mm_, "fairing length, mm, >= 0; default 0.75 of the largest voxel side");
    app.add_option("--cut", cut_, "where the model may end in a cut face, instead of what the labels say")
        ->delimiter(',')
        ->check(CLI::IsMember({"excluded", "edge", "rim"}));
    app.add_option("--rim-mm", rim_mm_, "how far from the muscle bare tissue counts as its rim, mm, > 0");
    app.add_option("--smallest-piece-mm3", options_.smallest_piece_mm3,
                   "loose bits of tissue below this volume are left out, mm3, >= 0");
    app.add_option("--thinnest-mm", options_.thinnest_mm,
                   "perforators (strands of tissue inside the muscle) thinner than this are counted as muscle, mm, >= "
                   "0; 0 also leaves thin handles");
  }

  Outcome run(Run& run) override {
    if (fs::is_directory(labels_)) return run_on_surface(run);
    run.stage("read");
    const segmentation::LabelImage image = segmentation::read_labels(run.input(labels_));
    options_.cut = cut_rules();
    const segmentation::LabelNotes notes = segmentation::read_label_notes(labels_);
    object_ = notes.contains("side") && notes.at("side") == "none";
    if (smooth_mm_) options_.smooth_mm = *smooth_mm_;
    run.stage("reconstruct");
    run.progress("making surfaces");
    const Reconstruction made = reconstruction::reconstruct(image, options_);
    run.stage("write");
    const fs::path folder = output.empty() ? fs::path(labels_).parent_path() : output;
    write(run, made, folder);
    return judge(run, made);
  }

 private:
  /// A body that came as a surface: closed as it is, regions from the supports of its case.
  Outcome run_on_surface(Run& run) {
    run.stage("read");
    run.input(fs::path(labels_) / "case.toml");
    const Case measured = read_case(labels_);
    const std::string what = measured.image_file.string();
    if (measured.image_kind != "surface")
      throw InputError(
          fmt::format("{}/case.toml: [image] kind is \"{}\"; make labels.vti with supine-segment first and "
                      "give that",
                      labels_, measured.image_kind));
    const reconstruction::Surface given = reconstruction::read_surface(run.input(measured.image_file), measured.frame);
    if (given.triangles.rows() == 0)
      throw InputError(fmt::format("{}: has points and no triangles; a body is a closed surface", what));
    run.stage("reconstruct");
    OrganSurface body;
    body.name = "body";
    body.report = meshing::require_sound(given, meshing::Borders::closed, what).report;
    body.surface = meshing::with_support_regions(given, read_supports(run, measured), what);
    body.report = reconstruction::check_surface(body.surface);
    body.voxel_volume_mm3 = body.report.volume_mm3;
    read_parts(run, measured);
    run.stage("write");
    const fs::path folder = output.empty() ? fs::path(labels_) / "out" : output;
    const fs::path file = folder / "breast.vtp", sheet = folder / "muscle.vtp";
    reconstruction::write_surface(body.surface, run.output(file));
    run.figures(file) = figures(body);
    run.figures(file).erase("volume_error");
    reconstruction::write_surface(reconstruction::reversed_region(body.surface, Region::inner), run.output(sheet));
    run.say(
        fmt::format("{:<10}{:>10} triangles, {:.2f} ml", "body", body.report.triangles, body.report.volume_mm3 / 1000));
    for (const Region region : {Region::inner, Region::skin})
      run.say(fmt::format("  {:<8}{:>8.1f} cm2", region == Region::inner ? "supports" : "skin",
                          body.report.region_area_mm2[static_cast<int>(region)] / 100));
    run.say(file.string());
    return Outcome::done;
  }

  CutRules cut_rules() const {
    const segmentation::LabelNotes notes = segmentation::read_label_notes(labels_);
    CutRules rules;
    std::vector<std::string> places = cut_;
    if (places.empty() && notes.contains("cut")) places = CLI::detail::split(notes.at("cut"), ',');
    for (const std::string& place : places) {
      if (place.empty()) continue;
      if (place == "excluded")
        rules.excluded = true;
      else if (place == "edge")
        rules.edge = true;
      else if (place == "rim")
        rules.rim = true;
      else
        throw InputError(
            fmt::format("{}: field data `cut` names \"{}\"; known are excluded, edge and rim", labels_, place));
    }
    if (rim_mm_) {
      rules.rim_mm = *rim_mm_;
    } else if (notes.contains("rim_mm")) {
      const std::string& text = notes.at("rim_mm");
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), rules.rim_mm);
      if (error != std::errc() || end != text.data() + text.size())
        throw InputError(fmt::format("{}: field data `rim_mm` is \"{}\", not a number", labels_, text));
    }
    return rules;
  }

  const char* body_word() const { return object_ ? "body" : "breast"; }
  const char* support_word() const { return object_ ? "supports" : "muscle"; }

  void write(Run& run, const Reconstruction& made, const fs::path& folder) const {
    const fs::path breast = folder / "breast.vtp", muscle = folder / "muscle.vtp";
    reconstruction::write_surface(made.breast.surface, run.output(breast));
    run.figures(breast) = figures(made.breast);
    say(run, made.breast);
    reconstruction::write_surface(made.muscle, run.output(muscle));
    const auto report = reconstruction::check_surface(made.muscle);
    run.figures(muscle) = {
        {"triangles", report.triangles}, {"area_cm2", report.area_mm2 / 100}, {"components", report.components}};
    run.say(fmt::format("{:<10}{:>10} triangles, {:.1f} cm2", support_word(), report.triangles, report.area_mm2 / 100));
    for (const OrganSurface& organ : made.organs) {
      const fs::path file = folder / (organ.name + ".vtp");
      reconstruction::write_surface(organ.surface, run.output(file));
      run.figures(file) = figures(organ);
      say(run, organ);
    }
    run.say(breast.string());
  }

  static Json figures(const OrganSurface& organ) {
    const auto& report = organ.report;
    Json json;
    json["triangles"] = report.triangles;
    json["points"] = report.points;
    json["volume_ml"] = {{"surface", report.volume_mm3 / 1000}, {"voxels", organ.voxel_volume_mm3 / 1000}};
    json["volume_error"] = organ.volume_error();
    for (std::size_t r = 0; r < region_names.size(); ++r)
      if (report.region_area_mm2[r] > 0)
        json["area_cm2"][std::string(region_names[r])] = report.region_area_mm2[r] / 100;
    json["components"] = report.components - report.cavities;
    json["voxel_components"] = organ.voxel_components;
    json["cavities"] = report.cavities;
    json["dropped_pieces"] = organ.dropped_pieces;
    json["dropped_ml"] = organ.dropped_volume_mm3 / 1000;
    json["prongs_in_muscle_ml"] = organ.perforator_volume_mm3 / 1000;
    if (organ.name == "breast")
      json["handles"] = {{"found", organ.handles.genus_before},
                         {"left", organ.handles.genus},
                         {"filled_ml", organ.handles.filled_mm3 / 1000},
                         {"removed_ml", organ.handles.removed_mm3 / 1000}};
    json["euler"] = report.euler;
    json["genus"] = report.genus();
    json["closed"] = report.closed();
    json["manifold"] = report.manifold();
    json["self_intersections"] = organ.self_intersections;
    json["less_smooth_points"] = organ.less_smooth_points;
    json["voxel_mm"] = organ.voxel_mm;
    return json;
  }

  void say(const Run& run, const OrganSurface& organ) const {
    const std::string name = organ.name == "breast" ? body_word() : organ.name;
    run.say(fmt::format("{:<10}{:>10} triangles, {:.2f} ml ({:+.3f} % of the voxels), {} piece(s)", name,
                        organ.report.triangles, organ.report.volume_mm3 / 1000, 100 * organ.volume_error(),
                        organ.report.components - organ.report.cavities));
    if (organ.name != "breast") return;
    for (const Region region : {Region::inner, Region::skin, Region::cut})
      run.say(fmt::format("  {:<8}{:>8.1f} cm2", region_names[static_cast<int>(region)],
                          organ.report.region_area_mm2[static_cast<int>(region)] / 100));
  }

  void warn_of_handles(Run& run, const reconstruction::HandleRepair& handles) const {
    if (!handles.places_mm.empty()) {
      const Eigen::Vector3d& at = handles.places_mm.front();
      run.warn(
          fmt::format("{} thin handle(s) were closed, {:.2f} ml filled and {:.2f} ml taken away, the "
                      "first at ({:.0f}, "
                      "{:.0f}, {:.0f}) mm; the labels stay as they are",
                      handles.genus_before - handles.genus, handles.filled_mm3 / 1000, handles.removed_mm3 / 1000,
                      at.x(), at.y(), at.z()));
    }
    if (handles.genus > 0)
      run.warn(fmt::format(
          "the {} has {} handle(s), tunnels or rings thicker than 4 voxels and 8 mm; if it should have none, "
          "look for them in the labels",
          body_word(), handles.genus));
  }

  Outcome judge(Run& run, const Reconstruction& made) const {
    if (made.breast.dropped_pieces > 0)
      run.warn(fmt::format("{} loose bits of tissue were left out, {:.2f} ml together", made.breast.dropped_pieces,
                           made.breast.dropped_volume_mm3 / 1000));
    if (made.breast.perforator_volume_mm3 > 0)
      run.warn(fmt::format("{:.2f} ml of thin tissue inside the {} were counted as {}",
                           made.breast.perforator_volume_mm3 / 1000, support_word(), support_word()));
    warn_of_handles(run, made.breast.handles);
    if (made.breast.report.cavities > 0)
      run.warn(fmt::format("the {} encloses {} cavities of air, {} or excluded tissue", body_word(),
                           made.breast.report.cavities, support_word()));
    for (const OrganSurface& organ : made.organs)
      if (std::abs(organ.volume_error()) > good_volume_error)
        run.warn(
            fmt::format("{}: parts thinner than a voxel cost {:.1f} % of its volume in the surface; volumes of the "
                        "mesh come from the labels and are not touched",
                        organ.name, -100 * organ.volume_error()));
    if (std::abs(made.breast.volume_error()) <= good_volume_error) return Outcome::done;
    run.warn(
        fmt::format("the {}'s volume differs by {:+.2f} % from its voxels (aimed at: within 1 %); give a smaller "
                    "--smooth-mm",
                    body_word(), 100 * made.breast.volume_error()));
    return Outcome::target_not_met;
  }

  std::string labels_;
  bool object_ = false;  // the labels are of a body that is no breast
  std::optional<double> smooth_mm_, rim_mm_;
  std::vector<std::string> cut_;
  reconstruction::ReconstructOptions options_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::ReconstructTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
