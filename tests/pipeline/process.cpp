// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/pipeline/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <stdexcept>

namespace supine::pipeline {
namespace {

[[noreturn]] void become(const std::vector<std::string>& command, const int out[2], const int err[2]) {
  setpgid(0, 0);
  dup2(out[1], STDOUT_FILENO);
  dup2(err[1], STDERR_FILENO);
  for (const int descriptor : {out[0], out[1], err[0], err[1]}) close(descriptor);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  _exit(127);
}

/// Appends what is there; false at the end of the stream.
bool drain(int descriptor, std::string& text) {
  char buffer[4096];
  const ssize_t count = read(descriptor, buffer, sizeof buffer);
  if (count > 0) text.append(buffer, static_cast<std::size_t>(count));
  return count > 0;
}

}  // namespace

Finished run_process(const std::vector<std::string>& command, const std::string& interrupt_after) {
  int out[2], err[2];
  if (pipe(out) != 0 || pipe(err) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child == 0) become(command, out, err);
  setpgid(child, child);
  close(out[1]);
  close(err[1]);
  Finished result;
  bool interrupted = interrupt_after.empty();
  pollfd streams[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
  while (streams[0].fd >= 0 || streams[1].fd >= 0) {
    poll(streams, 2, -1);
    for (int s = 0; s < 2; ++s)
      if (streams[s].fd >= 0 && streams[s].revents != 0 && !drain(streams[s].fd, s == 0 ? result.out : result.err)) {
        close(streams[s].fd);
        streams[s].fd = -1;
      }
    if (!interrupted && result.out.find(interrupt_after) != std::string::npos) {
      kill(-child, SIGINT);
      interrupted = true;
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

std::string tool(const std::string& name) { return std::string(SUPINE_BIN_DIR) + "/supine-" + name; }

std::vector<std::string> files_in(const std::filesystem::path& folder) {
  std::vector<std::string> files;
  if (!std::filesystem::exists(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path().lexically_relative(folder).string());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace supine::pipeline
