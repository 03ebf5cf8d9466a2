// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine {

#ifdef __has_feature
#define SUPINE_HAS_FEATURE(name) __has_feature(name)
#else
#define SUPINE_HAS_FEATURE(name) 0
#endif

/// Built with the address sanitizer: its operator new ends the process where it should throw std::bad_alloc.
constexpr bool under_address_sanitizer = SUPINE_HAS_FEATURE(address_sanitizer);

#undef SUPINE_HAS_FEATURE

}  // namespace supine
