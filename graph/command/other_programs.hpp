// SPDX-License-Identifier: Apache-2.0
// `takt NAME` for a NAME that the program does not have itself: it becomes the program takt-NAME, as git does.
//
//   $ takt eval stereo --scene DIR        # is: takt-eval stereo --scene DIR
//
// takt-NAME is looked for in libexec/takt of the installation, then beside this program, then in PATH.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace takt::command {

/// A command of Takt that is a program of its own: no run needs it, so nobody waits for it to be built.
struct DeskCommand {
  const char *name, *what, *target;
};
/// For the help; that the program is there is not sure.
std::span<const DeskCommand> desk_commands();

/// Becomes takt-NAME, where NAME is `arguments[1]`, with the arguments behind it. Returns only where that fails: the
/// exit code, once the error is on stderr. 2: nothing is called NAME; the error names the nearest of `own` and of the
/// desk commands. 3: a desk command is not built, or the program cannot be started.
int become_other_program(char** arguments, std::vector<std::string> own);

}  // namespace takt::command
