// SPDX-License-Identifier: AGPL-3.0-or-later
#include "common/outputs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>

#include "common/error.h"

namespace supine {
namespace {

constexpr int max_registered = 256;
constexpr std::size_t max_path = 1024;

// Fixed storage: a signal handler may call unlink() but must not allocate or lock.
char registered_path[max_registered][max_path];
std::atomic<bool> registered_in_use[max_registered];

void register_temporary(const std::string& path) {
  if (path.size() >= max_path) throw InputError("output path is longer than 1023 characters: " + path);
  for (int i = 0; i < max_registered; ++i) {
    if (registered_in_use[i].load()) continue;
    std::strncpy(registered_path[i], path.c_str(), max_path - 1);
    registered_in_use[i].store(true);
    return;
  }
  throw Error("more than 256 output files at once");
}

void unregister_temporary(const std::string& path) {
  for (int i = 0; i < max_registered; ++i)
    if (registered_in_use[i].load() && path == registered_path[i]) registered_in_use[i].store(false);
}

/// Part files of a process that is gone, by kill or loss of power: nobody else removes them.
void remove_orphans(const std::filesystem::path& folder, const std::string& stem, const std::string& extension) {
  const std::string before = "." + stem + ".part";
  std::error_code failed;
  std::vector<std::filesystem::path> orphans;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(before) || !name.ends_with(extension)) continue;
    const std::string digits = name.substr(before.size(), name.size() - before.size() - extension.size());
    if (digits.empty() || digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos) continue;
    if (kill(static_cast<pid_t>(std::stol(digits)), 0) != 0 && errno == ESRCH) orphans.push_back(entry.path());
  }
  for (const auto& orphan : orphans) std::filesystem::remove(orphan, failed);
}

extern "C" void remove_temporaries_and_exit(int) {
  for (int i = 0; i < max_registered; ++i)
    if (registered_in_use[i].load()) unlink(registered_path[i]);
  constexpr char message[] = "\ninterrupted: nothing was left half-written; the same command starts again\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, message, sizeof message - 1);
  _exit(130);
}

}  // namespace

Outputs::~Outputs() {
  for (const auto& [temporary, target] : staged_) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    unregister_temporary(temporary.string());
  }
  for (auto folder = made_folders_.rbegin(); folder != made_folders_.rend(); ++folder) {
    std::error_code ignored;  // a folder that somebody has put something into stays
    std::filesystem::remove(*folder, ignored);
  }
}

std::filesystem::path Outputs::stage(const std::filesystem::path& target) {
  namespace fs = std::filesystem;
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  std::error_code failed;
  std::vector<fs::path> missing;
  for (fs::path at = folder; !at.empty() && !fs::exists(at); at = at.parent_path()) missing.push_back(at);
  made_folders_.insert(made_folders_.end(), missing.rbegin(), missing.rend());
  fs::create_directories(folder, failed);
  if (!fs::is_directory(folder))
    throw InputError("output folder " + folder.string() + " cannot be created" +
                     (failed ? ": " + failed.message() : std::string()) + "; choose another with -o");
  // A rename would put a plain file in the place of a device: of /dev/null, for the whole machine.
  if (fs::exists(target) && !fs::is_regular_file(target))
    throw InputError("output file " + target.string() + " is a folder, device or pipe, which no file may replace; " +
                     "choose another with -o");
  if (fs::exists(target) && !force_)
    throw InputError("output file " + target.string() + " exists; add --force to replace it or choose another with -o");

  remove_orphans(folder, target.stem().string(), target.extension().string());
  const fs::path temporary =
      folder / fmt::format(".{}.part{}{}", target.stem().string(), getpid(), target.extension().string());
  const int descriptor = open(temporary.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644);
  if (descriptor < 0)
    throw InputError("output folder " + folder.string() + " is not writable: " + std::strerror(errno) +
                     "; choose another with -o");
  close(descriptor);
  register_temporary(temporary.string());
  staged_.emplace_back(temporary, target);
  return temporary;
}

void Outputs::commit() {
  // Held back meanwhile: an interrupt must not leave a new file beside an old sidecar.
  sigset_t interrupts, before;
  sigemptyset(&interrupts);
  sigaddset(&interrupts, SIGINT);
  sigaddset(&interrupts, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &interrupts, &before);
  for (const auto& [temporary, target] : staged_) {
    std::filesystem::rename(temporary, target);
    unregister_temporary(temporary.string());
  }
  staged_.clear();
  made_folders_.clear();
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void install_interrupt_handler() {
  std::signal(SIGINT, remove_temporaries_and_exit);
  std::signal(SIGTERM, remove_temporaries_and_exit);
}

}  // namespace supine
