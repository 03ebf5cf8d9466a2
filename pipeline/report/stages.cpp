// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/stages.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "pipeline/case/shape_gravity.h"
#include "pipeline/tool/hash.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct StageRow {
  const char* name;
  std::initializer_list<const char*> files;  // any of these says that it was done
  bool needs_scan;
  const char* target;  // of make; what there is no target for is a command
  const char* shows;
};

const StageRow stage_rows[] = {
    {"segment", {"labels.json"}, false, "segment", "tissue volumes, overlays"},
    {"reconstruct", {"breast.json"}, false, "reconstruct", "surfaces"},
    {"decimate", {"coarse.json"}, false, "decimate", "coarse surface and how far it lies from the fine one"},
    {"mesh", {"mesh.json"}, false, "mesh", "mesh, regions, quality"},
    {"simulate", {"supine.json"}, false, "simulate", "prone, undeformed and supine shape, round trip"},
    {"compare", {"comparison.json"}, true, "compare", "distance to the measured surface, areas, landmarks"},
    {"calibrate", {"calibration.json"}, true, "calibrate", "fitted parameters, intervals, history"},
    {"sensitivity", {"sensitivity.json"}, true, "", "how the error depends on the parameters"},
    {"diagnose", {"diagnosis.json", "ladder/diagnosis.json"}, true, "diagnose", "what is missing, candidates, budget"},
    {"ladder", {"ladder/ladder.json", "ladder.json"}, true, "ladder", "the error falling effect by effect"},
};

/// Options that stand without their name on the command line, in order.
const std::map<std::string, std::vector<std::string>> positionals = {
    {"supine-segment", {"case"}},           {"supine-reconstruct", {"labels"}},
    {"supine-decimate", {"surface"}},       {"supine-tetrahedralise", {"surface", "muscle", "labels"}},
    {"supine-simulate", {"case", "mesh"}},  {"supine-compare", {"case", "pose_file"}},
    {"supine-calibrate", {"case", "mesh"}}, {"supine-sensitivity", {"case", "mesh"}},
    {"supine-diagnose", {"case", "mesh"}},
};

std::string plain(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

/// Of which folder a file is that goes by this name in the provenance of @p tool.
bool lies_in_case(const std::string& file, const std::string& tool) {
  return file == "model.toml" && tool != "supine-diagnose";
}

/// The output option of a tool whose sidecar lies in @p folder.
std::string output_of(const std::string& tool, const std::string& folder) {
  static const std::map<std::string, std::string> files = {
      {"supine-segment", "/labels.vti"}, {"supine-decimate", "/coarse.vtp"}, {"supine-tetrahedralise", "/mesh.vtu"}};
  const auto file = files.find(tool);
  return " -o " + folder + (file == files.end() ? "" : file->second) + " --force";
}

/// The command line that wrote a sidecar of @p folder, from its provenance.
/// @param surface  the image is a surface: what is read of it is the case, in place of labels
std::string command_of(const Json& figures, const Places& places, const std::string& folder, bool surface) {
  const Json made = figures.value("provenance", Json::object());
  const std::string tool = made.value("tool", "");
  const auto row = positionals.find(tool);
  if (row == positionals.end()) return {};
  const Json options = made.value("options", Json::object());
  const auto placed = [&](const std::string& file) {
    return (lies_in_case(file, tool) ? places.case_name : places.out_name) + "/" + file;
  };
  std::string line = tool;
  for (const std::string& name : row->second)
    line += name == "case" ? " " + places.case_name : options.contains(name) ? " " + placed(plain(options[name])) : "";
  if (surface && tool == "supine-reconstruct") line += " " + places.case_name;
  if (surface && tool == "supine-tetrahedralise") line += " --case " + places.case_name;
  for (const auto& [name, value] : options.items()) {
    const bool positional = std::find(row->second.begin(), row->second.end(), name) != row->second.end();
    if (positional || value == false || value.empty() || value == "" || value == "[]") continue;
    const std::string text = plain(value);
    const bool is_file = value.is_string() && text.find('.') != std::string::npos;
    line += value == true ? " --" + name : fmt::format(" --{} {}", name, is_file ? placed(text) : text);
  }
  return line + output_of(tool, folder);
}

/// Scans and landmarks that the case names.
std::vector<fs::path> measurements(const Case& measured) {
  std::vector<fs::path> files;
  for (const Pose& pose : measured.poses) {
    if (pose.surface) files.push_back(*pose.surface);
    if (pose.landmarks) files.push_back(*pose.landmarks);
  }
  if (measured.prone_landmarks) files.push_back(*measured.prone_landmarks);
  return files;
}

/// Where a file may lie that goes by this name in the provenance of @p tool: in folders of our own, or as a measurement
/// of the case (landmarks that were measured may be called as those that are predicted).
std::vector<fs::path> places_of(const std::string& name, const std::string& tool, const std::string& sidecar,
                                const Case& measured, const Places& places) {
  std::vector<fs::path> found;
  // A diagnosis reads two of this name: the calibrated one, and the case's own for its priors.
  if (name == "model.toml")
    found = {places.case_folder / name, (lies_in_case(name, tool) ? places.case_folder : places.out) / name};
  else if (const std::string end = fs::path(name).extension().string();
           end == ".vtu" || end == ".vtp" || end == ".vti" || end == ".csv") {
    const fs::path beside = places.out / fs::path(sidecar).parent_path() / name;
    found = {fs::exists(beside) ? beside : places.out / name};
  }
  for (const fs::path& file : measurements(measured))
    if (file.filename() == name) found.push_back(file);
  return found;
}

/// Names a file that is another one now than when @p figures were made of it.
std::string stale(const std::string& sidecar, const Json& figures, const Case& measured, const Places& places) {
  const Json made = figures.value("provenance", Json::object());
  for (const Json& input : made.value("inputs", Json::array())) {
    const std::string name = input.value("file", ""), hash = input.value("sha256", "");
    auto files = places_of(name, made.value("tool", ""), sidecar, measured, places);
    std::erase_if(files, [](const fs::path& file) { return !fs::exists(file); });
    const auto same = [&hash](const fs::path& file) { return sha256(file) == hash; };
    if (!files.empty() && std::none_of(files.begin(), files.end(), same))
      return fmt::format("{} was made from another {}", sidecar, name);
  }
  for (const Pose& pose : measured.poses)
    if (sidecar == pose.name + ".json" && is_of_other_gravity(figures, pose))
      return fmt::format("{} was computed with another gravity than [pose.{}] of case.toml has", sidecar, pose.name);
  return {};
}

/// The file of the pose that is predicted, where a row names that of supine.
std::string of_predicted(const Case& measured, const std::string& file) {
  const std::string& pose = measured.predicted().name;
  if (file == "supine.json") return pose + ".json";
  return file == "comparison.json" ? Case::file_of("comparison", pose, ".json") : file;
}

bool has_scan(const Case& measured) {
  return std::any_of(measured.poses.begin(), measured.poses.end(),
                     [](const Pose& pose) { return pose.surface.has_value(); });
}

}  // namespace

std::string Places::make(const std::string& target) const {
  const bool usual = out_name == case_name + "/out";
  return fmt::format("make CASE={}{} {}", case_name, usual ? "" : " OUT=" + out_name, target);
}

std::vector<Stage> stages_of(const Case& measured, const Collected& collected, const Places& places) {
  std::vector<Stage> stages;
  for (const StageRow& row : stage_rows) {
    Stage stage{row.name, row.shows, {}, {}, {}, {}};
    if (stage.name == "segment" && measured.image_kind == "surface") continue;
    if (stage.name == "simulate" && measured.predicted().name != "supine")
      stage.shows = "undeformed shape and shape in every pose, round trip";
    for (const char* file : row.files) {
      const std::string own = of_predicted(measured, file);
      if (stage.file.empty() && !collected.find(own).is_null()) stage.file = own;
    }
    if (!stage.file.empty()) {
      const Json& figures = collected.find(stage.file);
      const fs::path folder = fs::path(places.out_name) / fs::path(stage.file).parent_path();
      stage.command =
          command_of(figures, places, (folder / "").parent_path().generic_string(), measured.image_kind == "surface");
      stage.stale = stale(stage.file, figures, measured, places);
    } else if (row.needs_scan && !has_scan(measured)) {
      stage.fill =
          fmt::format("a measured surface: name it as `surface` in [pose.{}] of case.toml", measured.predicted().name);
    } else if (std::string(row.target).empty()) {
      stage.fill = fmt::format("build/bin/supine-sensitivity {} {}/mesh.vtu", places.case_name, places.out_name);
    } else {
      stage.fill = places.make(row.target);
    }
    stages.push_back(stage);
  }
  return stages;
}

Json stages_json(const std::vector<Stage>& stages) {
  Json list = Json::array();
  for (const Stage& stage : stages)
    list.push_back({{"name", stage.name},
                    {"shows", stage.shows},
                    {"file", stage.file},
                    {"fill", stage.fill},
                    {"command", stage.command},
                    {"stale", stage.stale}});
  return list;
}

}  // namespace supine::pipeline
