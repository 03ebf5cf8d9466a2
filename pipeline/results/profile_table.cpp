// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/results/profile_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <string_view>

#include "common/error.h"
#include "common/suggestion.h"

namespace supine::pipeline {
namespace {

constexpr std::string_view header = "parameter,low,high,runs";

/// Takes the number up to the next comma, or the end, off the text. @return false where there is none
template <class Number>
bool take(std::string_view& text, Number& number) {
  const auto [stopped, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failed != std::errc{}) return false;
  text.remove_prefix(static_cast<std::size_t>(stopped - text.data()));
  if (text.empty()) return true;
  if (text.front() != ',') return false;
  text.remove_prefix(1);
  return true;
}

}  // namespace

void write_profiles(const Profiles& profiles, std::ostream& stream) {
  stream << header << "\n";
  for (const auto& [name, profile] : profiles)
    stream << fmt::format("{},{},{},{}\n", name, profile.interval.low, profile.interval.high, profile.runs);
  if (!stream.flush()) throw InputError("writing profiles.csv failed; check the free space on the disk");
}

Profiles read_profiles(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) throw InputError(fmt::format("cannot read {}", file.string()));
  std::string line;
  int number = 1;
  const auto refuse = [&] {
    throw InputError(fmt::format("{}:{}: must be {}, as supine-calibrate --profile-of writes it", file.string(), number,
                                 number == 1 ? std::string(header) : "a row of " + std::string(header)));
  };
  if (!std::getline(stream, line) || line != header) refuse();
  Profiles profiles;
  for (++number; std::getline(stream, line); ++number) {
    const std::size_t comma = line.find(',');
    if (comma == std::string::npos) refuse();
    std::string_view rest = std::string_view(line).substr(comma + 1);
    calibration::Profile profile;
    if (!take(rest, profile.interval.low) || !take(rest, profile.interval.high) || !take(rest, profile.runs) ||
        !rest.empty())
      refuse();
    profiles[line.substr(0, comma)] = profile;
  }
  return profiles;
}

Profiles merge_profiles(const std::vector<std::pair<std::filesystem::path, Profiles>>& parts,
                        const std::vector<std::string>& parameters) {
  Profiles merged;
  for (const auto& [file, profiles] : parts)
    for (const auto& [name, profile] : profiles) {
      if (std::find(parameters.begin(), parameters.end(), name) == parameters.end())
        throw InputError(
            fmt::format("{}: {} is no free number of the model; it has {}", file.string(), name, listed(parameters)));
      if (!merged.emplace(name, profile).second)
        throw InputError(fmt::format("{}: {} is in another part too", file.string(), name));
    }
  for (const std::string& name : parameters)
    if (!merged.contains(name))
      throw InputError(fmt::format("{} is in no part; make it with --profile-of {}", name, name));
  return merged;
}

}  // namespace supine::pipeline
