// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/causes/cause_kind.h"

namespace supine::phantom {
namespace {

const bool known = add_cause_kind({.name = "misregistration",
                                   .draws = {{"shift_x_mm", Draw::How::spread, 0, 2.5},
                                             {"shift_y_mm", Draw::How::spread, 0, 2.5},
                                             {"shift_z_mm", Draw::How::spread, 0, 2.5},
                                             {"turn_x_rad", Draw::How::spread, 0, 0.035},
                                             {"turn_y_rad", Draw::How::spread, 0, 0.035},
                                             {"turn_z_rad", Draw::How::spread, 0, 0.035}},
                                   .moves_scan = true,
                                   .nuisance = {{"shift_x_mm", "shift_x_mm"},
                                                {"shift_y_mm", "shift_y_mm"},
                                                {"shift_z_mm", "shift_z_mm"},
                                                {"turn_x_rad", "turn_x_rad"},
                                                {"turn_y_rad", "turn_y_rad"},
                                                {"turn_z_rad", "turn_z_rad"}}});

}  // namespace
}  // namespace supine::phantom
