// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/random.h"

#include <cmath>
#include <numbers>

namespace supine::phantom {
namespace {

// FNV-1a over the stream's name, then the finaliser of SplitMix64, so that neighbouring seeds have nothing in common.
std::uint64_t mixed(std::uint64_t seed, std::string_view stream) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : stream) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  std::uint64_t z = hash ^ (seed * 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

Random::Random(std::uint64_t seed, std::string_view stream) : engine_(mixed(seed, stream)) {}

double Random::log_uniform(double lower, double upper) { return std::exp(uniform(std::log(lower), std::log(upper))); }

double Random::normal() {
  // Box and Muller; 1 - u is never 0.
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

}  // namespace supine::phantom
