// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace supine {

/// Parses a TOML file.
/// @throws InputError  naming file, line and column: not there, not TOML, a key written twice
toml::table parse_toml(const std::filesystem::path& file);
/// The same of a text that is, or is to be, in @p file, which messages name.
toml::table parse_toml(std::string_view text, const std::filesystem::path& file);

/// What a number may be.
struct Bounds {
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  bool open = false;  ///< lower itself is refused
};
constexpr Bounds positive{.lower = 0, .open = true}, not_negative{.lower = 0};

/// One table of a TOML file, read key by key; every complaint names file, line, table, key and value.
class TomlReader {
 public:
  /// @param section  the table's name in messages, for example "pose.prone"; empty for the whole file
  TomlReader(const toml::table& table, std::filesystem::path file, std::string section);

  const toml::table& table() const { return *table_; }
  const std::filesystem::path& file() const { return file_; }
  const std::string& section() const { return section_; }

  /// @throws InputError  for a key that is not in @p known, with the nearest one
  void allow(const std::vector<std::string>& known) const;
  /// The same with the keys this reader was asked for: to be called after the last of them.
  void allow_no_more() const { allow(asked_); }

  bool has(std::string_view key) const;
  /// @throws InputError  when the key is absent, with a key of the table that may be meant for it
  void require(std::string_view key) const;

  /// Absent keys give nothing; a value of another type, or an empty string, is an error.
  std::optional<std::string> text(std::string_view key) const;
  std::optional<double> number(std::string_view key, const Bounds& bounds = {}) const;
  /// A number without a fraction, so that 2.0 is 2.
  std::optional<int> whole_number(std::string_view key, int lower, int upper) const;
  std::optional<std::vector<std::string>> texts(std::string_view key) const;
  std::optional<std::vector<int>> integers(std::string_view key) const;
  /// Three numbers [x, y, z].
  std::optional<Eigen::Vector3d> vector(std::string_view key) const;
  /// A list of such, with one at least.
  std::optional<std::vector<Eigen::Vector3d>> vectors(std::string_view key) const;
  std::optional<TomlReader> sub_table(std::string_view key) const;

  /// Those that must be there.
  std::string required_text(std::string_view key) const;
  double required_number(std::string_view key, const Bounds& bounds = {}) const;
  /// One of @p values; @p otherwise when the key is absent.
  std::string choice(std::string_view key, const std::vector<std::string>& values, const std::string& otherwise) const;
  /// What the text stands for.
  template <class Value>
  std::optional<Value> choice(std::string_view key, const std::vector<std::pair<std::string, Value>>& values) const {
    if (!has(key)) return {};
    std::vector<std::string> names;
    for (const auto& [name, value] : values) names.push_back(name);
    const std::string chosen = choice(key, names, "");
    for (const auto& [name, value] : values)
      if (name == chosen) return value;
    return {};
  }

  /// @throws InputError  always: "FILE:LINE: [section] key = value: complaint"
  [[noreturn]] void fail(std::string_view key, const std::string& complaint) const;

 private:
  const toml::table* table_;
  std::filesystem::path file_;
  std::string section_;
  mutable std::vector<std::string> asked_;
};

}  // namespace supine
