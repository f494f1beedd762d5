// SPDX-License-Identifier: Apache-2.0
#include "rt/supervise/watchdog_device.hpp"

#include <fcntl.h>
#include <linux/watchdog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace takt {
namespace {

class KernelWatchdogPort final : public WatchdogPort {
 public:
  ~KernelWatchdogPort() override { close(); }
  int open(const std::filesystem::path& file) override {
    descriptor_ = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    return descriptor_ < 0 ? errno : 0;
  }
  int set_timeout(int& seconds) override { return ioctl(descriptor_, WDIOC_SETTIMEOUT, &seconds) < 0 ? errno : 0; }
  int keep_alive() override { return ioctl(descriptor_, WDIOC_KEEPALIVE, nullptr) < 0 ? errno : 0; }
  int write_magic_close() override { return write(descriptor_, "V", 1) == 1 ? 0 : errno; }
  void close() override {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
  }

 private:
  int descriptor_ = -1;
};

const char* fix_of(int error) {
  switch (error) {
    case ENOENT: return "load the driver of the machine's watchdog (or softdog), or name the right file";
    case EACCES:
    case EPERM: return "run as root, or give the file to this user";
    case EBUSY: return "somebody else holds it: systemd (RuntimeWatchdogSec=), watchdog(8) or another run";
    case ENOTTY:
    case EOPNOTSUPP: return "name a watchdog device whose timeout can be set, such as /dev/watchdog";
    default: return "name a watchdog device, such as /dev/watchdog";
  }
}

[[noreturn]] void refuse(const std::filesystem::path& file, const char* what, int error) {
  throw WatchdogRefused("watchdog " + file.string() + ": " + what + ": " + std::strerror(error) +
                        "; fix: " + fix_of(error));
}

}  // namespace

std::unique_ptr<WatchdogPort> kernel_watchdog_port() { return std::make_unique<KernelWatchdogPort>(); }

WatchdogDevice::WatchdogDevice(const std::filesystem::path& file, int timeout_s, std::unique_ptr<WatchdogPort> port)
    : port_(std::move(port)) {
  if (const int error = port_->open(file); error != 0) refuse(file, "cannot be opened", error);
  int granted_s = timeout_s;
  if (const int error = port_->set_timeout(granted_s); error != 0) {
    // It is armed already: nobody will feed it, and nothing has begun that it should guard.
    port_->write_magic_close();
    port_->close();
    refuse(file, "takes no timeout", error);
  }
  timeout_ns_ = static_cast<int64_t>(granted_s) * 1'000'000'000;
}

WatchdogDevice::~WatchdogDevice() {
  if (open_) port_->close();
}

void WatchdogDevice::end() {
  if (!open_) return;
  open_ = false;
  port_->write_magic_close();
  port_->close();
}

}  // namespace takt
