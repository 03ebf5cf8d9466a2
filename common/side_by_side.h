// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

namespace supine {

/// Does all of @p works, at the same time as far as threads are free: where a parallel loop is under way, its threads
/// that have come to its end help. Returns when all are done.
/// @pre  none needs what another one makes
/// @throws what the first in the list of those that failed has thrown: the same one for any number of threads
void side_by_side(const std::vector<std::function<void()>>& works);

}  // namespace supine
