// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/pseudo_terminal.hpp"

#include <fcntl.h>
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "hal/stream/terminal.hpp"

namespace takt {

DeviceResult PseudoTerminal::open() {
  close();
  char slave[64];
  master_ = Descriptor(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!master_ || grantpt(master_.get()) != 0 || unlockpt(master_.get()) != 0 ||
      ptsname_r(master_.get(), slave, sizeof slave) != 0) {
    const int error = errno;
    master_.close();
    return device_failure(path_.string(), std::string("no pseudo terminal: ") + std::strerror(error),
                          "is /dev/pts mounted?");
  }
  set_raw(master_.get(), 9600);  // or the terminal would echo until a driver opens it
  std::error_code error;
  if (std::filesystem::is_symlink(path_, error)) std::filesystem::remove(path_, error);
  std::filesystem::create_symlink(slave, path_, error);
  if (!error) return {};
  master_.close();
  return device_error(path_.string(), "cannot be made a link to a terminal: " + error.message(),
                      "choose a path that does not exist, in a folder of yours");
}

void PseudoTerminal::close() {
  if (!master_) return;
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  master_.close();
}

/// The master of a terminal that nobody has open fails with EIO: the device is there all the same.
std::optional<size_t> PseudoTerminal::read(std::span<uint8_t> into) {
  if (!master_) return std::nullopt;
  return master_.read(into).value_or(0);
}

std::optional<size_t> PseudoTerminal::write(std::span<const uint8_t> bytes) {
  if (!master_) return std::nullopt;
  return master_.write(bytes).value_or(0);
}

uint32_t PseudoTerminal::baud() const { return terminal_baud(master_.get()); }

}  // namespace takt
