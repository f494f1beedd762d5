// SPDX-License-Identifier: Apache-2.0
// A POSIX shell that is asked line by line, on another machine over one connection of ssh, or on this one.
//
//   auto robot = RemoteShell::over("ssh", "user@robot");
//   robot->say("stat -c %s " + shell_word(file));
//   if (const auto size = robot->line()) ...
#pragma once
#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace takt::flight {

/// One word for a POSIX shell, whatever is in it.
std::string shell_word(std::string_view text);

/// What the shell prints on stderr goes to stderr of this process. One thread at a time.
class RemoteShell {
 public:
  /// On this machine. Error: it cannot be started.
  static tl::expected<RemoteShell, std::string> here();
  /// `ssh`: a program and its options, as a shell reads them; it gets the host and the command as ssh does. Error:
  /// nothing could be started; a host that does not answer ends the shell.
  static tl::expected<RemoteShell, std::string> over(const std::string& ssh, const std::string& host);
  RemoteShell(RemoteShell&& other) noexcept;
  RemoteShell& operator=(RemoteShell&&) = delete;
  /// Ends it.
  ~RemoteShell();

  /// Reading ends, as if the shell had, soon after this answers true.
  void stop_when(std::function<bool()> stopped) { stopped_ = std::move(stopped); }
  /// Gives it a line of script. That it has ended shows in what is read.
  void say(std::string_view script);
  /// Its next line, without the end. Nothing: the shell has ended, or reading has.
  std::optional<std::string> line();
  /// Some of the next bytes; 0 as above.
  size_t read(std::span<std::byte> into);
  /// Ends it: exit code of the program, 128 and the signal that ended it.
  int end();

 private:
  RemoteShell(pid_t process, int to, int from) : process_(process), to_(to), from_(from) {}
  static tl::expected<RemoteShell, std::string> start(const std::vector<std::string>& words);
  bool fill();

  pid_t process_;
  int to_, from_;
  std::function<bool()> stopped_;
  std::vector<std::byte> buffer_;
  size_t taken_ = 0;  ///< of the buffer
};

}  // namespace takt::flight
