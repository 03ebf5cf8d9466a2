// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/picture/virtual_display.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "common/error.h"

namespace supine::pipeline {
namespace {

[[noreturn]] void become_server(int report) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);  // it must not outlive the tool, however that ends
  const int nowhere = open("/dev/null", O_RDWR);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  const std::string descriptor = std::to_string(report);
  execlp("Xvfb", "Xvfb", "-displayfd", descriptor.c_str(), "-screen", "0", "64x64x24", "-nolisten", "tcp", "-noreset",
         static_cast<char*>(nullptr));
  _exit(127);
}

/// What the server writes once it is ready; empty when it ends before.
std::string first_line(int descriptor) {
  std::string line;
  for (char c = 0; read(descriptor, &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

}  // namespace

VirtualDisplay::VirtualDisplay() {
  int report[2];
  if (pipe(report) != 0) throw InputError("--png: no pipe to Xvfb; too many open files?");
  fcntl(report[0], F_SETFD, FD_CLOEXEC);
  process_ = fork();
  if (process_ == 0) become_server(report[1]);
  close(report[1]);
  const std::string number = first_line(report[0]);
  close(report[0]);
  if (number.empty()) {
    if (process_ > 0) waitpid(process_, nullptr, 0);
    throw InputError(
        "--png draws on a virtual screen and Xvfb does not start: apt-get install xvfb libgl1-mesa-dri, or leave --png "
        "out");
  }
  setenv("DISPLAY", (":" + number).c_str(), 1);
  setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
}

VirtualDisplay::~VirtualDisplay() {
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
}

}  // namespace supine::pipeline
