// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace supine::pipeline {

/// A display without a screen, for as long as the object lives: starts Xvfb and points DISPLAY at it. Debian's VTK
/// draws through X alone; with a server of its own a picture comes out the same on a desktop, over ssh and in a
/// container. One at a time in a process.
class VirtualDisplay {
 public:
  /// @throws InputError  when Xvfb is not installed or does not start
  VirtualDisplay();
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;
  ~VirtualDisplay();

 private:
  int process_ = -1;
};

}  // namespace supine::pipeline
