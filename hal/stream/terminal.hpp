// SPDX-License-Identifier: Apache-2.0
// Settings of terminals through termios2, which knows rates that the C library has no name for.
#pragma once
#include <cstdint>

namespace takt {

/// Bytes as they are, 8 data bits, no parity, no flow control (scans hold XON and XOFF); a read without data says so,
/// so that an empty one can only mean that the line was hung up. False: it is no terminal.
bool set_raw(int fd, uint32_t baud);
/// Asks for a rate and forgets what has arrived. No kernel refuses one: terminal_baud() tells what the driver made of
/// it.
void set_terminal_baud(int fd, uint32_t baud);
/// Of a pseudo terminal's master: the rate of the other side. 0: unknown.
uint32_t terminal_baud(int fd);
/// USB adapters then hand over bytes after 1 ms instead of 16, and closing waits 0.1 s instead of 30 for bytes that a
/// dead adapter does not take. No effect where the driver knows no such thing.
void make_prompt(int fd);

}  // namespace takt
