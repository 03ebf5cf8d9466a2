// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace supine {

/// Base of every error the libraries throw. Only a tool's main catches it.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller's data or options are wrong: a file, key, label, value or place is at fault.
/// The message says what, where (file, key, label, element, mm), the value, the bound and what to do.
/// Tools end with exit code 2.
class InputError : public Error {
 public:
  using Error::Error;
};

/// The input is valid but no solution was found: no equilibrium, an inverted element, a singular system.
/// The message names how far it came, where it stopped and what to change. Tools end with exit code 3.
class NumericalFailure : public Error {
 public:
  using Error::Error;
};

}  // namespace supine
