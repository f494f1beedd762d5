// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/serial_port.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>

#include "hal/stream/terminal.hpp"

namespace takt {
namespace {

constexpr uint32_t kFirstBaud = 9600;

const char* fix_for(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO: return "plug the device in; `ls /dev/serial/by-id` lists what is there";
    case EACCES: return "join the group that owns it: `sudo usermod -aG dialout $USER`, then log in again";
    case EBUSY: return "end the program that has it; `fuser -v` on the path names it";
    default: return "name a serial line, for instance /dev/ttyUSB0";
  }
}

}  // namespace

DeviceResult SerialPort::open() {
  port_.close();
  const auto refused = [this](int error) {
    port_.close();
    return device_failure(id_, path_.string() + ": " + std::strerror(error), fix_for(error));
  };
  port_ = Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!port_) return refused(errno);
  if (!set_raw(port_.get(), kFirstBaud)) return refused(ENOTTY);
  // Unlike TIOCEXCL this keeps out root as well, and ends with the descriptor.
  if (flock(port_.get(), LOCK_EX | LOCK_NB) != 0) return refused(EBUSY);
  make_prompt(port_.get());
  set_terminal_baud(port_.get(), kFirstBaud);  // and forgets what came before
  return {};
}

void SerialPort::set_baud(uint32_t baud) { set_terminal_baud(port_.get(), baud); }

uint32_t SerialPort::baud() const { return terminal_baud(port_.get()); }

}  // namespace takt
