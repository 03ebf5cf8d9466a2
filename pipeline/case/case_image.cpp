// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_image.h"

#include <fmt/core.h>

#include <algorithm>

#include "common/suggestion.h"
#include "pipeline/case/patient_frame.h"
#include "segmentation/steps/recipe_toml.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using segmentation::Tissue;
using segmentation::tissue_names;

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

void read_labels(const TomlReader& labels, std::map<int, Tissue>& result) {
  labels.allow({tissue_names.begin(), tissue_names.end()});
  bool muscle = false, meshed = false;
  for (int t = 0; t < segmentation::tissue_count; ++t) {
    const auto values = labels.integers(tissue_names[t]);
    if (!values) continue;
    if (values->empty())
      labels.fail(tissue_names[t], "lists no label value; give the values the volume uses, or leave the key out");
    const Tissue tissue = static_cast<Tissue>(t);
    muscle |= tissue == Tissue::muscle;
    meshed |= is_meshed(tissue);
    for (const int value : *values) {
      const auto [known, added] = result.emplace(value, tissue);
      if (!added)
        labels.fail(tissue_names[t],
                    fmt::format("label value {} is listed already, for {}; each value belongs to one tissue", value,
                                tissue_names[static_cast<int>(known->second)]));
    }
  }
  if (!muscle) labels.fail("muscle", "is missing: the breast slides on the muscle, so its label value must be given");
  if (!meshed) labels.fail("adipose", "no soft tissue is listed; give at least adipose or gland");
}

}  // namespace

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
  image->allow({"file", "kind", "frame", "series", "cut", "rim_mm", "labels", "segmentation_mm"});
  image->required_text("kind");
  result.image_kind = image->choice("kind", {"labels", "mri"}, "labels");
  result.image_file = case_path(*image, "file", true);
  if (const auto series = image->text("series")) {
    if (!fs::is_directory(result.image_file))
      image->fail("series", "has no effect: image.file is a file, only a DICOM folder holds series");
    result.image_series = *series;
  }
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
  if (labels) read_labels(*labels, result.labels);

  const auto recipe = file.sub_table("segmentation");
  if (!recipe) return;
  if (needs_labels)
    file.fail("segmentation", "is read only when [image] kind = \"mri\"; take the table out, or change kind");
  result.recipe = segmentation::read_recipe(*recipe, result.frame);
}

}  // namespace supine::pipeline
