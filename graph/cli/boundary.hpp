// SPDX-License-Identifier: Apache-2.0
// What stands between a program and the system around it: all of main() goes through here.
//
//   int main(int argc, char** argv) {
//     return takt::command::at_boundary(argc, argv, [&] { return run(argc, argv); });
//   }
#pragma once
#include <cstdint>
#include <exception>
#include <functional>

namespace takt::command {

/// Runs `body` and returns the exit code. Once a process, before any thread is made.
///
/// - A closed stdin, stdout or stderr leads to /dev/null from now on. Else the next file or device to be opened would
///   get its number, and with it what is printed.
/// - SIGPIPE and SIGXFSZ end nothing any more: the write fails with EPIPE or EFBIG, as on a full disk. Programs that
///   are started from here get back what this one found.
/// - What stderr does not take is counted (unsaid_lines()), in this process and those forked from it.
/// - An exception ends the command with one line that says what failed in which command, and exit code 2 or 3.
/// - What stdout did not take makes exit code 0 a 3. A reader that has gone (`| head`) wanted no more.
int at_boundary(int argc, char** argv, const std::function<int()>& body);

/// For the end of what stands for main() in another process, which at_boundary() has for its own: writes out what
/// stdout still holds. The code again, or, where stdout could not take all, the reason on stderr and kDeviceOrSystem
/// for kOk.
int with_output(int code);
/// Has `ended` called by each with_output() of this process: a process that ends without it did not end by itself.
void at_end(void (*ended)());

/// Lines for stderr that nobody could read: its reader has gone, its disk is full.
uint64_t unsaid_lines();

/// Whether the reader of stdout has gone. Commands that print until they are stopped end then.
bool output_gone();

/// Writes what was thrown to stderr and returns the exit code. What a library throws names no file: then the command
/// line stands in front of it.
int refuse(const std::exception& error);

}  // namespace takt::command
