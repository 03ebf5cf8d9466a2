// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/followed_sets.h"

namespace supine::diagnosis {

/// Measures errors of mesh and body beside what is sure, as long as that is something new and more beside it is
/// likelier than not, and follows again what holds it (follow.h).
void look_beside(FollowedSets& sets);

/// What is simpler by one effect than the likeliest set is followed once more from where that ended, where it came out
/// worse: it may have ended elsewhere because it began elsewhere, and the effect would be named for what any further
/// steps do. Again, as long as another set of two or more is the likeliest then.
/// @param looked_at  sets of which this was done
void follow_parts_of_first(FollowedSets& sets, std::vector<std::vector<int>>& looked_at);

/// The likeliest set is followed without an effect of it that does nothing there, and what was measured beside that is
/// dropped. @return  whether there was one
bool do_without_idle(FollowedSets& sets);

}  // namespace supine::diagnosis
