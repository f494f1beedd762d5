// SPDX-License-Identifier: Apache-2.0
#include "graph/run/isolated_replay.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "hal/settings/json.hpp"
#include "rt/supervise/process_group.hpp"

namespace takt::command {
namespace {

using nlohmann::json;
using record::ReplayResult;

std::string written(const ReplayResult& result) {
  json first;
  if (result.first)
    first = {result.first->node, result.first->port, result.first->job, result.first->release_ns, result.first->what};
  return json{{"jobs", result.jobs},
              {"messages", result.messages},
              {"compared", result.compared},
              {"whole", result.whole},
              {"different", result.different},
              {"lacking", result.lacking},
              {"restarts", result.restarts},
              {"uncommitted", result.uncommitted},
              {"unmade", result.unmade},
              {"begun", result.begun},
              {"begun_afresh", result.begun_afresh},
              {"stateless", result.stateless},
              {"first_lacking", result.first_lacking},
              {"first", first},
              {"different_of", result.different_of},
              {"recorded_ns", result.recorded_ns}}
      .dump();
}

/// Throws json's exception if it is not what written() wrote.
ReplayResult parsed(const std::string& text) {
  const json part = json::parse(text);
  ReplayResult result;
  result.jobs = part["jobs"], result.messages = part["messages"];
  result.compared = part["compared"], result.whole = part["whole"];
  result.different = part["different"], result.lacking = part["lacking"];
  result.restarts = part["restarts"], result.uncommitted = part["uncommitted"], result.unmade = part["unmade"];
  result.begun = part["begun"], result.begun_afresh = part["begun_afresh"], result.stateless = part["stateless"];
  result.first_lacking = part["first_lacking"];
  if (const json& first = part["first"]; !first.is_null())
    result.first = {first[0], first[1], first[2], first[3], first[4]};
  part["different_of"].get_to(result.different_of);
  result.recorded_ns = part["recorded_ns"];
  return result;
}

void add(ReplayResult& sum, const ReplayResult& part) {
  sum.jobs += part.jobs, sum.messages += part.messages;
  sum.compared += part.compared, sum.whole += part.whole;
  sum.different += part.different, sum.lacking += part.lacking;
  sum.restarts += part.restarts, sum.uncommitted += part.uncommitted, sum.unmade += part.unmade;
  sum.begun += part.begun, sum.begun_afresh += part.begun_afresh;
  if (sum.stateless.empty()) sum.stateless = part.stateless;
  if (sum.first_lacking.empty()) sum.first_lacking = part.first_lacking;
  if (part.first && (!sum.first || part.first->release_ns < sum.first->release_ns)) sum.first = part.first;
  sum.different_of.insert(part.different_of.begin(), part.different_of.end());
  sum.recorded_ns = std::max(sum.recorded_ns, part.recorded_ns);
}

/// The reading end of a pipe whose writing end the process made next inherits.
class Pipe {
 public:
  Pipe() {
    if (pipe(ends_.data()) != 0) throw std::runtime_error(std::string("pipe: ") + std::strerror(errno));
  }
  ~Pipe() {
    close_writing();
    close(ends_[0]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  bool write(const std::string& text) {
    size_t done = 0;
    while (done < text.size()) {
      const ssize_t more = ::write(ends_[1], text.data() + done, text.size() - done);
      if (more < 0 && errno == EINTR) continue;
      if (more <= 0) return false;
      done += static_cast<size_t>(more);
    }
    return true;
  }
  void close_writing() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }
  /// Until every writing end is closed.
  std::string read_all() {
    std::string text;
    std::array<char, 4096> some{};
    while (true) {
      const ssize_t got = ::read(ends_[0], some.data(), some.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return text;
      text.append(some.data(), static_cast<size_t>(got));
    }
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

}  // namespace

ReplayResult replay_isolated(const std::vector<ReplayPart>& parts,
                             const std::function<ReplayResult(const ReplayPart&)>& run_part) {
  std::vector<std::unique_ptr<Pipe>> pipes;
  ProcessGroup processes;
  for (const ReplayPart& part : parts) {
    pipes.push_back(std::make_unique<Pipe>());
    processes.start(part.name, [&] { return pipes.back()->write(written(run_part(part))) ? 0 : 1; });
    pipes.back()->close_writing();
  }
  ReplayResult sum;
  for (size_t i = 0; i < parts.size(); ++i) {
    const std::string text = pipes[i]->read_all();
    // After a signal each of them tells what it has done so far.
    if (text.empty()) throw std::runtime_error("the process of " + parts[i].name + " ended without a result");
    add(sum, parsed(text));
  }
  return sum;
}

}  // namespace takt::command
