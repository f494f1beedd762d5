// SPDX-License-Identifier: Apache-2.0
// Sees calls that no job should make (rt/memory/job_calls.hpp). Each function here takes the place of the C library's
// in the program that links it, for the libraries it uses as well, and hands on to it. What the C library calls inside
// itself is not seen: hence stdio has its own entries beside write.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <atomic>

#include "rt/memory/counter/thread_job.hpp"

#if !defined(TAKT_SANITIZED)

namespace takt::counter {

__attribute__((tls_model("initial-exec"))) thread_local JobCalls* job = nullptr;

namespace {

void say(const char* text) {
  if (syscall(SYS_write, STDERR_FILENO, text, strlen(text)) < 0) return;
}

[[noreturn]] void end(const JobCalls& calls, JobCall call, const char* function) {
  job = nullptr;
  char text[256];
  snprintf(text, sizeof text, "takt: error: node %s called %s (%s) in job %llu; TAKT_RT_STRICT=1 ends the run\n",
           calls.node, function, to_string(call).data(), static_cast<unsigned long long>(calls.job));
  say(text);
  abort();
}

/// The C library's own function, looked up at its first use. No static with a guard: that could itself lock.
template <class F>
class Next {
 public:
  constexpr explicit Next(const char* name, const char* version = nullptr) : name_(name), version_(version) {}
  F get() {
    F found = found_.load(std::memory_order_relaxed);
    if (found != nullptr) return found;
    void* symbol = version_ != nullptr ? dlvsym(RTLD_NEXT, name_, version_) : nullptr;
    if (symbol == nullptr) symbol = dlsym(RTLD_NEXT, name_);
    if (symbol == nullptr) abort();
    memcpy(&found, &symbol, sizeof found);
    found_.store(found, std::memory_order_relaxed);
    return found;
  }

 private:
  const char* name_;
  const char* version_;
  std::atomic<F> found_{nullptr};
};

}  // namespace

void note(JobCall call, const char* function) {
  JobCalls& calls = *job;
  if (calls.warm || (calls.allowed & bit(call)) != 0) return;
  if (calls.counts != nullptr) ++calls.counts[static_cast<size_t>(call)];
  if (calls.strict) end(calls, call, function);
}

}  // namespace takt::counter

using takt::JobCall;
using takt::counter::Next;
using takt::counter::see;

// A function that only notes and hands on.
#define TAKT_SEE(result, name, call, parameters, arguments) \
  result name parameters {                                  \
    static Next<result(*) parameters> next(#name);          \
    see(JobCall::call, #name);                              \
    return next.get() arguments;                            \
  }

extern "C" {

takt::JobCalls** takt_thread_job_calls() { return &takt::counter::job; }

TAKT_SEE(ssize_t, read, file, (int file, void* data, size_t size), (file, data, size))
TAKT_SEE(ssize_t, write, file, (int file, const void* data, size_t size), (file, data, size))
TAKT_SEE(ssize_t, pread, file, (int file, void* data, size_t size, off_t at), (file, data, size, at))
TAKT_SEE(ssize_t, pwrite, file, (int file, const void* data, size_t size, off_t at), (file, data, size, at))
TAKT_SEE(ssize_t, pread64, file, (int file, void* data, size_t size, off64_t at), (file, data, size, at))
TAKT_SEE(ssize_t, pwrite64, file, (int file, const void* data, size_t size, off64_t at), (file, data, size, at))
TAKT_SEE(ssize_t, readv, file, (int file, const iovec* parts, int count), (file, parts, count))
TAKT_SEE(ssize_t, writev, file, (int file, const iovec* parts, int count), (file, parts, count))
TAKT_SEE(int, close, file, (int file), (file))
TAKT_SEE(int, fsync, file, (int file), (file))
TAKT_SEE(int, fdatasync, file, (int file), (file))

TAKT_SEE(void*, sbrk, mmap, (intptr_t more), (more))
TAKT_SEE(int, brk, mmap, (void* end), (end))

TAKT_SEE(int, socket, socket, (int domain, int type, int protocol), (domain, type, protocol))
TAKT_SEE(int, connect, socket, (int file, const sockaddr* to, socklen_t size), (file, to, size))
TAKT_SEE(int, accept, socket, (int file, sockaddr* from, socklen_t* size), (file, from, size))
TAKT_SEE(int, accept4, socket, (int file, sockaddr* from, socklen_t* size, int flags), (file, from, size, flags))
TAKT_SEE(ssize_t, send, socket, (int file, const void* data, size_t size, int flags), (file, data, size, flags))
TAKT_SEE(ssize_t, recv, socket, (int file, void* data, size_t size, int flags), (file, data, size, flags))
TAKT_SEE(ssize_t, sendmsg, socket, (int file, const msghdr* message, int flags), (file, message, flags))
TAKT_SEE(ssize_t, recvmsg, socket, (int file, msghdr* message, int flags), (file, message, flags))
TAKT_SEE(ssize_t, sendto, socket,
         (int file, const void* data, size_t size, int flags, const sockaddr* to, socklen_t length),
         (file, data, size, flags, to, length))
TAKT_SEE(ssize_t, recvfrom, socket, (int file, void* data, size_t size, int flags, sockaddr* from, socklen_t* length),
         (file, data, size, flags, from, length))

TAKT_SEE(int, pthread_create, thread,
         (pthread_t * thread, const pthread_attr_t* attributes, void* (*start)(void*), void* argument),
         (thread, attributes, start, argument))

TAKT_SEE(int, nanosleep, sleep, (const timespec* wanted, timespec* left), (wanted, left))
TAKT_SEE(int, clock_nanosleep, sleep, (clockid_t clock, int flags, const timespec* wanted, timespec* left),
         (clock, flags, wanted, left))
TAKT_SEE(int, usleep, sleep, (useconds_t wanted), (wanted))
TAKT_SEE(unsigned, sleep, sleep, (unsigned wanted), (wanted))
TAKT_SEE(int, sched_yield, sleep, (), ())

TAKT_SEE(int, pthread_join, wait, (pthread_t thread, void** result), (thread, result))
TAKT_SEE(int, sem_wait, wait, (sem_t * semaphore), (semaphore))
TAKT_SEE(int, sem_timedwait, wait, (sem_t * semaphore, const timespec* until), (semaphore, until))
TAKT_SEE(int, sem_clockwait, wait, (sem_t * semaphore, clockid_t clock, const timespec* until),
         (semaphore, clock, until))
TAKT_SEE(int, pthread_barrier_wait, wait, (pthread_barrier_t * barrier), (barrier))
TAKT_SEE(int, poll, wait, (pollfd * files, nfds_t count, int timeout), (files, count, timeout))
TAKT_SEE(int, ppoll, wait, (pollfd * files, nfds_t count, const timespec* timeout, const sigset_t* blocked),
         (files, count, timeout, blocked))
TAKT_SEE(int, select, wait, (int files, fd_set* read, fd_set* write, fd_set* other, timeval* timeout),
         (files, read, write, other, timeout))
TAKT_SEE(int, epoll_wait, wait, (int epoll, epoll_event* events, int size, int timeout), (epoll, events, size, timeout))
TAKT_SEE(int, epoll_pwait, wait, (int epoll, epoll_event* events, int size, int timeout, const sigset_t* blocked),
         (epoll, events, size, timeout, blocked))

// Condition variables changed their layout once; the old functions are still there under the old version.
#define TAKT_SEE_CONDITION(name, parameters, arguments)        \
  int name parameters {                                        \
    static Next<int(*) parameters> next(#name, "GLIBC_2.3.2"); \
    see(JobCall::wait, #name);                                 \
    return next.get() arguments;                               \
  }
TAKT_SEE_CONDITION(pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* mutex), (condition, mutex))
TAKT_SEE_CONDITION(pthread_cond_timedwait, (pthread_cond_t * condition, pthread_mutex_t* mutex, const timespec* until),
                   (condition, mutex, until))
TAKT_SEE_CONDITION(pthread_cond_clockwait,
                   (pthread_cond_t * condition, pthread_mutex_t* mutex, clockid_t clock, const timespec* until),
                   (condition, mutex, clock, until))

// One that would have to wait.
#define TAKT_SEE_LOCK(name, at_once, parameters, arguments) \
  int name parameters {                                     \
    static Next<int(*) parameters> next(#name);             \
    if (takt::counter::job != nullptr) {                    \
      const int taken = at_once(lock);                      \
      if (taken != EBUSY) return taken;                     \
      see(JobCall::lock, #name);                            \
    }                                                       \
    return next.get() arguments;                            \
  }
TAKT_SEE_LOCK(pthread_mutex_lock, pthread_mutex_trylock, (pthread_mutex_t * lock), (lock))
TAKT_SEE_LOCK(pthread_mutex_timedlock, pthread_mutex_trylock, (pthread_mutex_t * lock, const timespec* until),
              (lock, until))
TAKT_SEE_LOCK(pthread_mutex_clocklock, pthread_mutex_trylock,
              (pthread_mutex_t * lock, clockid_t clock, const timespec* until), (lock, clock, until))
TAKT_SEE_LOCK(pthread_rwlock_rdlock, pthread_rwlock_tryrdlock, (pthread_rwlock_t * lock), (lock))
TAKT_SEE_LOCK(pthread_rwlock_wrlock, pthread_rwlock_trywrlock, (pthread_rwlock_t * lock), (lock))

TAKT_SEE(int, puts, stdio, (const char* text), (text))
TAKT_SEE(int, fputs, stdio, (const char* text, FILE* file), (text, file))
TAKT_SEE(int, fputc, stdio, (int character, FILE* file), (character, file))
TAKT_SEE(int, fflush, stdio, (FILE * file), (file))
TAKT_SEE(size_t, fwrite, stdio, (const void* data, size_t size, size_t count, FILE* file), (data, size, count, file))
TAKT_SEE(size_t, fread, stdio, (void* data, size_t size, size_t count, FILE* file), (data, size, count, file))
TAKT_SEE(FILE*, fopen, stdio, (const char* path, const char* mode), (path, mode))
TAKT_SEE(FILE*, fopen64, stdio, (const char* path, const char* mode), (path, mode))
TAKT_SEE(int, vfprintf, stdio, (FILE * file, const char* format, va_list arguments), (file, format, arguments))

int printf(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int written = vfprintf(stdout, format, arguments);
  va_end(arguments);
  return written;
}

int fprintf(FILE* file, const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  const int written = vfprintf(file, format, arguments);
  va_end(arguments);
  return written;
}

// The mode is read whether it was given or not: then it is not used.
#define TAKT_SEE_OPEN(name)                                  \
  int name(const char* path, int flags, ...) {               \
    static Next<int (*)(const char*, int, ...)> next(#name); \
    see(JobCall::file, #name);                               \
    va_list arguments;                                       \
    va_start(arguments, flags);                              \
    const unsigned mode = va_arg(arguments, unsigned);       \
    va_end(arguments);                                       \
    return next.get()(path, flags, mode);                    \
  }
TAKT_SEE_OPEN(open)
TAKT_SEE_OPEN(open64)

#define TAKT_SEE_OPENAT(name)                                     \
  int name(int folder, const char* path, int flags, ...) {        \
    static Next<int (*)(int, const char*, int, ...)> next(#name); \
    see(JobCall::file, #name);                                    \
    va_list arguments;                                            \
    va_start(arguments, flags);                                   \
    const unsigned mode = va_arg(arguments, unsigned);            \
    va_end(arguments);                                            \
    return next.get()(folder, path, flags, mode);                 \
  }
TAKT_SEE_OPENAT(openat)
TAKT_SEE_OPENAT(openat64)

}  // extern "C"

#endif
