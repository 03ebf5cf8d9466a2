// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

/// The laws of W(I1, I2, ln det F), a line each: name in model.toml, struct in laws/NAME.h. The enumerators of BulkLaw,
/// the names and the dispatch are made from these lines.
#define SUPINE_INVARIANT_LAWS(LAW) \
  LAW(neo_hookean, NeoHookean)     \
  LAW(mooney_rivlin, MooneyRivlin) \
  LAW(yeoh, Yeoh)                  \
  LAW(gent, Gent)                  \
  LAW(neo_hookean_calculix, NeoHookeanCalculix)
