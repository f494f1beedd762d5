// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace takt::command {

/// Exit codes of every takt command.
enum Exit : int { kOk = 0, kNotOk = 1, kBadInput = 2, kDeviceOrSystem = 3 };

/// Writes one error to stderr and returns the code.
int refuse(const std::string& text, Exit code);

/// For the begin of main: a closed stdin, stdout or stderr leads to /dev/null from now on. Else the next file or device
/// to be opened would get its number, and with it what is printed.
void hold_standard_streams();

/// For the end of main, or of what stands for it in another process: writes out what stdout still holds. The code
/// again, or, where stdout could not take all (a full disk), the reason on stderr and kDeviceOrSystem instead of kOk. A
/// reader that has gone (`| head`) wanted no more.
int with_output(int code);

/// Has `ended` called by each with_output() of this process: a process that ends without it did not end by itself.
void at_end(void (*ended)());

/// A file or folder that Takt ships with (graph/language/share.hpp).
std::filesystem::path shipped(const std::filesystem::path& relative);

}  // namespace takt::command
