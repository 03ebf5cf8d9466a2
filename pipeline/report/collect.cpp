// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/collect.h"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/error.h"
#include "pipeline/report/encode.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw InputError(fmt::format("{}: cannot be read", file.string()));
  return text.str();
}

Json read_figures(const fs::path& file) {
  Json figures = Json::parse(content(file), nullptr, false);
  if (!figures.is_object())
    throw InputError(fmt::format("{}: not a JSON object; write it again with its tool", file.string()));
  figures.erase("timing");  // alone differs between two runs of the same work
  return figures;
}

std::vector<std::string> sidecar_names(const Case& measured) {
  std::vector<std::string> names = {"labels.json",     "breast.json",      "muscle.json",
                                    "coarse.json",     "mesh.json",        measured.imaged_pose + ".json",
                                    "undeformed.json", "calibration.json", "model.json",
                                    "history.json",    "sensitivity.json", "diagnosis.json",
                                    "ladder.json"};
  for (const Pose& pose : measured.poses) {
    const std::string end = pose.name == "supine" ? ".json" : "_" + pose.name + ".json";
    if (pose.name != measured.imaged_pose) names.push_back(pose.name + ".json");
    names.push_back(pose.name + "_landmarks.json");
    names.push_back("comparison" + end);
    names.push_back("scan" + end);
  }
  return names;
}

/// Folders of the models, relative to the output folder: that of the model as given, then the others.
std::vector<fs::path> model_folders(const fs::path& out) {
  std::vector<fs::path> folders = {"", "calibrated", "targets", "ladder"};
  if (fs::is_directory(out / "ladder"))
    for (int rung = 1; fs::is_directory(out / "ladder" / std::to_string(rung)); ++rung)
      folders.push_back(fs::path("ladder") / std::to_string(rung));
  return folders;
}

void add_pictures(const fs::path& folder, const fs::path& out, Collected& collected, std::uintmax_t& left) {
  if (!fs::is_directory(folder)) return;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == ".png") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const auto size = fs::file_size(file);
    if (size > left) continue;
    left -= size;
    const std::string bytes = content(file);
    collected.pictures[file.lexically_relative(out).generic_string()] =
        "data:image/png;base64," + base64(std::as_bytes(std::span(bytes)));
  }
}

}  // namespace

const Json& Collected::find(const std::string& name) const {
  static const Json none;
  const auto found = figures.find(name);
  return found == figures.end() ? none : *found;
}

const Json& Collected::first(std::initializer_list<const char*> names) const {
  for (const char* name : names)
    if (!find(name).is_null()) return find(name);
  return find("");
}

Collected collect(const Case& measured, const fs::path& case_folder, const fs::path& out) {
  Collected collected;
  const auto names = sidecar_names(measured);
  for (const fs::path& folder : model_folders(out))
    for (const std::string& name : names)
      if (const fs::path file = folder / name; fs::is_regular_file(out / file))
        collected.figures[file.generic_string()] = read_figures(out / file);
  const auto add_text = [&collected](const fs::path& file, const std::string& name) {
    if (fs::is_regular_file(file)) collected.texts[name] = content(file);
  };
  add_text(case_folder / "case.toml", "case/case.toml");
  add_text(case_folder / "model.toml", "case/model.toml");
  for (const char* name : {"model.toml", "history.csv", "sensitivity.csv"}) add_text(out / name, name);
  for (const fs::path& folder : model_folders(out))
    if (!folder.empty()) add_text(out / folder / "model.toml", (folder / "model.toml").generic_string());
  std::uintmax_t left = most_picture_bytes;
  add_pictures(out / "overlays", out, collected, left);
  return collected;
}

}  // namespace supine::pipeline
