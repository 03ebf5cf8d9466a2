// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/trial_process.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <fstream>
#include <new>
#include <stdexcept>

#include "common/error.h"

namespace supine {
namespace {

constexpr unsigned longest_s = 300;

constexpr int asked_too_much = 3, threw = 4;

/// Room for what a file of that size may hold, compressed many times over: a damaged count asks for far more.
rlimit room_for(const std::filesystem::path& file) {
  constexpr rlim_t room_bytes = rlim_t{4} << 30;
  constexpr rlim_t per_byte = 100;
  std::error_code none;
  const auto size = static_cast<rlim_t>(std::filesystem::file_size(file, none));
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t all =
      pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + room_bytes + per_byte * (none ? rlim_t{0} : size);
  return {all, all};
}

[[noreturn]] void run_silently(const std::filesystem::path& file, const std::function<void()>& read) {
  const int nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  const rlimit room = room_for(file);
  setrlimit(RLIMIT_AS, &room);
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  alarm(longest_s);
  try {
    read();
  } catch (const InputError&) {
    // an answer, which whoever reads again meets
  } catch (const std::bad_alloc&) {
    _exit(asked_too_much);
  } catch (const std::length_error&) {  // a container that no memory could hold
    _exit(asked_too_much);
  } catch (...) {  // a library that trusted the file
    _exit(threw);
  }
  _exit(0);  // what the parent has open and buffered is the parent's
}

}  // namespace

void check_survivable(const std::filesystem::path& file, const std::function<void()>& read) {
  const pid_t child = fork();
  if (child < 0) return;  // no process to be had: the reader itself will have to do
  if (child == 0) run_silently(file, read);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == asked_too_much)
    throw InputError(fmt::format(
        "{}: damaged: its counts ask for more memory than a file of its size can fill; copy or write the file again",
        file.string()));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  throw InputError(
      WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM
          ? fmt::format("{}: damaged: reading it does not end in {} s; copy or write the file again", file.string(),
                        longest_s)
          : fmt::format("{}: damaged: its reader is brought down by it; copy or write the file again", file.string()));
}

}  // namespace supine
