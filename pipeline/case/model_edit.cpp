// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/case/model_edit.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <string_view>
#include <vector>

#include "common/error.h"
#include "common/suggestion.h"
#include "common/toml_reader.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using simulation::Effect;
using simulation::Parameter;

std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

const Effect& known_effect(const std::string& name) {
  if (const Effect* effect = simulation::find_effect(name)) return *effect;
  std::vector<std::string> names;
  for (const Effect* effect : simulation::catalogue()) names.push_back(effect->name());
  const std::string nearest = nearest_name(name, names);
  throw InputError(fmt::format("there is no effect \"{}\"; {}", name,
                               nearest.empty() ? "there are " + listed(names) : "did you mean " + nearest + "?"));
}

bool starts_table(const std::string& line) {
  const auto first = line.find_first_not_of(" \t");
  return first != std::string::npos && line[first] == '[';
}

/// First line (0-based) of the block of the effect, or -1.
/// @throws InputError  effects that are no blocks
int effect_line(const ModelText& model, const std::string& name) {
  const toml::table table = parse_toml(model.text, model.file);
  const toml::array* entries = table.get_as<toml::array>("effect");
  if (!entries) return -1;
  const std::vector<std::string> lines = split_lines(model.text);
  int found = -1;
  for (const toml::node& entry : *entries) {
    const auto line = static_cast<int>(entry.source().begin.line) - 1;
    if (!starts_table(lines[static_cast<std::size_t>(line)]))
      throw InputError(fmt::format(
          "{}:{}: `effect` is one list here, which is read but not edited: write each effect as a block that begins "
          "with [[effect]]",
          model.file.string(), line + 1));
    const toml::table* effect = entry.as_table();
    if (effect && (*effect)["name"].value_or(std::string_view()) == name) found = line;
  }
  return found;
}

bool is_comment_or_blank(const std::string& line) {
  const auto first = line.find_first_not_of(" \t\r");
  return first == std::string::npos || line[first] == '#';
}

/// One past the last line of the block that starts at @p begin.
std::size_t block_end(const std::vector<std::string>& lines, std::size_t begin) {
  std::size_t end = begin + 1;
  while (end < lines.size() && !starts_table(lines[end])) ++end;
  if (end == lines.size()) return end;
  while (end > begin + 1 && is_comment_or_blank(lines[end - 1])) --end;
  return end;
}

/// Everything free within its range and about its usual value, as the diagnosis refits the effect: a strength found
/// with another place than the file has would be another strength.
std::string parameter_line(const Parameter& row, double value) {
  const std::string comment = fmt::format("# {}{}", row.meaning, row.unit == "1" ? "" : ", " + row.unit);
  return fmt::format("{} = {{ value = {}, prior_sd = {:.3g}, lower = {}, upper = {} }}  {}\n", row.name, value,
                     simulation::prior_sd(row), row.lower, row.upper, comment);
}

/// A number chosen for a parameter. @throws InputError  no number, one outside the range
double chosen_number(const Effect& effect, const Parameter& row, const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= row.lower && value <= row.upper))
    throw InputError(fmt::format("{}.{} = {}: must be a number from {} to {}{}", effect.name(), row.name, text,
                                 row.lower, row.upper, row.unit == "1" ? "" : " " + row.unit));
  return value;
}

/// @throws InputError  a name that the effect does not have
void check_names(const Effect& effect, const std::map<std::string, std::string>& chosen) {
  std::vector<std::string> names;
  for (const Parameter& row : effect.parameters()) names.push_back(row.name);
  for (const auto& option : effect.options()) names.push_back(option.name);
  for (const auto& [name, value] : chosen)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw InputError(fmt::format("{} has no \"{}\"; it has {}", effect.name(), name, listed(names)));
}

/// The table that holds the section of a parameter: "breast" of the file, or the [[effect]] of that name.
const toml::table* section_of(const toml::table& file, const std::string& section) {
  if (const toml::table* base = file.get_as<toml::table>(section)) return base;
  const toml::array* entries = file.get_as<toml::array>("effect");
  for (std::size_t i = 0; entries && i < entries->size(); ++i) {
    const toml::table* effect = entries->get_as<toml::table>(i);
    if (effect && (*effect)["name"].value_or(std::string_view()) == section) return effect;
  }
  return nullptr;
}

/// Where the number of a parameter stands in the file, whether it is fixed (name = 1) or free (name = { value = 1 }),
/// or one of its bounds (name.lower).
toml::source_region value_place(const toml::table& table, const fs::path& file, const std::string& name) {
  const auto dot = name.find('.'), second = name.find('.', dot + 1);
  const toml::table* section = section_of(table, name.substr(0, dot));
  const toml::node* value = section ? section->get(name.substr(dot + 1, second - dot - 1)) : nullptr;
  const bool bound = second != std::string::npos;
  if (value != nullptr && value->is_table())
    value = value->as_table()->get(bound ? name.substr(second + 1) : "value");
  else if (bound)
    value = nullptr;
  if (value == nullptr || !value->is_number())
    throw InputError(fmt::format("{} holds no number {}, so it cannot be replaced; write one", file.string(), name));
  return value->source();
}

/// Byte at which the code point @p column (1-based) of a line starts.
std::size_t byte_of(const std::string& line, std::size_t column) {
  std::size_t byte = 0;
  for (std::size_t point = 1; point < column && byte < line.size(); ++point) {
    ++byte;
    while (byte < line.size() && (static_cast<unsigned char>(line[byte]) & 0xC0) == 0x80) ++byte;
  }
  return byte;
}

}  // namespace

std::map<std::string, std::string> chosen_values(const std::vector<std::string>& words) {
  std::map<std::string, std::string> values;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == word.size())
      throw InputError(fmt::format("--with {}: must be NAME=VALUE, such as width_mm=20", word));
    values[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return values;
}

std::string effect_block(const Effect& effect, const std::map<std::string, std::string>& chosen) {
  check_names(effect, chosen);
  std::string block = fmt::format("[[effect]]  # {}\nname = \"{}\"\n", effect.meaning(), effect.name());
  for (const Parameter& row : effect.parameters()) {
    const auto own = chosen.find(row.name);
    block += parameter_line(row, own == chosen.end() ? row.median : chosen_number(effect, row, own->second));
  }
  for (const auto& option : effect.options()) {
    const auto own = chosen.find(option.name);
    const std::string& value = own == chosen.end() ? option.default_value : own->second;
    if (!option.values.empty() && std::find(option.values.begin(), option.values.end(), value) == option.values.end())
      throw InputError(fmt::format("{}.{} = {}: must be {}", effect.name(), option.name, value, listed(option.values)));
    block += fmt::format("{} = \"{}\"  # {}: {}\n", option.name, value,
                         option.values.empty() ? "a name" : listed(option.values), option.meaning);
  }
  return block;
}

std::string with_effect(const ModelText& model, const std::string& name,
                        const std::map<std::string, std::string>& chosen) {
  const Effect& effect = known_effect(name);
  if (const int line = effect_line(model, name); line >= 0)
    throw InputError(fmt::format("{}:{}: the effect {} is there already; change its values, or remove it first",
                                 model.file.string(), line + 1, name));
  std::string text = model.text;
  if (!text.empty() && text.back() != '\n') text += '\n';
  return text + effect_block(effect, chosen);
}

std::string without_effect(const ModelText& model, const std::string& name) {
  const int line = effect_line(model, name);
  if (line < 0) throw InputError(fmt::format("{} has no effect \"{}\" to remove", model.file.string(), name));
  const std::vector<std::string> lines = split_lines(model.text);
  const auto begin = static_cast<std::size_t>(line);
  const std::size_t end = block_end(lines, begin);
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (i < begin || i >= end) text += lines[i] + "\n";
  return text;
}

namespace {

/// The shortest number that is read back as the same; of what rounding left beside a round one (a bound that went
/// through a logarithm and back) the round one.
std::string written(double value) {
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  const std::string round = fmt::format("{:.12g}", value);
  const bool same = std::abs(std::stod(round) - value) <= rounding * std::abs(value);
  return same ? round : fmt::format("{}", value);
}

}  // namespace

std::string with_values(const ModelText& model, const std::map<std::string, double>& values) {
  const toml::table table = parse_toml(model.text, model.file);
  std::vector<std::pair<toml::source_region, double>> places;
  for (const auto& [name, value] : values) places.emplace_back(value_place(table, model.file, name), value);
  // From the end of the file to its beginning, so that places further up stay where they are.
  std::sort(places.begin(), places.end(), [](const auto& a, const auto& b) {
    const auto &p = a.first.begin, &q = b.first.begin;
    return p.line != q.line ? p.line > q.line : p.column > q.column;
  });
  std::vector<std::string> lines = split_lines(model.text);
  for (const auto& [place, value] : places) {
    std::string& line = lines[place.begin.line - 1];
    const std::size_t begin = byte_of(line, place.begin.column), end = byte_of(line, place.end.column);
    line.replace(begin, end - begin, written(value));
  }
  std::string edited;
  for (const std::string& line : lines) edited += line + "\n";
  return edited;
}

}  // namespace supine::pipeline
