// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "diagnosis/followed_sets.h"

namespace supine::diagnosis {

/// Measures errors of mesh and body beside what is sure, as long as that is something new and more beside it is
/// likelier than not, and follows again what holds it (follow.h). What is sure counts for less where, under these
/// errors, it leads what lacks it by less than it did.
void look_beside(FollowedSets& sets);

/// The likeliest set is followed without an effect of it that does nothing there, and what was measured beside that is
/// dropped. @return  whether there was one
bool do_without_idle(FollowedSets& sets);

}  // namespace supine::diagnosis
