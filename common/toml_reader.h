// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace supine {

/// The name of @p known that is closest to @p name by edit distance (a swap of neighbours is one edit); empty when
/// none is close (more than a third of the letters differ).
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

/// "a", "a or b", "a, b or c".
std::string listed(const std::vector<std::string>& names);

/// Parses a TOML file.
/// @throws InputError  naming file, line and column: not there, not TOML, a key written twice
toml::table parse_toml(const std::filesystem::path& file);

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

  bool has(std::string_view key) const { return table_->contains(key); }

  /// Absent keys give nothing; a value of another type, or an empty string, is an error.
  std::optional<std::string> text(std::string_view key) const;
  std::optional<double> number(std::string_view key) const;
  std::optional<std::vector<std::string>> texts(std::string_view key) const;
  std::optional<std::vector<double>> numbers(std::string_view key) const;
  std::optional<std::vector<int>> integers(std::string_view key) const;
  std::optional<TomlReader> sub_table(std::string_view key) const;

  /// A text that must be there.
  std::string required_text(std::string_view key) const;
  /// One of @p values; @p otherwise when the key is absent.
  std::string choice(std::string_view key, const std::vector<std::string>& values, const std::string& otherwise) const;

  /// @throws InputError  always: "FILE:LINE: [section] key = value: complaint"
  [[noreturn]] void fail(std::string_view key, const std::string& complaint) const;

 private:
  const toml::table* table_;
  std::filesystem::path file_;
  std::string section_;
};

}  // namespace supine
