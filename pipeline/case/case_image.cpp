// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_image.h"

#include <fmt/core.h>

#include <algorithm>

#include "common/suggestion.h"
#include "pipeline/case/case_labels.h"
#include "pipeline/case/patient_frame.h"
#include "segmentation/steps/recipe_toml.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

void read_cut(const TomlReader& image, AllowedCuts& cut) {
  const std::vector<std::string> known = {"excluded", "edge", "rim"};
  std::vector<std::string> seen;
  for (const std::string& place : image.texts("cut").value_or(std::vector<std::string>{})) {
    if (std::find(known.begin(), known.end(), place) == known.end())
      image.fail("cut", fmt::format("\"{}\" is no place for a cut; known: {}", place, listed(known)));
    if (std::find(seen.begin(), seen.end(), place) != seen.end())
      image.fail("cut", fmt::format("\"{}\" is listed twice", place));
    seen.push_back(place);
    (place == "excluded" ? cut.excluded : place == "edge" ? cut.edge : cut.rim) = true;
  }
  const auto rim_mm = image.number("rim_mm");
  if (!rim_mm) return;
  if (!cut.rim) image.fail("rim_mm", "has no effect: add \"rim\" to cut, or leave rim_mm out");
  if (*rim_mm <= 0) image.fail("rim_mm", "must be > 0 mm");
  cut.rim_mm = *rim_mm;
}

NamedPlace read_place(const TomlReader& table, const std::string& name, bool support, const std::string& frame) {
  std::vector<std::string> keys = {"file", "point", "normal"};
  if (support) keys.insert(keys.end(), {"within_mm", "faces"});
  table.allow(keys);
  NamedPlace place;
  place.name = name;
  if (table.has("file") == table.has("point"))
    table.fail(table.has("file") ? "point" : "file",
               "a support or part is a surface (file) or a plane (point and normal): give one of the two");
  if (table.has("file")) {
    place.file = case_path(table, "file", false);
  } else {
    table.require("normal");
    place.point = *table.vector("point");
    place.normal = *table.vector("normal");
    if (!(place.normal.norm() > 0)) table.fail("normal", "is zero; give the direction in which the plane faces");
    place.normal.normalize();
    if (frame == "RAS")
      for (Eigen::Vector3d* v : {&place.point, &place.normal}) v->head<2>() *= -1;
  }
  if (!support) return place;
  place.within_mm = table.number("within_mm", positive).value_or(place.within_mm);
  place.beyond = table.choice("faces", {"on", "beyond"}, "on") == "beyond";
  if (place.beyond && place.file)
    table.fail("faces", "belongs to a plane: \"beyond\" takes what lies on its outer side");
  return place;
}

std::vector<NamedPlace> read_named(const TomlReader& image, const char* key, bool support, const std::string& frame) {
  std::vector<NamedPlace> places;
  const auto table = image.sub_table(key);
  if (!table) return places;
  for (const std::string& name : plain_names(*table)) {
    const auto entry = table->sub_table(name);
    if (!entry) table->fail(name, fmt::format("must be a table: write [image.{}.{}]", key, name));
    places.push_back(read_place(*entry, name, support, frame));
  }
  return places;
}

void read_places(const TomlReader& image, bool surface, Case& result) {
  for (const char* key : {"supports", "parts"})
    if (!surface && image.has(key))
      image.fail(key,
                 "belongs to kind = \"surface\"; in a label map supports are labels ([image.labels] support.NAME)");
  if (!surface) return;
  result.supports = read_named(image, "supports", true, result.frame);
  result.parts = read_named(image, "parts", false, result.frame);
  if (result.supports.empty())
    image.fail("supports", "is missing: nothing holds the body; add [image.supports.NAME] with a plane or a surface");
}

/// A further series that a recipe may look at.
void read_second(const TomlReader& image, Case& result) {
  const bool named = image.has("second");
  if (named && result.image_kind != "mri")
    image.fail("second", "has no effect: a second series belongs to kind = \"mri\"");
  if (image.has("second_series") && !named)
    image.fail("second_series", "has no effect: give the folder of the second series as second");
  if (!named) return;
  result.second_file = case_path(image, "second", true);
  const bool folder = fs::is_directory(*result.second_file);
  if (const auto series = image.text("second_series")) {
    if (!folder) image.fail("second_series", "has no effect: second is a file, only a DICOM folder holds series");
    result.second_series = *series;
  }
  if (fs::equivalent(*result.second_file, result.image_file) &&
      (!folder || result.second_series == result.image_series))
    image.fail("second", "is the same series as file");
}

}  // namespace

std::vector<std::string> plain_names(const TomlReader& table) {
  std::vector<std::pair<toml::source_position, std::string>> names;
  for (const auto& [name, node] : table.table()) names.emplace_back(name.source().begin, std::string(name.str()));
  std::sort(names.begin(), names.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first.line, a.first.column) < std::pair(b.first.line, b.first.column);
  });
  std::vector<std::string> result;
  for (const auto& [place, name] : names) {
    if (name.empty() || !std::all_of(name.begin(), name.end(),
                                     [](unsigned char c) { return (c < 128 && std::isalnum(c)) || c == '_'; }))
      table.fail(name, "a support or part names arrays: use letters, digits and _ only");
    result.push_back(name);
  }
  return result;
}

fs::path case_path(const TomlReader& reader, std::string_view key, bool folder_allowed) {
  const fs::path path = reader.file().parent_path() / reader.required_text(key);
  if (!fs::exists(path))
    reader.fail(key, fmt::format("{} is not there; paths are relative to the case folder", path.string()));
  if (fs::is_directory(path) && !folder_allowed) reader.fail(key, "is a folder, a file is wanted");
  return path;
}

void read_case_image(const TomlReader& file, Case& result) {
  const auto image = file.sub_table("image");
  if (!image) file.fail("image", "table [image] is missing: it names the volume");
  image->allow({"file", "kind", "frame", "series", "second", "second_series", "cut", "rim_mm", "labels",
                "segmentation_mm", "pose", "supports", "parts"});
  image->required_text("kind");
  result.image_kind = image->choice("kind", {"labels", "mri", "surface"}, "labels");
  result.imaged_pose = image->text("pose").value_or("prone");
  if (result.is_object() && !image->has("pose"))
    image->fail("pose",
                "is missing: name the pose in which the object was imaged, or \"undeformed\" for a shape free of "
                "load (CAD, cast, buoyancy)");
  const bool surface = result.image_kind == "surface";
  result.image_file = case_path(*image, "file", !surface);
  read_places(*image, surface, result);
  if (const auto series = image->text("series")) {
    if (!fs::is_directory(result.image_file))
      image->fail("series", "has no effect: image.file is a file, only a DICOM folder holds series");
    result.image_series = *series;
  }
  read_second(*image, result);
  if (const auto frame = image->text("frame")) {
    if (!axes_of_frame(*frame))
      image->fail("frame",
                  fmt::format("\"{}\" is no frame; give three letters, the sides of the patient to which x, y and "
                              "z grow: one of L R, one of A P, one of S I, for example \"ALS\"",
                              *frame));
    result.image_frame = *frame;
  }
  read_cut(*image, result.cut);
  constexpr double most_mm = 10;
  result.segmentation_mm = image->number("segmentation_mm");
  if (result.segmentation_mm && (*result.segmentation_mm < 0 || *result.segmentation_mm > most_mm))
    image->fail("segmentation_mm",
                fmt::format("is 1 sigma and must lie in 0 to {:g}, not {:g}", most_mm, *result.segmentation_mm));

  const auto labels = image->sub_table("labels");
  const bool needs_labels = result.image_kind == "labels";
  if (needs_labels && !labels)
    image->fail("labels", "table [image.labels] is missing: it says which value is which tissue");
  if (labels) read_case_labels(*labels, result);

  const auto recipe = file.sub_table("segmentation");
  if (!recipe) return;
  if (result.image_kind != "mri")
    file.fail("segmentation", "is read only when [image] kind = \"mri\"; take the table out, or change kind");
  result.recipe = segmentation::read_recipe(*recipe, result.frame);
  // A recipe that finds the breast in a whole chest ends it where the chest goes on.
  if (!result.recipe->name.empty() && !image->has("cut")) result.cut.excluded = result.cut.edge = result.cut.rim = true;
}

}  // namespace supine::pipeline
