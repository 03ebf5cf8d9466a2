// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "common/toml_reader.h"
#include "segmentation/steps/recipe.h"

namespace supine::segmentation {

/// One table [[segmentation.step]], with what steps have in common: places are written in the frame of the file and
/// returned in LPS.
class StepTable : public TomlReader {
 public:
  /// @param to_lps  signs that turn the frame of the file into LPS
  StepTable(TomlReader table, Eigen::Vector3d to_lps) : TomlReader(std::move(table)), to_lps_(std::move(to_lps)) {}

  /// Empty when the key is absent.
  std::string mask_or_none(std::string_view key) const { return text(key).value_or(""); }
  std::vector<std::string> masks(std::string_view key) const;

  float grey(std::string_view key, float absent, const Bounds& bounds = {}) const;
  /// The keys `lower` and `upper`; @p required: one of them at least.
  GreyRange greys(bool required) const;

  /// A point or direction.
  Eigen::Vector3d place(std::string_view key) const;
  std::vector<Eigen::Vector3d> places(std::string_view key) const;
  /// A place along patient axis 0, 1 or 2; nothing when the key is absent.
  std::optional<double> coordinate(std::string_view key, int axis) const;

  Tissue tissue(std::string_view key, const std::string& name) const;

  template <class Value>
  Value required_choice(std::string_view key, const std::vector<std::pair<std::string, Value>>& values) const {
    require(key);
    return *choice<Value>(key, values);
  }

 private:
  Eigen::Vector3d to_lps_;
};

}  // namespace supine::segmentation
