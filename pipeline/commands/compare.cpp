// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/compare.h"

#include <fmt/format.h>

#include <cmath>
#include <list>
#include <optional>

#include "calibration/comparison_files.h"
#include "calibration/measured_landmarks.h"
#include "calibration/scan_motion.h"
#include "common/error.h"
#include "meshing/anatomy.h"
#include "meshing/mesh_io.h"
#include "pipeline/case/case.h"
#include "pipeline/case/model_file.h"
#include "pipeline/case/scan_readings.h"
#include "pipeline/case/shape_gravity.h"
#include "pipeline/picture/picture.h"
#include "pipeline/results/targets_report.h"
#include "pipeline/tool/lineage.h"
#include "pipeline/tool/tool.h"
#include "reconstruction/surface_io.h"
#include "simulation/catalogue.h"
#include "simulation/model_fields.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using calibration::Comparison;
using Json = nlohmann::ordered_json;

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

std::string text(double value) { return std::isfinite(value) ? fmt::format("{:.2f}", value) : "-"; }

struct Inputs {
  Case measured;
  Pose pose;
  meshing::PoseMesh predicted;
  reconstruction::Surface surface;
  simulation::Model model;  ///< without effects unless --model names one
};

class CompareTool : public Tool {
 public:
  std::string name() const override { return "supine-compare"; }

  std::string summary() const override {
    return "Compares the shape of a pose with the surface that was measured in it, in both directions, with signs: "
           "distance_mm > 0 where the scan lies outside the model.\n"
           "Writes comparison.vtp (the model's skin), scan.vtp and comparison.json; for a pose other than supine "
           "comparison_POSE.vtp and scan_POSE.vtp. -o names their folder (default: that of the pose file).\n\n"
           "Examples:\n"
           "  supine-compare mycase mycase/out/supine.vtu\n"
           "  supine-compare mycase mycase/out/tilt45.vtu -o mycase/out --force\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("case", case_folder_, "case folder, holds case.toml")->required();
    app.add_option("pose_file", pose_file_, "shape of the model in the pose, as supine-simulate writes it (.vtu)")
        ->required();
    app.add_option("--model", model_file_,
                   "model that says where the scan lies (effect misregistration): the scan and its landmarks are moved "
                   "there first");
    app.add_option("--expected", expected_file_,
                   "POSE_landmarks.json of supine-targets: the landmarks' errors are held against what they should be");
    app.add_option("--pose", pose_name_, "which measurement of the case (default: the name of the pose file)");
    declare_png(app, png_, "the model's skin coloured by its distance to the scan");
  }

  Outcome run(Run& run) override {
    if (output.extension() == ".vtp") {
      throw InputError(
          fmt::format("-o {}: names the folder of the two output files; leave the file name out", output.string()));
    }
    run.stage("read");
    const Inputs inputs = read(run);
    announce_png(run, png_, target(inputs.pose, "comparison"));
    const std::string scan_name = inputs.pose.surface->string();
    run.stage("check");
    const calibration::ModelSkin model(inputs.predicted.mesh, inputs.predicted.positions);
    const calibration::ScanMotion motion = scan_motion(inputs, model, scan_name);
    reconstruction::Surface surface = inputs.surface;
    surface.points = motion.corrected(surface.points);
    const calibration::Scan scan(surface, model, scan_name);
    check_readings(run, inputs, scan, model);
    const auto landmarks = compare_landmarks(inputs, motion, run);
    const auto agreement = compare_to_expected(inputs, run);
    run.stage("anatomy");
    const calibration::SkinAreas areas = find_areas(inputs);
    run.stage("compare");
    const Comparison comparison = calibration::compare(model, scan, areas, {}, inputs.pose.noise_mm.value_or(0));
    run.stage("write");
    const fs::path skin_file = target(inputs.pose, "comparison"), scan_file = target(inputs.pose, "scan");
    calibration::write_comparison(comparison, model, areas, run.output(skin_file));
    calibration::write_scan(comparison, scan, run.output(scan_file));
    fill(run.figures(skin_file), inputs.pose, comparison, landmarks);
    if (agreement) add_agreement(run.figures(skin_file), *agreement);
    run.figures(scan_file) = {{"pose", inputs.pose.name},
                              {"scan_points", comparison.used.size()},
                              {"scan_points_used", comparison.scan_points_used},
                              {"scan_triangles", scan.distance().triangles().rows()}};
    if (!png_.empty())
      draw_distances(run.output(skin_file),
                     fmt::format("{}, {}: RMS {:.2f} mm, mean {:.2f} mm", inputs.measured.name, inputs.pose.name,
                                 comparison.scan.rms_mm, comparison.scan.mae_mm),
                     inputs.measured.side, run.output(png_), run.output(scan_file));
    say(run, inputs.pose, comparison, landmarks);
    if (agreement) say_agreement(run, *agreement);
    doubt(run, inputs, comparison);
    return Outcome::done;
  }

 private:
  Inputs read(Run& run) const {
    run.input(case_folder_ / "case.toml");
    Inputs inputs{read_case(case_folder_), {}, {}, {}, {}};
    inputs.pose = inputs.measured.pose(pose_name_.empty() ? pose_file_.stem().string() : pose_name_);
    if (!inputs.pose.surface) {
      throw InputError(
          fmt::format("{}: pose '{}' has no surface; nothing to compare with. Name the measured surface as `surface` "
                      "in [pose.{}]",
                      (case_folder_ / "case.toml").string(), inputs.pose.name, inputs.pose.name));
    }
    inputs.predicted = meshing::read_pose(run.input(pose_file_), pose_name_.empty() ? inputs.pose.name : "");
    check_gravity(pose_file_, inputs.pose);
    inputs.surface = reconstruction::read_surface(run.input(*inputs.pose.surface), inputs.measured.frame);
    if (!model_file_.empty()) {
      inputs.model = read_model(run.input(model_file_));
      if (made_from_another(pose_file_, model_file_))
        run.warn(fmt::format("{} was computed with another {} than {}: simulate again with that", pose_file_.string(),
                             model_file_.filename().string(), model_file_.string()));
    }
    return inputs;
  }

  /// Against the shapes of the other poses as well, where they stand beside this one.
  void check_readings(Run& run, const Inputs& inputs, const calibration::Scan& scan,
                      const calibration::ModelSkin& skin) const {
    std::list<meshing::PoseMesh> shapes;
    std::vector<PosePoints> others;
    for (const Pose& other : inputs.measured.poses) {
      const fs::path file = pose_file_.parent_path() / (other.name + ".vtu");
      if (other.name == inputs.pose.name || other.name == "prone" || !fs::exists(file)) continue;
      shapes.push_back(meshing::read_pose(file, other.name));
      others.push_back({other.name, &shapes.back().positions});
    }
    check_scan(run, inputs.measured, inputs.pose, scan, inputs.predicted.mesh, skin, inputs.predicted.positions,
               others);
  }

  calibration::SkinAreas find_areas(const Inputs& inputs) const {
    const auto anatomy =
        meshing::compute_anatomy(inputs.predicted.mesh, inputs.measured.side, inputs.measured.imaged_pose);
    return calibration::anatomical_areas(inputs.predicted.mesh, anatomy);
  }

  std::vector<calibration::LandmarkError> compare_landmarks(const Inputs& inputs, const calibration::ScanMotion& motion,
                                                            Run& run) const {
    if (!inputs.pose.landmarks) return {};
    const fs::path predicted = pose_file_.parent_path() / (pose_file_.stem().string() + "_landmarks.csv");
    if (!fs::exists(predicted)) {
      run.warn(fmt::format("no landmark table: {} is not there (supine-simulate writes it beside the pose)",
                           predicted.string()));
      return {};
    }
    Landmarks measured = read_landmarks(run.input(*inputs.pose.landmarks), inputs.measured.frame);
    measured.points = motion.corrected(measured.points);
    const Landmarks carried = read_landmarks(run.input(predicted));
    if (inputs.measured.prone_landmarks && made_from_another(predicted, *inputs.measured.prone_landmarks))
      run.warn(fmt::format("{} was made from another {}: simulate again", predicted.string(),
                           inputs.measured.prone_landmarks->filename().string()));
    try {
      const auto errors = calibration::compare_landmarks(carried, measured);
      doubt_landmarks(run, *inputs.pose.landmarks, carried, measured);
      return errors;
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", inputs.pose.landmarks->string(), error.what()));
    }
  }

  /// What calibration would refuse or doubt is told, and no more: a model that is far off may be what is to be seen.
  static void doubt_landmarks(Run& run, const fs::path& file, const Landmarks& carried, const Landmarks& measured) {
    const auto pairs = calibration::pair_landmarks(carried, measured);
    std::string doubt;
    try {
      calibration::check_landmarks(pairs, pairs.imaged);
      doubt = calibration::doubt_of_scale(pairs, pairs.imaged);
    } catch (const InputError& refused) {
      doubt = refused.what();
    }
    if (!doubt.empty()) run.warn(fmt::format("{}: {}", file.string(), doubt));
  }

  /// With what else is known of the pose, where --expected names it.
  std::optional<calibration::LandmarkAgreement> compare_to_expected(const Inputs& inputs, Run& run) const {
    if (expected_file_.empty()) return std::nullopt;
    if (!inputs.pose.landmarks)
      throw InputError(
          fmt::format("--expected {}: pose '{}' has no measured landmarks to hold against it; name them as "
                      "`landmarks` in [pose.{}], or leave the option out",
                      expected_file_.string(), inputs.pose.name, inputs.pose.name));
    const auto expected = read_expected_landmarks(run.input(expected_file_), inputs.pose.name);
    try {
      return calibration::compare_to_expected(read_landmarks(*inputs.pose.landmarks, inputs.measured.frame), expected);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", expected_file_.string(), error.what()));
    }
  }

  /// Where the model says that the scan lies. Its centroid is that of the points a Scan keeps, as in calibration.
  static calibration::ScanMotion scan_motion(const Inputs& inputs, const calibration::ModelSkin& model,
                                             const std::string& scan_name) {
    const bool says = std::any_of(inputs.model.effects.begin(), inputs.model.effects.end(),
                                  [](const auto& effect) { return simulation::traits_of(effect.name).moves_scan; });
    Eigen::VectorXd motion = Eigen::VectorXd::Zero(6);
    if (says) {
      const auto anatomy =
          meshing::compute_anatomy(inputs.predicted.mesh, inputs.measured.side, inputs.measured.imaged_pose);
      const auto layout = simulation::make_layout(inputs.predicted.mesh, anatomy);
      const simulation::Scene scene{inputs.predicted.mesh, anatomy, layout, inputs.pose.name};
      motion = simulation::values_of(simulation::make_fields(inputs.model, scene, inputs.pose.gravity)).scan_motion;
    }
    if (motion.isZero(0)) return {motion, inputs.surface.points};
    return {motion, calibration::Scan(inputs.surface, model, scan_name).points()};
  }

  fs::path target(const Pose& pose, const std::string& stem) const {
    const fs::path folder = output.empty() ? pose_file_.parent_path() : output;
    return folder / (pose.name == "supine" ? stem + ".vtp" : stem + "_" + pose.name + ".vtp");
  }

  static void fill(Json& figures, const Pose& pose, const Comparison& comparison,
                   const std::vector<calibration::LandmarkError>& landmarks) {
    figures["pose"] = pose.name;
    figures["mae_study_mm"] = number_or_null(comparison.mae_study_mm);
    figures["mae_mm"] = comparison.scan.mae_mm;
    figures["rms_mm"] = comparison.scan.rms_mm;
    figures["median_mm"] = comparison.scan.median_mm;
    figures["p95_mm"] = comparison.scan.p95_mm;
    figures["hausdorff_mm"] = comparison.scan.hausdorff_mm;
    figures["mean_signed_mm"] = comparison.scan.mean_signed_mm;
    figures["covered_fraction"] = number_or_null(comparison.covered_fraction);
    figures["noise_mm"] = pose.noise_mm ? Json(*pose.noise_mm) : Json(nullptr);
    figures["model_points"] = comparison.model_to_scan.covered.size();
    figures["scan_points"] = comparison.used.size();
    figures["scan_points_used"] = comparison.scan_points_used;
    figures["left_out_points"] = comparison.outliers.points.size();
    figures["rms_kept_mm"] = comparison.rms_kept_mm;
    figures["areas"] = Json::array();
    for (const auto& area : comparison.areas) {
      figures["areas"].push_back({{"name", area.name},
                                  {"area_cm2", area.area_cm2},
                                  {"mae_mm", number_or_null(area.mae_mm)},
                                  {"mean_signed_mm", number_or_null(area.mean_signed_mm)},
                                  {"scan_points", area.scan_points}});
    }
    figures["landmarks"] = Json::array();
    for (const auto& landmark : landmarks) {
      figures["landmarks"].push_back({{"name", landmark.name}, {"error_mm", landmark.error_mm}});
    }
  }

  static void add_agreement(Json& figures, const calibration::LandmarkAgreement& agreement) {
    for (Json& row : figures["landmarks"])
      for (std::size_t i = 0; i < agreement.names.size(); ++i)
        if (row["name"] == agreement.names[i]) {
          row["off_expected_mm"] = agreement.off_mm[static_cast<Eigen::Index>(i)];
          row["expected_mm"] = agreement.expected_mm[static_cast<Eigen::Index>(i)];
        }
    figures["landmark_test"] = {
        {"chi_squared", agreement.chi_squared}, {"degrees", agreement.degrees}, {"p_value", agreement.p_value}};
  }

  static void say_agreement(const Run& run, const calibration::LandmarkAgreement& agreement) {
    run.say(fmt::format("  {:<34}{:>8}{:>10}", "landmark, from where it should be", "mm", "expected"));
    for (std::size_t i = 0; i < agreement.names.size(); ++i)
      run.say(fmt::format("  {:<34}{:>8.2f}{:>10.2f}", agreement.names[i],
                          agreement.off_mm[static_cast<Eigen::Index>(i)],
                          agreement.expected_mm[static_cast<Eigen::Index>(i)]));
    run.say(fmt::format("  all together: p = {:.3g} (chi squared {:.1f} with {} degrees)", agreement.p_value,
                        agreement.chi_squared, agreement.degrees));
  }

  static bool covers_area(const Comparison& comparison) { return std::isfinite(comparison.covered_fraction); }

  // A scan that covers little of the skin or lies far from it is more likely somebody else's than a finding.
  static void doubt(Run& run, const Inputs& inputs, const Comparison& comparison) {
    constexpr double low_coverage = 0.5, far_mm = 8;
    const bool little = covers_area(comparison) && comparison.covered_fraction < low_coverage;
    if (!little && comparison.scan.median_mm <= far_mm) return;
    const std::string covers = little ? fmt::format("it covers {:.0f} % of the skin (usual: over {:.0f} %), ",
                                                    100 * comparison.covered_fraction, 100 * low_coverage)
                                      : "";
    run.warn(
        fmt::format("{} hardly fits this body: {}half of its points lie more than {:.1f} mm off. {}, a scan that "
                    "is not registered, or a model far from the truth?",
                    inputs.pose.surface->string(), covers, comparison.scan.median_mm,
                    inputs.measured.is_object() ? "Another object" : "Another patient or side"));
  }

  static void say(const Run& run, const Pose& pose, const Comparison& comparison,
                  const std::vector<calibration::LandmarkError>& landmarks) {
    const auto row = [&run](const char* what, double value) {
      run.say(fmt::format("  {:<34}{:>8}", what, text(value)));
    };
    run.say(fmt::format("{}: model against {}", pose.name, pose.surface->filename().string()));
    run.say(fmt::format("  {:<34}{:>8}", "", "mm"));
    row("MAE, model to scan (study)", comparison.mae_study_mm);
    row("MAE, scan to model", comparison.scan.mae_mm);
    row("RMS", comparison.scan.rms_mm);
    row("median", comparison.scan.median_mm);
    row("95th percentile", comparison.scan.p95_mm);
    row("maximum", comparison.scan.hausdorff_mm);
    row("signed mean (> 0: scan outside)", comparison.scan.mean_signed_mm);
    if (pose.noise_mm) row("scanner noise, 1 sigma", *pose.noise_mm);
    run.say(fmt::format("  {}; {} of {} scan points used",
                        covers_area(comparison)
                            ? fmt::format("{:.0f} % of the skin covered", 100 * comparison.covered_fraction)
                            : "a contour, which covers no area",
                        comparison.scan_points_used, comparison.used.size()));
    say_areas(run, comparison);
    if (!landmarks.empty()) run.say(fmt::format("  {:<34}{:>8}", "landmark", "mm"));
    for (const auto& landmark : landmarks) row(landmark.name.c_str(), landmark.error_mm);
  }

  static void say_areas(const Run& run, const Comparison& comparison) {
    if (comparison.areas.empty()) return;
    run.say(fmt::format("  {:<18}{:>8}{:>8}{:>8}", "area", "cm2", "MAE", "signed"));
    for (const auto& area : comparison.areas) {
      run.say(fmt::format("  {:<18}{:>8.1f}{:>8}{:>8}", area.name, area.area_cm2, text(area.mae_mm),
                          text(area.mean_signed_mm)));
    }
  }

  fs::path case_folder_, pose_file_, model_file_, expected_file_, png_;
  std::string pose_name_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::CompareTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
