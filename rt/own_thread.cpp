// SPDX-License-Identifier: Apache-2.0
#include "rt/own_thread.hpp"

#include <cerrno>
#include <memory>
#include <system_error>
#include <utility>

#include "rt/memory/map_as_used.hpp"

namespace takt {
namespace {

using Work = std::function<void()>;

constexpr size_t kGuard = 4096;  // a page

void* run(void* work) noexcept {
  (*std::unique_ptr<Work>(static_cast<Work*>(work)))();
  return nullptr;
}

/// With a page below that ends who comes there.
std::span<std::byte> stack_as_used(size_t bytes) {
  void* memory = map_as_used(bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK);
  if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "stack of a thread");
  mprotect(memory, kGuard, PROT_NONE);
  return {static_cast<std::byte*>(memory), bytes};
}

void give_back(std::span<std::byte> pages) {
  if (!pages.empty()) munmap(pages.data(), pages.size());
}

}  // namespace

OwnThread::OwnThread(Work work, size_t stack_bytes, Stack stack) {
  auto given = std::make_unique<Work>(std::move(work));
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
#if defined(TAKT_SANITIZED)  // which keeps records of the stacks that the library makes
  stack = Stack::resident;
#endif
  if (stack == Stack::as_used) {
    stack_ = stack_as_used(stack_bytes);
    pthread_attr_setstack(&attributes, stack_.data(), stack_.size());
  } else {
    pthread_attr_setstacksize(&attributes, stack_bytes);
  }
  pthread_t thread{};
  const int error = pthread_create(&thread, &attributes, run, given.get());
  pthread_attr_destroy(&attributes);
  if (error != 0) {
    give_back(stack_);
    throw std::system_error(error, std::generic_category(), "thread");
  }
  static_cast<void>(given.release());  // the thread's
  thread_ = thread;
}

OwnThread::OwnThread(const std::function<void(const std::stop_token&)>& work) {
  std::stop_source end;
  *this = OwnThread([work, token = end.get_token()] { work(token); });
  end_ = std::move(end);
}

OwnThread::OwnThread(OwnThread&& other) noexcept
    : thread_(std::exchange(other.thread_, std::nullopt)),
      end_(std::move(other.end_)),
      stack_(std::exchange(other.stack_, {})) {}

OwnThread& OwnThread::operator=(OwnThread&& other) noexcept {
  stop();
  thread_ = std::exchange(other.thread_, std::nullopt);
  end_ = std::move(other.end_);
  stack_ = std::exchange(other.stack_, {});
  return *this;
}

OwnThread::~OwnThread() { stop(); }

void OwnThread::stop() {
  request_stop();
  if (joinable()) join();
}

void OwnThread::join() {
  pthread_join(*std::exchange(thread_, std::nullopt), nullptr);
  give_back(std::exchange(stack_, {}));
}

}  // namespace takt
