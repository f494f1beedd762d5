// SPDX-License-Identifier: Apache-2.0
#include "rt/own_thread.hpp"

#include <memory>
#include <system_error>
#include <utility>

namespace takt {
namespace {

using Work = std::function<void()>;

void* run(void* work) noexcept {
  (*std::unique_ptr<Work>(static_cast<Work*>(work)))();
  return nullptr;
}

}  // namespace

OwnThread::OwnThread(Work work, size_t stack_bytes) {
  auto given = std::make_unique<Work>(std::move(work));
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack_bytes);
  pthread_t thread{};
  const int error = pthread_create(&thread, &attributes, run, given.get());
  pthread_attr_destroy(&attributes);
  if (error != 0) throw std::system_error(error, std::generic_category(), "thread");
  static_cast<void>(given.release());  // the thread's
  thread_ = thread;
}

OwnThread::OwnThread(const std::function<void(const std::stop_token&)>& work, size_t stack_bytes) {
  std::stop_source end;
  *this = OwnThread([work, token = end.get_token()] { work(token); }, stack_bytes);
  end_ = std::move(end);
}

OwnThread::OwnThread(OwnThread&& other) noexcept
    : thread_(std::exchange(other.thread_, std::nullopt)), end_(std::move(other.end_)) {}

OwnThread& OwnThread::operator=(OwnThread&& other) noexcept {
  stop();
  thread_ = std::exchange(other.thread_, std::nullopt);
  end_ = std::move(other.end_);
  return *this;
}

OwnThread::~OwnThread() { stop(); }

void OwnThread::stop() {
  request_stop();
  if (joinable()) join();
}

void OwnThread::join() { pthread_join(*std::exchange(thread_, std::nullopt), nullptr); }

}  // namespace takt
