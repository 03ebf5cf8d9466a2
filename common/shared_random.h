// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <mutex>

namespace supine {

/// Held around calls of libraries that draw from the C library's one rand() (METIS, TetGen). Each seeds it anew by
/// every call; two at a time would draw from each other's numbers, and orderings and meshes, so the last digits of
/// every answer, would depend on chance.
inline std::mutex shared_random;

}  // namespace supine
