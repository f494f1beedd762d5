// SPDX-License-Identifier: Apache-2.0
#include "hal/interaction/espeak.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>
#include <vector>

#include "hal/interaction/voice_double.hpp"

namespace takt {
namespace {

constexpr std::chrono::milliseconds kLook{5};

/// A file in memory that holds `text`, at its beginning.
Descriptor in_memory(std::string_view text) {
  Descriptor file(memfd_create("takt-speech", MFD_CLOEXEC));
  if (file && ::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) file.close();
  if (file) lseek(file.get(), 0, SEEK_SET);
  return file;
}

std::vector<uint8_t> contents(const Descriptor& file) {
  std::vector<uint8_t> all(static_cast<size_t>(std::max<off_t>(0, lseek(file.get(), 0, SEEK_END))));
  size_t read = 0;
  while (read < all.size()) {
    const ssize_t got = pread(file.get(), all.data() + read, all.size() - read, static_cast<off_t>(read));
    if (got <= 0) break;
    read += static_cast<size_t>(got);
  }
  all.resize(read);
  return all;
}

/// A program that has ended.
struct Ran {
  std::string problem;  ///< empty: it did what it was to do
  std::vector<uint8_t> printed;
};

/// What the program itself complains about; libraries below it name theirs differently.
std::string complaint(std::span<const uint8_t> told) {
  const std::string_view all(reinterpret_cast<const char*>(told.data()), told.size());
  for (size_t at = 0; at < all.size();) {
    const std::string_view line = all.substr(at, all.find('\n', at) - at);
    if (line.starts_with("error") || line.starts_with("Error")) return std::string(line);
    at += line.size() + 1;
  }
  return "";
}

/// A group of its own, so that Ctrl-C does not end a word; no descriptor of the run, no blocked or ignored signal.
pid_t spawn(const std::vector<std::string>& words, const std::array<int, 3>& ends, int& error) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (int end = 0; end < 3; ++end) posix_spawn_file_actions_adddup2(&files, ends[static_cast<size_t>(end)], end);
  posix_spawn_file_actions_addclosefrom_np(&files, 3);
  posix_spawnattr_t how;
  posix_spawnattr_init(&how);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&how, &none);
  posix_spawnattr_setsigdefault(&how, &all);
  posix_spawnattr_setpgroup(&how, 0);
  posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  pid_t child = -1;
  error = posix_spawn(&child, words.front().c_str(), &files, &how, arguments.data(), environ);
  posix_spawnattr_destroy(&how);
  posix_spawn_file_actions_destroy(&files);
  return error == 0 ? child : -1;
}

/// Its status once it has ended; killed when `go_on` is false.
int wait_for(pid_t child, const std::function<bool()>& go_on) {
  int status = 0;
  for (pid_t ended = 0; ended == 0;) {
    ended = waitpid(child, &status, WNOHANG);
    if (ended < 0 && errno == EINTR) ended = 0;
    if (ended != 0) return ended < 0 ? 0 : status;
    if (!go_on()) kill(child, SIGKILL);
    std::this_thread::sleep_for(kLook);
  }
  return status;
}

Ran run(const std::vector<std::string>& words, std::string_view input, const std::function<bool()>& go_on) {
  const Descriptor in = in_memory(input), out = in_memory(""), told = in_memory("");
  if (!in || !out || !told) return {std::string("no memory for a sentence: ") + std::strerror(errno), {}};
  int error = 0;
  const pid_t child = spawn(words, {in.get(), out.get(), told.get()}, error);
  if (child < 0) return {words.front() + ": " + std::strerror(error), {}};
  const int status = wait_for(child, go_on);
  Ran ran{complaint(contents(told)), contents(out)};
  // Without a sound card it complains, and ends with 0 all the same.
  if (WIFSIGNALED(status)) ran.problem = words.front() + " was ended by signal " + std::to_string(WTERMSIG(status));
  else if (!ran.problem.empty()) ran.problem = words.front() + ": " + ran.problem;
  else if (WEXITSTATUS(status) != 0) ran.problem = words.front() + " ended with " + std::to_string(WEXITSTATUS(status));
  return ran;
}

}  // namespace

DeviceResult EspeakVoice::open() {
  if (checked_) return {};
  const std::string program = settings_.program.string();
  if (access(program.c_str(), X_OK) != 0)
    return device_failure(id_, "`speech: espeak-ng`: " + program + ": " + std::strerror(errno),
                          "apt install espeak-ng");
  if (!settings_.file.empty())
    if (auto file = check_speech_file(id_, settings_.file); !file) return file;
  const Ran ran = run({program, "-v", settings_.voice, "-q", "--stdin"}, "", [] { return true; });
  if (!ran.problem.empty())
    return device_error(id_, "`voice` is " + settings_.voice + ": " + ran.problem,
                        "give one of the names in the column Language of espeak-ng --voices");
  checked_ = true;
  return {};
}

bool EspeakVoice::start(bool goes_on) {
  if (settings_.file.empty() || file_.open(settings_.file, goes_on)) return true;
  problem_ = file_.problem();
  return false;
}

bool EspeakVoice::speak(const Sentence& sentence, const std::function<bool()>& go_on) {
  std::vector<std::string> words{
      settings_.program.string(), "-v", settings_.voice, "-s", std::to_string(settings_.words_per_minute), "--stdin"};
  if (!settings_.file.empty()) words.emplace_back("--stdout");
  const Ran ran = run(words, sentence.text + "\n", go_on);
  problem_ = ran.problem;
  if (!problem_.empty() || settings_.file.empty()) return problem_.empty();
  const auto sound = sound_in(ran.printed);
  if (!sound) problem_ = words.front() + " gave no WAV file";
  else if (!file_.add(*sound)) problem_ = file_.problem();
  return problem_.empty();
}

}  // namespace takt
