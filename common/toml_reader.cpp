// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/toml_reader.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/error.h"
#include "common/suggestion.h"

namespace supine {
namespace {

namespace fs = std::filesystem;

std::string printed(const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) return fmt::format("\"{}\"", *text);
  if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
  std::ostringstream text;
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) text << (text.tellp() > 0 ? ", " : "") << printed(element);
    return "[" + text.str() + "]";
  }
  node.visit([&text](const auto& value) { text << toml::toml_formatter(value); });
  return text.str();
}

/// ">= 0 and <= 4"; one bound at least is finite.
std::string printed(const Bounds& bounds) {
  std::string text;
  if (std::isfinite(bounds.lower)) text = fmt::format("{} {}", bounds.open ? ">" : ">=", bounds.lower);
  if (std::isfinite(bounds.upper)) text += fmt::format("{}<= {}", text.empty() ? "" : " and ", bounds.upper);
  return text;
}

/// Elements of an array through @p convert, which returns nothing for a wrong type.
template <class T, class Convert>
std::vector<T> elements(const TomlReader& reader, std::string_view key, const char* what, Convert convert) {
  const toml::array* array = reader.table().get(key)->as_array();
  if (!array) reader.fail(key, fmt::format("must be a list of {} in square brackets", what));
  std::vector<T> values;
  for (const toml::node& element : *array) {
    const std::optional<T> value = convert(element);
    if (!value) reader.fail(key, fmt::format("must hold {} only", what));
    values.push_back(*value);
  }
  return values;
}

std::optional<double> finite_number(const toml::node& node) {
  if (!node.is_number()) return {};
  const double number = *node.value<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::optional<Eigen::Vector3d> three_numbers(const toml::node& node) {
  const toml::array* array = node.as_array();
  if (!array || array->size() != 3) return {};
  Eigen::Vector3d vector;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = finite_number((*array)[static_cast<std::size_t>(axis)]);
    if (!number) return {};
    vector[axis] = *number;
  }
  return vector;
}

std::optional<int> small_integer(const toml::node& node) {
  if (!node.is_integer()) return {};
  const std::int64_t number = **node.as_integer();
  if (number < std::numeric_limits<int>::min() || number > std::numeric_limits<int>::max()) return {};
  return static_cast<int>(number);
}

}  // namespace

toml::table parse_toml(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || fs::is_directory(file)) throw InputError(fmt::format("cannot read {}", file.string()));
  std::ostringstream text;
  text << stream.rdbuf();
  return parse_toml(text.str(), file);
}

toml::table parse_toml(std::string_view text, const fs::path& file) {
  try {
    return toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    throw InputError(fmt::format("{}:{}:{}: not valid TOML: {}", file.string(), error.source().begin.line,
                                 error.source().begin.column, error.description()));
  }
}

TomlReader::TomlReader(const toml::table& table, fs::path file, std::string section)
    : table_(&table), file_(std::move(file)), section_(std::move(section)) {}

void TomlReader::fail(std::string_view key, const std::string& complaint) const {
  const toml::node* node = table_->get(key);
  const auto line = (node ? node->source() : table_->source()).begin.line;
  std::string place = file_.string();
  if (line > 0) place += fmt::format(":{}", line);
  place += ":";
  if (!section_.empty()) place += fmt::format(" [{}]", section_);
  if (node && !node->is_table() && !node->is_array_of_tables())
    throw InputError(fmt::format("{} {} = {}: {}", place, key, printed(*node), complaint));
  throw InputError(fmt::format("{} {}: {}", place, key, complaint));
}

void TomlReader::allow(const std::vector<std::string>& known) const {
  for (const auto& [key, node] : *table_) {
    if (std::find(known.begin(), known.end(), key.str()) == known.end())
      fail(key.str(), "unknown key; " + suggestion(key.str(), known));
  }
}

bool TomlReader::has(std::string_view key) const {
  if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) asked_.emplace_back(key);
  return table_->contains(key);
}

void TomlReader::require(std::string_view key) const {
  if (has(key)) return;
  std::vector<std::string> others;
  for (const auto& [other, node] : *table_)
    if (std::find(asked_.begin(), asked_.end(), other.str()) == asked_.end()) others.emplace_back(other.str());
  const std::string nearest = nearest_name(key, others);
  fail(key, "is missing and must be given" + (nearest.empty() ? "" : fmt::format("; is {} meant for it?", nearest)));
}

std::optional<std::string> TomlReader::text(std::string_view key) const {
  if (!has(key)) return {};
  const auto value = table_->get(key)->value_exact<std::string>();
  if (!value) fail(key, "must be a text in quotes");
  if (value->empty()) fail(key, "must not be empty");
  return value;
}

std::optional<double> TomlReader::number(std::string_view key, const Bounds& bounds) const {
  if (!has(key)) return {};
  const auto value = finite_number(*table_->get(key));
  if (!value) fail(key, "must be a finite number");
  if (*value < bounds.lower || *value > bounds.upper || (bounds.open && *value == bounds.lower))
    fail(key, "must be " + printed(bounds));
  return value;
}

std::optional<int> TomlReader::whole_number(std::string_view key, int lower, int upper) const {
  const auto value = number(key, {.lower = static_cast<double>(lower), .upper = static_cast<double>(upper)});
  if (!value) return {};
  if (*value != std::floor(*value)) fail(key, "must be a whole number");
  return static_cast<int>(*value);
}

std::optional<std::vector<std::string>> TomlReader::texts(std::string_view key) const {
  if (!has(key)) return {};
  return elements<std::string>(*this, key, "texts in quotes",
                               [](const toml::node& node) { return node.value_exact<std::string>(); });
}

std::optional<std::vector<int>> TomlReader::integers(std::string_view key) const {
  if (!has(key)) return {};
  return elements<int>(*this, key, "whole numbers (no decimal point, up to 2147483647)", small_integer);
}

std::optional<Eigen::Vector3d> TomlReader::vector(std::string_view key) const {
  if (!has(key)) return {};
  const auto value = three_numbers(*table_->get(key));
  if (!value) fail(key, "must be three numbers [x, y, z], each finite");
  return value;
}

std::optional<std::vector<Eigen::Vector3d>> TomlReader::vectors(std::string_view key) const {
  if (!has(key)) return {};
  const char* what = "points of three numbers [x, y, z]";
  const auto values = elements<Eigen::Vector3d>(*this, key, what, three_numbers);
  if (values.empty()) fail(key, fmt::format("must not be empty: give {}", what));
  return values;
}

std::optional<TomlReader> TomlReader::sub_table(std::string_view key) const {
  if (!has(key)) return {};
  const toml::table* inner = table_->get(key)->as_table();
  const std::string name = section_.empty() ? std::string(key) : fmt::format("{}.{}", section_, key);
  if (!inner) fail(key, fmt::format("must be a table: write [{}] on a line of its own", name));
  return TomlReader(*inner, file_, name);
}

std::string TomlReader::required_text(std::string_view key) const {
  require(key);
  return *text(key);
}

double TomlReader::required_number(std::string_view key, const Bounds& bounds) const {
  require(key);
  return *number(key, bounds);
}

std::string TomlReader::choice(std::string_view key, const std::vector<std::string>& values,
                               const std::string& otherwise) const {
  const std::string value = text(key).value_or(otherwise);
  if (std::find(values.begin(), values.end(), value) == values.end()) {
    const std::string nearest = nearest_name(value, values);
    fail(key, fmt::format("must be {}{}", listed(values), nearest.empty() ? "" : "; did you mean " + nearest + "?"));
  }
  return value;
}

}  // namespace supine
