// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "diagnosis/followed_sets.h"

namespace supine::diagnosis {

/// What is simpler by one effect than the likeliest set is followed once more from where that ended, where it came out
/// worse: it may have ended elsewhere because it began elsewhere, and the effect would be named for what any further
/// steps do. Again, as long as another set of two or more is the likeliest then.
/// @param looked_at  sets of which this was done
void follow_parts_of_first(FollowedSets& sets, std::vector<std::vector<int>>& looked_at);

/// "Nothing" is followed once more from where an effect by itself ended: a body that is soft may have moved on there by
/// what has no part in the effect. From the likeliest, where that came out better and nothing is not out of the
/// question yet; or from the one from which lines back to nothing promise most, where that is more than nothing was
/// found to be, however likely the effect is: its own numbers do not exclude that it is not there. Not twice from the
/// same place. Of both fits of nothing the likelier is kept.
void follow_nothing_again(FollowedSets& sets);

}  // namespace supine::diagnosis
