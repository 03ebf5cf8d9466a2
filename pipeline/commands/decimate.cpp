// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate/decimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

#include "common/error.h"
#include "pipeline/tool/tool.h"
#include "reconstruction/surface_check.h"
#include "reconstruction/surface_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using meshing::DecimateResult;
using reconstruction::region_names;

constexpr double looser_bent[] = {2, 3};  // times the bound, of flat triangles that will be bent (docs/meshing.md)

class DecimateTool : public Tool {
 public:
  std::string name() const override { return "supine-decimate"; }

  std::string summary() const override {
    return "Decimates a closed surface to field-aligned quads, each written as two triangles, never further from it "
           "than "
           "a bound; region borders stay chains of edges.\n"
           "Writes coarse.vtp (default: beside the input). Exit code 1 when more triangles were needed than asked "
           "for.\n\n"
           "Examples:\n"
           "  supine-decimate breast.vtp --triangles 3000 --max-distance-mm 1\n"
           "  supine-decimate breast.vtp --faces 1500 --finer 12,-80,5,15,0.5\n"
           "  supine-decimate cast.vtp --sharp-deg 40 --edge-mm 8\n"
           "  supine-decimate breast.vtp --method triangles --triangles 8000 --max-distance-mm 0.5 -o fine.vtp\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("surface", surface_, "closed surface (.vtp .ply .stl .obj)")->required();
    app.add_option(
        "--triangles", triangles_,
        "at most so many triangles, >= 100; default: 2500 (--order 2: 700), and of a surface of more than 900 cm2 as "
        "many more as it is larger, up to three times");
    app.add_option("--order", order_,
                   "of the tetrahedra that will fill it, 1 linear or 2 quadratic: which number of triangles is the "
                   "default")
        ->check(CLI::Range(1, 2))
        ->capture_default_str();
    app.add_option(
        "--max-distance-mm", max_distance_mm_,
        "bound on the distance to the input, either way, mm, > 0; default: 1, and of a surface of more than "
        "900 cm2 as much more as it is larger, up to 3; --order 2: twice that where it "
        "would take half as many triangles again as are asked for, three times where that takes twice as many");
    app.add_option("--faces", options_.target_faces, "instead: about so many quads and lone triangles, >= 50");
    app.add_option("--edge-mm", options_.edge_mm, "instead: edge length, mm, > 0");
    app.add_option("--method", method_, "quads, or triangles of one size")
        ->check(CLI::IsMember({"quads", "triangles"}))
        ->capture_default_str();
    app.add_option("--finer", finer_,
                   "X,Y,Z,RADIUS,FACTOR: edges FACTOR times as long (0.05 to 1) within RADIUS mm of a place, growing "
                   "gently outside; may be repeated");
    app.add_option("--sharp-deg", options_.sharp_deg,
                   "keep edges at which faces meet at more than this, degrees (for CAD bodies, with triangles of one "
                   "size, without --edge-mm a twentieth of the body's diagonal); 0 = none");
    app.add_flag("--open", options_.open, "accept a surface with open borders and keep them");
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const reconstruction::Surface in = reconstruction::read_surface(run.input(surface_));
    run.stage("decimate");
    run.progress("decimating");
    options_.method = method_ == "quads" ? meshing::DecimateMethod::quads : meshing::DecimateMethod::triangles;
    if (options_.sharp_deg > 0 && options_.edge_mm == 0)
      options_.edge_mm = (in.points.colwise().maxCoeff() - in.points.colwise().minCoeff()).norm() / 20;
    follow_body(in, run);
    options_.progress = [&run](const std::string& line) { run.progress(line); };
    if (!finer_.empty()) options_.relative_size = relative_size(in);
    const double first_mm = options_.max_distance_mm;
    std::vector<double> looser_mm;
    if (order_ == 2 && !max_distance_mm_)
      for (const double times : looser_bent) looser_mm.push_back(times * first_mm);
    const DecimateResult result = meshing::decimate_within(in, looser_mm, options_);
    if (options_.max_distance_mm > first_mm)
      run.say(fmt::format(
          "within {:.3g} mm many more triangles are needed; within {:.3g} mm, since the cells are bent onto the "
          "fine surface",
          first_mm, options_.max_distance_mm));
    run.stage("write");
    const fs::path target = output.empty() ? fs::path(surface_).parent_path() / "coarse.vtp" : output;
    reconstruction::write_surface(result.surface, run.output(target), {{"quad", result.quad}});
    fill(run.figures(target), in, result);
    run.say(fmt::format("{} -> {} triangles, edges {:.2f} mm, smallest angle {:.1f} degrees", in.triangles.rows(),
                        result.surface.triangles.rows(), result.edge_mm, result.smallest_angle_deg));
    run.say(fmt::format("{} quads, {} triangles alone ({:.1f} % quads)", result.quads, result.alone,
                        100.0 * result.quads / (result.quads + result.alone)));
    run.say(fmt::format("largest distance {:.3f} mm, volume {:+.4f} %, region borders within {:.2f} mm",
                        result.distance_mm, 100 * result.volume_change, result.border_mm));
    run.say(target.string());
    if (!result.fallback.empty()) run.warn(result.fallback);
    if (result.reached_target) return Outcome::done;
    run.warn("target not reached because " + result.reason);
    return Outcome::target_not_met;
  }

 private:
  void fill(nlohmann::ordered_json& json, const reconstruction::Surface& in, const DecimateResult& result) const {
    const auto report = reconstruction::check_surface(result.surface);
    json["triangles"] = report.triangles;
    json["input_triangles"] = in.triangles.rows();
    json["target_triangles"] = options_.target_triangles;
    json["reached_target"] = result.reached_target;
    if (!result.reason.empty()) json["reason"] = result.reason;
    if (!result.fallback.empty()) json["fallback"] = result.fallback;
    json["quads"] = result.quads;
    json["triangles_alone"] = result.alone;
    json["quad_deviation_deg"] = result.mean_deviation_deg;
    json["distance_mm"] = result.distance_mm;
    json["distance_to_input_mm"] = result.to_input_mm;
    json["distance_from_input_mm"] = result.from_input_mm;
    json["mean_distance_to_input_mm"] = result.mean_to_input_mm;
    json["mean_distance_from_input_mm"] = result.mean_from_input_mm;
    json["max_distance_mm"] = options_.max_distance_mm;
    json["border_distance_mm"] = result.border_mm;
    json["volume_ml"] = report.volume_mm3 / 1000;
    json["volume_change"] = result.volume_change;
    json["edge_mm"] = result.edge_mm;
    json["smallest_angle_deg"] = result.smallest_angle_deg;
    for (std::size_t r = 0; r < region_names.size(); ++r)
      if (report.region_area_mm2[r] > 0)
        json["area_cm2"][std::string(region_names[r])] = report.region_area_mm2[r] / 100;
    json["components"] = report.components - report.cavities;
    json["euler"] = report.euler;
    json["closed"] = report.closed();
    json["manifold"] = report.manifold();
    json["self_intersections"] = reconstruction::self_intersections(result.surface).size();
  }

  /// What is not asked for follows the surface: a whole chest needs more triangles than a breast, and is less even.
  void follow_body(const reconstruction::Surface& in, const Run& run) {
    constexpr double one_breast_cm2 = 900, most = 3;
    // On computed breasts 700 quadratic triangles leave half of the error of 2500 linear ones, docs/meshing.md.
    const double of_one_breast = order_ == 2 ? 700 : 2500;
    const double area_cm2 = reconstruction::check_surface(in).area_mm2 / 100;
    const double larger = std::clamp(area_cm2 / one_breast_cm2, 1.0, most);
    options_.target_triangles = triangles_.value_or(static_cast<int>(of_one_breast * larger));
    options_.max_distance_mm = max_distance_mm_.value_or(larger);
    if (larger > 1 && (!triangles_ || !max_distance_mm_))
      run.say(fmt::format("{:.0f} cm2 of surface: at most {} triangles within {:.2f} mm", area_cm2,
                          options_.target_triangles, options_.max_distance_mm));
  }

  Eigen::VectorXd relative_size(const reconstruction::Surface& in) const {
    Eigen::VectorXd sizes = Eigen::VectorXd::Ones(in.points.rows());
    for (const std::string& text : finer_) {
      const std::vector<double> values = numbers(text);
      const Eigen::RowVector3d centre(values[0], values[1], values[2]);
      const double nearest_mm = (in.points.rowwise() - centre).rowwise().norm().minCoeff();
      if (nearest_mm > 2 * values[3])
        throw InputError(
            fmt::format("--finer {}: the surface lies {:.0f} mm from there, and edges change within {:g} mm; "
                        "are these its millimetres?",
                        text, nearest_mm, 2 * values[3]));
      for (Eigen::Index p = 0; p < sizes.size(); ++p) {
        // Twice the radius away the common size is reached again.
        const double away = ((in.points.row(p) - centre).norm() - values[3]) / values[3];
        sizes(p) = std::min(sizes(p), values[4] + (1 - values[4]) * std::clamp(away, 0.0, 1.0));
      }
    }
    return sizes;
  }

  static std::vector<double> numbers(const std::string& text) {
    std::vector<double> values;
    const char *at = text.data(), *end = at + text.size();
    while (at < end) {
      double value = 0;
      const auto [stop, error] = std::from_chars(at, end, value);
      if (error != std::errc() || (stop < end && *stop != ',')) break;
      values.push_back(value);
      at = stop + 1;
    }
    if (values.size() != 5 || at < end || !(values[3] > 0) || !(values[4] >= 0.05 && values[4] <= 1))
      throw InputError(
          fmt::format("--finer {}: five numbers X,Y,Z,RADIUS,FACTOR are needed, mm, with RADIUS > 0 and FACTOR in "
                      "[0.05, 1]",
                      text));
    return values;
  }

  std::string surface_, method_ = "quads";
  std::optional<int> triangles_;
  int order_ = 1;
  std::optional<double> max_distance_mm_;
  std::vector<std::string> finer_;
  meshing::DecimateOptions options_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::DecimateTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
