// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/case_labels.h"

#include <fmt/core.h>

#include "pipeline/case/case_image.h"

namespace supine::pipeline {
namespace {

using segmentation::Tissue;

/// What may stand in [image.labels]: the tissues, and `support`, the rigid thing that tissue holds on to, which is what
/// the muscle is.
std::vector<std::pair<std::string, Tissue>> label_keys() {
  std::vector<std::pair<std::string, Tissue>> keys;
  for (int t = 0; t < segmentation::tissue_count; ++t)
    keys.emplace_back(std::string(segmentation::tissue_names[t]), static_cast<Tissue>(t));
  keys.emplace_back("support", Tissue::muscle);
  return keys;
}

/// Reads [image.labels]: what each value of the volume is.
class LabelReader {
 public:
  LabelReader(const TomlReader& labels, Case& result) : labels_(labels), result_(result) {}

  void read() {
    std::vector<std::string> keys;
    for (const auto& [key, tissue] : label_keys()) keys.push_back(key);
    labels_.allow(keys);
    const bool named = labels_.has("support") && labels_.table().get("support")->is_table();
    for (const auto& [key, tissue] : label_keys())
      if (labels_.has(key) && !(named && key == "support")) read_values(labels_, key, tissue);
    if (named) read_supports(*labels_.sub_table("support"));
    require_tissues();
  }

 private:
  std::vector<int> read_values(const TomlReader& table, const std::string& key, Tissue tissue) {
    const auto values = table.integers(key);
    if (values->empty()) table.fail(key, "lists no label value; give the values the volume uses, or leave the key out");
    for (const int value : *values) {
      const auto [owner, added] = owner_.emplace(value, key);
      if (!added)
        table.fail(key, fmt::format("label value {} is listed already, for {}; each value belongs to one tissue or "
                                    "support",
                                    value, owner->second));
      result_.labels.emplace(value, tissue);
    }
    return *values;
  }

  /// Supports by name; muscle beside them is the support of that name.
  void read_supports(const TomlReader& table) {
    if (result_.image_kind != "labels")
      labels_.fail("support", "names supports, which are told apart in a label map alone (kind = \"labels\")");
    if (labels_.has("muscle")) result_.label_supports.push_back({"muscle", *labels_.integers("muscle")});
    for (const std::string& name : plain_names(table)) {
      if (name == "muscle" && labels_.has("muscle"))
        table.fail(name, "is the second support of that name: [image.labels] lists muscle too");
      result_.label_supports.push_back({name, read_values(table, name, Tissue::muscle)});
    }
    if (result_.label_supports.size() > segmentation::most_supports)
      labels_.fail("support", fmt::format("{} supports are named, {} at most", result_.label_supports.size(),
                                          segmentation::most_supports));
  }

  void require_tissues() const {
    bool muscle = false, meshed = false;
    for (const auto& [value, tissue] : result_.labels) {
      muscle |= tissue == Tissue::muscle;
      meshed |= is_meshed(tissue);
    }
    if (!muscle && result_.is_object())
      labels_.fail("support", "is missing: the label value of the rigid thing that holds the body must be given");
    if (!muscle)
      labels_.fail("muscle", "is missing: the breast slides on the muscle, so its label value must be given");
    if (!meshed) labels_.fail("adipose", "no soft tissue is listed; give at least adipose or gland");
  }

  const TomlReader& labels_;
  Case& result_;
  std::map<int, std::string> owner_;
};

}  // namespace

void read_case_labels(const TomlReader& labels, Case& result) { LabelReader(labels, result).read(); }

}  // namespace supine::pipeline
