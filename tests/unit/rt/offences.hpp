// SPDX-License-Identifier: Apache-2.0
// Every call that no job should make, each made so that it returns at once.
#pragma once
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <ctime>
#include <functional>
#include <thread>
#include <vector>

#include "rt/memory/job_calls.hpp"
#include "tests/unit/rt/opaque_malloc.hpp"

namespace takt::test {

struct Offence {
  const char* name;  ///< as it is told
  JobCall kind;
  std::function<void()> make;
};

/// What the calls need, and the calls. Files and sockets are none, paths do not exist: that they fail is told as well.
class Offences {
 public:
  std::vector<Offence> all;

  Offences() {
    pthread_mutexattr_settype(&checks_, PTHREAD_MUTEX_ERRORCHECK);
    pthread_mutex_init(&mine_, &checks_);
    pthread_mutex_lock(&mine_);  // whoever locks it again is told so, and does not wait
    pthread_rwlock_wrlock(&shared_);
    std::fputs("x", null_);  // takes its buffer
    add_memory();
    add_files();
    add_sockets();
    add_waits();
    add_locks();
  }
  ~Offences() {
    ended_ = true;
    caller_.join();
    pthread_mutex_unlock(&mine_);
    pthread_rwlock_unlock(&shared_);
    std::fclose(null_);
  }
  Offences(const Offences&) = delete;
  Offences& operator=(const Offences&) = delete;

 private:
  template <class T>
  static void drop(const T& result) {
    static_cast<void>(result);
  }
  static void* nothing(void*) { return nullptr; }
  void add(const char* name, JobCall kind, std::function<void()> make) { all.push_back({name, kind, std::move(make)}); }

  void add_memory() {
    add("malloc", JobCall::malloc, [] { call_free(call_malloc(10)); });
    add("calloc", JobCall::malloc, [] { call_free(call_calloc(2, 5)); });
    add("realloc", JobCall::malloc, [this] { kept_ = call_realloc(kept_, 20); });
    add("memalign", JobCall::malloc, [this] { drop(posix_memalign(&kept_, 64, 64)); });
    add("mmap", JobCall::mmap, [this] { page_ = mmap(nullptr, 1, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); });
    add("munmap", JobCall::mmap, [this] { drop(munmap(page_, 1)); });
    add("sbrk", JobCall::mmap, [] { drop(sbrk(0)); });
    add("brk", JobCall::mmap, [] { drop(brk(nullptr)); });
  }

  void add_files() {
    add("open", JobCall::file, [] { drop(open("/none", O_RDONLY)); });
    add("open64", JobCall::file, [] { drop(open64("/none", O_RDONLY)); });
    add("openat", JobCall::file, [] { drop(openat(AT_FDCWD, "/none", O_RDONLY)); });
    add("openat64", JobCall::file, [] { drop(openat64(AT_FDCWD, "/none", O_RDONLY)); });
    add("read", JobCall::file, [this] { drop(read(-1, &byte_, 1)); });
    add("write", JobCall::file, [this] { drop(write(-1, &byte_, 1)); });
    add("pread", JobCall::file, [this] { drop(pread(-1, &byte_, 1, 0)); });
    add("pwrite", JobCall::file, [this] { drop(pwrite(-1, &byte_, 1, 0)); });
    add("pread64", JobCall::file, [this] { drop(pread64(-1, &byte_, 1, 0)); });
    add("pwrite64", JobCall::file, [this] { drop(pwrite64(-1, &byte_, 1, 0)); });
    add("readv", JobCall::file, [this] { drop(readv(-1, &part_, 1)); });
    add("writev", JobCall::file, [this] { drop(writev(-1, &part_, 1)); });
    add("close", JobCall::file, [] { drop(close(-1)); });
    add("fsync", JobCall::file, [] { drop(fsync(-1)); });
    add("fdatasync", JobCall::file, [] { drop(fdatasync(-1)); });
    add("fputs", JobCall::stdio, [this] { drop(fputs_("x", null_)); });
    add("fputc", JobCall::stdio, [this] { drop(fputc_('x', null_)); });
    add("fwrite", JobCall::stdio, [this] { drop(fwrite_(&byte_, 1, 1, null_)); });
    add("vfprintf", JobCall::stdio, [this] { drop(std::fprintf(null_, "%d", 1)); });
    add("fflush", JobCall::stdio, [this] { drop(std::fflush(null_)); });
    add("fread", JobCall::stdio, [this] { drop(std::fread(&byte_, 1, 1, null_)); });
    add("fopen", JobCall::stdio, [] { drop(std::fopen("/none", "r")); });
  }

  void add_sockets() {
    add("socket", JobCall::socket, [] { drop(socket(-1, 0, 0)); });
    add("connect", JobCall::socket, [this] { drop(connect(-1, &address_, sizeof address_)); });
    add("accept", JobCall::socket, [] { drop(accept(-1, nullptr, nullptr)); });
    add("accept4", JobCall::socket, [] { drop(accept4(-1, nullptr, nullptr, 0)); });
    add("send", JobCall::socket, [this] { drop(send(-1, &byte_, 1, 0)); });
    add("recv", JobCall::socket, [this] { drop(recv(-1, &byte_, 1, 0)); });
    add("sendmsg", JobCall::socket, [this] { drop(sendmsg(-1, &message_, 0)); });
    add("recvmsg", JobCall::socket, [this] { drop(recvmsg(-1, &message_, 0)); });
    add("sendto", JobCall::socket, [this] { drop(sendto(-1, &byte_, 1, 0, &address_, sizeof address_)); });
    add("recvfrom", JobCall::socket, [this] { drop(recvfrom(-1, &byte_, 1, 0, nullptr, nullptr)); });
  }

  void add_waits() {
    add("nanosleep", JobCall::sleep, [this] { drop(nanosleep(&zero_, nullptr)); });
    add("clock_nanosleep", JobCall::sleep, [this] { drop(clock_nanosleep(CLOCK_MONOTONIC, 0, &zero_, nullptr)); });
    add("usleep", JobCall::sleep, [] { drop(usleep(0)); });
    add("sleep", JobCall::sleep, [] { drop(sleep(0)); });
    add("sched_yield", JobCall::sleep, [] { drop(sched_yield()); });
    add("pthread_create", JobCall::thread, [this] {
      if (pthread_create(&made_, nullptr, &nothing, nullptr) == 0) pthread_detach(made_);
    });
    pthread_create(&other_, nullptr, &nothing, nullptr);
    add("pthread_join", JobCall::wait, [this] { drop(pthread_join(other_, nullptr)); });
    sem_init(&semaphore_, 0, 3);
    add("sem_wait", JobCall::wait, [this] { drop(sem_wait(&semaphore_)); });
    add("sem_timedwait", JobCall::wait, [this] { drop(sem_timedwait(&semaphore_, &zero_)); });
    add("sem_clockwait", JobCall::wait, [this] { drop(sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &zero_)); });
    pthread_barrier_init(&barrier_, nullptr, 1);
    add("pthread_barrier_wait", JobCall::wait, [this] { drop(pthread_barrier_wait(&barrier_)); });
    add("poll", JobCall::wait, [] { drop(poll(nullptr, 0, 0)); });
    add("ppoll", JobCall::wait, [this] { drop(ppoll(nullptr, 0, &zero_, nullptr)); });
    add("select", JobCall::wait, [this] { drop(select(0, nullptr, nullptr, nullptr, &zero_us_)); });
    add("epoll_wait", JobCall::wait, [this] { drop(epoll_wait(-1, &event_, 1, 0)); });
    add("epoll_pwait", JobCall::wait, [this] { drop(epoll_pwait(-1, &event_, 1, 0, nullptr)); });
    caller_ = std::thread([this] {
      while (!ended_) {
        pthread_cond_broadcast(&condition_);
        std::this_thread::yield();
      }
    });
    add("pthread_cond_wait", JobCall::wait,
        [this] { waiting([&] { return pthread_cond_wait(&condition_, &mutex_); }); });
    add("pthread_cond_timedwait", JobCall::wait,
        [this] { waiting([&] { return pthread_cond_timedwait(&condition_, &mutex_, &zero_); }); });
    add("pthread_cond_clockwait", JobCall::wait,
        [this] { waiting([&] { return pthread_cond_clockwait(&condition_, &mutex_, CLOCK_MONOTONIC, &zero_); }); });
  }

  template <class Wait>
  void waiting(const Wait& wait) {
    pthread_mutex_lock(&mutex_);
    drop(wait());
    pthread_mutex_unlock(&mutex_);
  }

  void add_locks() {
    add("pthread_mutex_lock", JobCall::lock, [this] { drop(pthread_mutex_lock(&mine_)); });
    add("pthread_mutex_timedlock", JobCall::lock, [this] { drop(pthread_mutex_timedlock(&mine_, &zero_)); });
    add("pthread_mutex_clocklock", JobCall::lock,
        [this] { drop(pthread_mutex_clocklock(&mine_, CLOCK_MONOTONIC, &zero_)); });
    add("pthread_rwlock_rdlock", JobCall::lock, [this] { drop(pthread_rwlock_rdlock(&shared_)); });
    add("pthread_rwlock_wrlock", JobCall::lock, [this] { drop(pthread_rwlock_wrlock(&shared_)); });
  }

  // Through volatile pointers: compilers put one of these in the place of another.
  int (*volatile fputs_)(const char*, FILE*) = std::fputs;
  int (*volatile fputc_)(int, FILE*) = std::fputc;
  size_t (*volatile fwrite_)(const void*, size_t, size_t, FILE*) = std::fwrite;

  FILE* null_ = std::fopen("/dev/null", "w+");
  void *kept_ = nullptr, *page_ = nullptr;
  char byte_ = 'x';
  iovec part_{&byte_, 1};
  sockaddr address_{};
  msghdr message_{};
  timespec zero_{0, 0};
  timeval zero_us_{0, 0};
  epoll_event event_{};
  pthread_t made_{}, other_{};
  sem_t semaphore_{};
  pthread_barrier_t barrier_{};
  pthread_cond_t condition_ = PTHREAD_COND_INITIALIZER;
  pthread_mutex_t mutex_ = PTHREAD_MUTEX_INITIALIZER;
  pthread_mutexattr_t checks_ = [] {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    return attributes;
  }();
  pthread_mutex_t mine_{};
  pthread_rwlock_t shared_ = PTHREAD_RWLOCK_INITIALIZER;
  std::atomic<bool> ended_{false};
  std::thread caller_;
};

}  // namespace takt::test
