// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <random>
#include <string_view>

namespace supine::phantom {

/// Random numbers of one purpose: each stream has its own sequence, so that what is drawn for one (the noise, say) does
/// not depend on how much was drawn for another. The same on every machine, unlike the standard library's
/// distributions.
class Random {
 public:
  Random(std::uint64_t seed, std::string_view stream);

  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  ///< in [0, 1)
  double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }
  double log_uniform(double lower, double upper);
  double normal();  ///< mean 0, standard deviation 1
  double sign() { return uniform() < 0.5 ? -1 : 1; }
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(uniform() * static_cast<double>(count)); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace supine::phantom
