// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "graph/attach/endpoint.hpp"

namespace takt::attach {

/// Questions that another machine of the graph answers, on their way to the process that talks to it. That one connects
/// to the run as anybody does and says {"do": "carry"}: from there on it is asked, and answers.
///
///   Errands errands;
///   errands.carry(connection, ending);                            // a thread, as long as that process lives
///   const auto answer = errands.ask("vision", {{"do", "top"}});   // any other one
class Errands {
 public:
  /// Its answer; {"error": ...} if there is none within 6 s, or nobody who carries.
  nlohmann::ordered_json ask(const std::string& machine, nlohmann::ordered_json question);
  /// Until the connection or the run ends.
  void carry(Connection& connection, const std::atomic<bool>& ending);

 private:
  struct Errand {
    nlohmann::ordered_json question, answer;
    bool done = false;
  };
  /// Of that process; nothing: it is gone, or silent.
  static std::optional<nlohmann::ordered_json> answer_to(const nlohmann::ordered_json& question, Connection& connection,
                                                         const std::atomic<bool>& ending);
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Errand>> waiting_;
  int carriers_ = 0;
};

}  // namespace takt::attach
