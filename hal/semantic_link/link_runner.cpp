// SPDX-License-Identifier: Apache-2.0
#include "hal/semantic_link/link_runner.hpp"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace takt::semantic_link {

LinkRunner::LinkRunner(std::string name, std::unique_ptr<LinkEnd> end, const Clock& clock)
    : name_(std::move(name)), end_(std::move(end)), clock_(clock), bell_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

LinkRunner::~LinkRunner() {
  while (users_ > 0) stop();
  end_->close();
}

void LinkRunner::start() {
  if (users_++ > 0 || clock_.is_virtual()) return;
  quit_.store(false);
  thread_ = std::thread([this] { work(); });
}

void LinkRunner::stop() {
  if (users_ == 0 || --users_ > 0) return;
  if (thread_.joinable()) {
    quit_.store(true);
    wake();
    thread_.join();
  }
  end_->say_farewell();
}

void LinkRunner::wake() {
  if (clock_.is_virtual()) return void(end_->step());
  const uint64_t once = 1;
  // A bell that is full rings already.
  static_cast<void>(!::write(bell_.get(), &once, sizeof once));
}

void LinkRunner::poll() {
  if (clock_.is_virtual()) end_->step();
  else priority_.follow();
}

void LinkRunner::work() {
  pthread_setname_np(pthread_self(), ("link:" + name_).substr(0, 15).c_str());
  while (!quit_.load()) {
    priority_.keep(clock_);
    const int64_t wait_ns = end_->step() - clock_.now_ns();
    std::array<pollfd, 2> events{pollfd{bell_.get(), POLLIN, 0}, end_->wait()};
    const timespec time{0, static_cast<long>(std::clamp<int64_t>(wait_ns, 0, 250'000'000))};
    ppoll(events.data(), events.size(), &time, nullptr);
    uint64_t rung = 0;
    if (events[0].revents != 0) static_cast<void>(!read(bell_.get(), &rung, sizeof rung));
  }
}

}  // namespace takt::semantic_link
