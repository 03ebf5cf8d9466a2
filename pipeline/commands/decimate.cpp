// SPDX-License-Identifier: AGPL-3.0-or-later
#include "meshing/decimate.h"

#include <fmt/format.h>

#include "pipeline/tool.h"
#include "reconstruction/surface_check.h"
#include "reconstruction/surface_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using meshing::DecimateResult;
using reconstruction::region_names;

class DecimateTool : public Tool {
 public:
  std::string name() const override { return "supine-decimate"; }

  std::string summary() const override {
    return "Decimates a closed surface to well-shaped triangles, never further from it than a bound; region borders "
           "stay chains of edges.\n"
           "Writes coarse.vtp (default: beside the input). Exit code 1 when more triangles were needed than asked "
           "for.\n\n"
           "Examples:\n"
           "  supine-decimate breast.vtp --triangles 3000 --max-distance-mm 1\n"
           "  supine-decimate breast.vtp --triangles 8000 --max-distance-mm 0.5 -o fine.vtp\n";
  }

  void declare(CLI::App& app) override {
    app.add_option("surface", surface_, "closed surface (.vtp .ply .stl .obj)")->required();
    app.add_option("--triangles", options_.target_triangles, "at most so many triangles, >= 100")
        ->capture_default_str();
    app.add_option("--max-distance-mm", options_.max_distance_mm,
                   "bound on the distance to the input, either way, mm, > 0")
        ->capture_default_str();
  }

  Outcome run(Run& run) override {
    run.stage("read");
    const reconstruction::Surface in = reconstruction::read_surface(run.input(surface_));
    run.stage("decimate");
    run.progress("decimating");
    const DecimateResult result = meshing::decimate(in, options_);
    run.stage("write");
    const fs::path target = output.empty() ? fs::path(surface_).parent_path() / "coarse.vtp" : output;
    reconstruction::write_surface(result.surface, run.output(target));
    fill(run.figures(target), in, result);
    run.say(fmt::format("{} -> {} triangles, edges {:.2f} mm, smallest angle {:.1f} degrees", in.triangles.rows(),
                        result.surface.triangles.rows(), result.edge_mm, result.smallest_angle_deg));
    run.say(fmt::format("largest distance {:.3f} mm, volume {:+.4f} %, region borders within {:.2f} mm",
                        result.distance_mm, 100 * result.volume_change, result.border_mm));
    run.say(target.string());
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
    json["distance_mm"] = result.distance_mm;
    json["distance_to_input_mm"] = result.to_input_mm;
    json["distance_from_input_mm"] = result.from_input_mm;
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

  std::string surface_;
  meshing::DecimateOptions options_;
};

}  // namespace
}  // namespace supine::pipeline

int main(int argc, char** argv) {
  supine::pipeline::DecimateTool tool;
  return supine::pipeline::tool_main(tool, argc, argv);
}
