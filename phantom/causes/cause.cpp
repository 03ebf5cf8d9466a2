// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "phantom/causes/cause_kind.h"
#include "phantom/random.h"
#include "simulation/catalogue.h"

namespace supine::phantom {
namespace {

using How = Draw::How;

std::vector<CauseKind>& kinds() {
  static std::vector<CauseKind> all;
  return all;
}

/// Those of the catalogue in its order, those outside it by name: files are linked in no order of their own.
std::vector<std::string> names(bool outside) {
  const auto& catalogue = simulation::catalogue();
  const auto rank = [&catalogue](const std::string& name) {
    return std::find_if(catalogue.begin(), catalogue.end(), [&name](const auto* e) { return e->name() == name; }) -
           catalogue.begin();
  };
  std::vector<std::string> found;
  for (const CauseKind& kind : kinds())
    if (kind.outside == outside) found.push_back(kind.name);
  std::sort(found.begin(), found.end(), [&rank](const std::string& a, const std::string& b) {
    return std::pair(rank(a), a) < std::pair(rank(b), b);
  });
  return found;
}

/// Strengths that are somewhere in a range.
double within(const Draw& draw, double share) {
  if (draw.how == How::log_uniform) return draw.lower * std::pow(draw.upper / draw.lower, share);
  return draw.lower + share * (draw.upper - draw.lower);
}

double drawn(const Draw& draw, Random& random, std::optional<double> size) {
  if (size) {
    const double sign = draw.how == How::either_sign ? random.sign() : 1;
    random.uniform();  // so that what follows is as without a size
    return sign * within(draw, *size);
  }
  switch (draw.how) {
    case How::uniform:
      return random.uniform(draw.lower, draw.upper);
    case How::log_uniform:
      return random.log_uniform(draw.lower, draw.upper);
    case How::either_sign:
      return random.sign() * random.uniform(draw.lower, draw.upper);
    default: {
      const double z = random.normal();
      return draw.upper * std::clamp(z, -2.0, 2.0);
    }
  }
}

}  // namespace

bool add_cause_kind(CauseKind kind) {
  kinds().push_back(std::move(kind));
  return true;
}

const CauseKind& cause_kind(const std::string& name) {
  for (const CauseKind& kind : kinds())
    if (kind.name == name) return kind;
  throw InputError(fmt::format("there is no cause '{}'; --effect: {}, null; --outside: {}", name,
                               fmt::join(names(false), ", "), fmt::join(names(true), ", ")));
}

std::vector<std::string> catalogue_causes() { return names(false); }
std::vector<std::string> outside_causes() { return names(true); }

const std::vector<Draw>& draws_of(const std::string& name) { return cause_kind(name).draws; }

Cause draw_cause(const std::string& name, std::uint64_t seed, std::optional<double> size) {
  const CauseKind& kind = cause_kind(name);
  if (size && kind.draws.front().how == How::spread)
    throw InputError(
        fmt::format("the size of '{}' is normal and has no range: leave the size out, or the cause", name));
  Random random(seed, name);
  Cause cause{.name = name, .outside = kind.outside};
  for (std::size_t i = 0; i < kind.draws.size(); ++i) {
    const Draw& draw = kind.draws[i];
    auto& target = draw.of_place ? cause.place : cause.values;
    if (draw.how != How::direction) {
      target[draw.name] = drawn(draw, random, i == 0 ? size : std::nullopt);
      continue;
    }
    const double chosen = random.uniform(draw.lower, draw.upper), length = size ? within(draw, *size) : chosen;
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    target[draw.name] = length * std::cos(angle);
    target[kind.draws.at(++i).name] = length * std::sin(angle);
  }
  return cause;
}

void apply_cause(const Cause& cause, const Stage& stage, Fields& fields) {
  const CauseKind& kind = cause_kind(cause.name);
  if (kind.apply) kind.apply(cause, stage, fields);
}

}  // namespace supine::phantom
