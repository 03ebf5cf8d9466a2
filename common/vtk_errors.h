// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vtkCallbackCommand.h>
#include <vtkNew.h>

#include <string>

class vtkAlgorithm;

namespace supine {

/// Keeps what an algorithm of VTK, and the objects it works with, would print of errors, for an error message, as long
/// as the object lives. One at a time.
class VtkErrors {
 public:
  explicit VtkErrors(vtkAlgorithm& algorithm);
  VtkErrors(const VtkErrors&) = delete;
  VtkErrors& operator=(const VtkErrors&) = delete;
  ~VtkErrors();

  /// Whether it complained, or ended with an error code.
  bool any() const;

  /// Its first complaint in one line, without the place in VTK's sources.
  std::string text() const;

 private:
  vtkAlgorithm& algorithm_;
  std::string message_;
  vtkNew<vtkCallbackCommand> command_;
  int verbosity_;
};

}  // namespace supine
