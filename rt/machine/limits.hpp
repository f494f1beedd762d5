// SPDX-License-Identifier: Apache-2.0
// Which limit of the surroundings refused something, and how it is raised: the kernel says only "Resource temporarily
// unavailable".
//
//     try { composition = compose(...); }
//     catch (const std::exception& error) { refuse(machine::explain(error), kDeviceOrSystem); }
#pragma once
#include <cstdint>
#include <exception>
#include <optional>
#include <string>

#include "rt/machine/facts.hpp"

namespace takt::machine {

/// What limits count.
enum class Scarce : uint8_t { tasks, memory, files };

/// The limit on it that is reached, else the one most likely to be, with its value and the command that raises it:
/// "RLIMIT_NPROC 20 (ulimit -u; ...)". Empty if none is set. Any thread; reads files.
std::string limit_on(Scarce what, const Facts& facts = SystemFacts());

/// Bytes that are free below the memory limit of the control group; nothing if it has none.
std::optional<int64_t> memory_room(const Facts& facts = SystemFacts());
/// How many processes the kernel has killed in this control group since it has more than its memory; 0 if it does not
/// say.
int64_t memory_kills(const Facts& facts = SystemFacts());

/// Whether it says that tasks, memory or files ran out; nothing if it is something else.
std::optional<Scarce> scarce(const std::exception& error);
/// error.what(); where a limit may be behind it, which and how to raise it.
std::string explain(const std::exception& error, const Facts& facts = SystemFacts());
/// "WHAT: Too many open files (RLIMIT_NOFILE 8: ...)" of an error number.
std::string explain(const std::string& what, int error_number, const Facts& facts = SystemFacts());

/// This process is to go before others when the kernel must end one for memory: 0 as others, 1000 first. Who may not
/// say so stays as he is.
void go_first_without_memory(int score);

/// From now on an exception that leaves a thread is told, with the limit behind it, before the process ends: with exit
/// 3 where something ran out, else as ever.
void explain_what_nobody_catches();

}  // namespace takt::machine
