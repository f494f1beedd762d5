// SPDX-License-Identifier: Apache-2.0
// The terminal of `takt top`: taken at the beginning, given back at the end, however it comes.
//
//   Terminal terminal;
//   while (!terminal.ended()) wait(terminal), terminal.write(bytes);
#pragma once
#include <string_view>

#include "graph/command/top/text.hpp"

namespace takt::top {

/// While it lives, stdout shows the alternate screen and stdin gives single keys. One at a time, on one thread.
///
/// - SIGINT, SIGTERM and SIGHUP are noted; ended() is true then. A second one gives the terminal back and ends the
///   process.
/// - A signal that ends the process at once (SIGQUIT, SIGABRT, SIGSEGV and its kind) gives the terminal back first.
/// - SIGWINCH and SIGTSTP are noted.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  Size size() const;
  /// stdin gives keys; false: it is no terminal.
  bool keys() const { return keys_; }
  /// For poll(2): readable once a signal came. heard() empties it.
  int signals() const;
  void heard();
  /// The signal that wants an end; 0: none.
  static int ended();
  /// Whether a signal wants the process suspended; asked once.
  static bool suspension_asked();
  /// Gives the terminal back, suspends the process, and takes the terminal again when it goes on.
  void suspend();
  /// False if nobody can see it any more.
  bool write(std::string_view bytes);

 private:
  void take();
  void handle_signals();
  bool keys_ = false;
};

/// Of the environment: colours unless NO_COLOR or TERM=dumb, UTF-8 by LC_ALL, LC_CTYPE or LANG.
Look look_of_environment();

}  // namespace takt::top
