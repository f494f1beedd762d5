// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/terminal.hpp"

#include <asm/termbits.h>
#include <linux/serial.h>
#include <linux/tty_flags.h>
#include <sys/ioctl.h>

namespace takt {
namespace {

void put_baud(termios2& settings, uint32_t baud) {
  settings.c_cflag &= ~static_cast<tcflag_t>(CBAUD | (CBAUD << IBSHIFT));
  settings.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
  settings.c_ispeed = settings.c_ospeed = baud;
}

}  // namespace

bool set_raw(int fd, uint32_t baud) {
  termios2 settings{};
  if (ioctl(fd, TCGETS2, &settings) != 0) return false;
  settings.c_iflag = settings.c_oflag = settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  put_baud(settings, baud);
  return ioctl(fd, TCSETS2, &settings) == 0;
}

void set_terminal_baud(int fd, uint32_t baud) {
  termios2 settings{};
  if (ioctl(fd, TCGETS2, &settings) != 0) return;
  put_baud(settings, baud);
  ioctl(fd, TCSETS2, &settings);
  ioctl(fd, TCFLSH, TCIFLUSH);
}

uint32_t terminal_baud(int fd) {
  termios2 settings{};
  return ioctl(fd, TCGETS2, &settings) == 0 ? settings.c_ospeed : 0;
}

void make_prompt(int fd) {
  serial_struct port{};
  if (ioctl(fd, TIOCGSERIAL, &port) != 0) return;
  port.flags |= ASYNC_LOW_LATENCY;
  port.closing_wait = 10;  // hundredths of a second
  ioctl(fd, TIOCSSERIAL, &port);
}

}  // namespace takt
