// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "phantom/causes/cause.h"

namespace supine::phantom {

using Fields = simulation::Fields<double>;

/// One kind of cause: how its numbers are drawn and what it does. A file of this folder makes one; nothing else has to
/// be told of it.
struct CauseKind {
  std::string name;
  bool outside = false;  ///< not in the catalogue
  std::vector<Draw> draws;
  /// Changes the fields of one pose, with regions and unevenness of its own instead of the catalogue's: a diagnosis is
  /// not to be tested on its own assumptions. Empty: no field is changed.
  std::function<void(const Cause&, const Stage&, Fields&)> apply = {};
  /// How much thicker the labels are drawn than the body is, mm along the skin's normal. Empty: not at all.
  std::function<double(const Cause&)> labels_grown_mm = {};
  /// Where the scan lies: its values are shift_x_mm … and turn_x_rad …, drawn anew for every scan but the supine one.
  bool moves_scan = false;
  /// Of its parameters, those that share a coordinate with a nuisance (nuisances.h), and which.
  std::map<std::string, std::string> nuisance = {};
};

/// Adds a kind; for objects with static storage, one per file. @return true
bool add_cause_kind(CauseKind kind);

/// @throws InputError  no such cause, listing those there are
const CauseKind& cause_kind(const std::string& name);

}  // namespace supine::phantom
