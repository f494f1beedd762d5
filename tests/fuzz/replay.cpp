// SPDX-License-Identifier: Apache-2.0
// replay_NAME PATH...: gives each file, and each file of a folder, to the fuzz target once. No fuzzer is needed for
// that. Exit 0: nothing broke. Exit 1: the inputs that broke the target are named. Exit 2: a path without any input.
//
// A child process runs the inputs and notes which one it is at. However it ends (a signal, a sanitizer, 60 s on one
// input), its parent names that input and goes on behind it with another child.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

using Path = std::filesystem::path;

constexpr unsigned kLongest_s = 60;

std::vector<Path> inputs_below(const std::vector<Path>& given) {
  std::vector<Path> inputs;
  for (const Path& path : given) {
    std::vector<Path> found;
    if (is_directory(path)) {
      for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
        if (entry.is_regular_file()) found.push_back(entry.path());
      std::sort(found.begin(), found.end());  // the same order on every machine
    } else if (exists(path)) {
      found.push_back(path);
    }
    if (found.empty()) throw std::runtime_error(path.string() + ": there is no input");
    inputs.insert(inputs.end(), found.begin(), found.end());
  }
  return inputs;
}

void run_input(const Path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("it cannot be opened");
  const std::string read{std::istreambuf_iterator<char>(file), {}};
  const std::vector<uint8_t> bytes(read.begin(), read.end());  // no spare capacity, for the address sanitizer
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

/// Runs the inputs from `at` on in a child; `at` is then the one that it did not get through. Its wait status.
int run_from(const std::vector<Path>& inputs, std::atomic<size_t>& at) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(std::string("fork: ") + std::strerror(errno));
  if (child == 0) {
    try {
      for (; at < inputs.size(); ++at) {
        alarm(kLongest_s);
        run_input(inputs[at]);
      }
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      _exit(1);
    }
    std::exit(0);  // looks for leaks where the leak sanitizer is built in
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) throw std::runtime_error(std::string("waitpid: ") + std::strerror(errno));
  return status;
}

std::string end_of(int status) {
  if (!WIFSIGNALED(status)) return "exit " + std::to_string(WEXITSTATUS(status));
  if (WTERMSIG(status) == SIGALRM) return "took more than " + std::to_string(kLongest_s) + " s";
  return strsignal(WTERMSIG(status));
}

size_t replay(const std::vector<Path>& inputs) {
  void* memory = mmap(nullptr, sizeof(size_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::runtime_error(std::string("mmap: ") + std::strerror(errno));
  std::atomic<size_t>& at = *new (memory) std::atomic<size_t>(0);
  size_t broken = 0;
  for (; at < inputs.size(); ++at) {
    const int status = run_from(inputs, at);
    if (status == 0 && at == inputs.size()) break;
    const std::string where = at < inputs.size() ? inputs[at].string() : "after the last input";
    std::printf("FAILED: %s: %s\n", where.c_str(), end_of(status).c_str());
    ++broken;
  }
  return broken;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<Path> inputs = inputs_below({argv + 1, argv + argc});
    if (inputs.empty()) throw std::runtime_error("name files or folders with inputs");
    const size_t broken = replay(inputs);
    std::printf("%zu inputs, %zu broke the target\n", inputs.size(), broken);
    return broken == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "replay: %s\n", error.what());
    return 2;
  }
}
