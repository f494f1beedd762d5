// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include "graph/attach/endpoint.hpp"
#include "graph/attach/errands.hpp"
#include "graph/attach/subject.hpp"
#include "graph/attach/taps.hpp"
#include "rt/own_thread.hpp"

namespace takt::attach {

/// Answers top, echo, describe, follow, get, set, forget, fault, answer, mark, mode and stop for one run, from threads
/// of the default policy that only read the board, hold one message of an output at a time while they copy it, and post
/// parameters to be taken between jobs. Its own user and root are heard; of the service its group, too, where the mode
/// of its folder says so.
class Server {
 public:
  explicit Server(const Subject& subject);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  /// Why nobody can attach; empty if all is well.
  const std::string& lacks() const { return lacks_; }
  /// Which folder was passed over, because somebody else has it; mostly empty.
  const std::string& note() const { return note_; }

 private:
  struct Client {
    OwnThread thread;
    std::atomic<bool> done{false};
  };
  void open();
  void accept_clients();
  void serve(int descriptor);
  /// `by_user`: the uid of who asks.
  bool answer(const nlohmann::ordered_json& question, Connection& connection, uint32_t by_user);
  /// To what is answered at once, by this machine or by those that the question is for.
  nlohmann::ordered_json reply(const nlohmann::ordered_json& question, uint32_t by_user);
  nlohmann::ordered_json reply_here(const nlohmann::ordered_json& question, uint32_t by_user);
  /// The machine that a question names, or that has what it is about; empty: none does.
  std::string machine_of(const nlohmann::ordered_json& question) const;
  nlohmann::ordered_json top() const;
  bool echo(const nlohmann::ordered_json& question, Connection& connection);
  /// `as`: "png", "ply" or "", for text alone; `items`: of longer arrays so many elements.
  bool stream(size_t port, const std::string& as, size_t items, int64_t count, Connection& connection);
  nlohmann::ordered_json change_mode(const std::string& name);
  nlohmann::ordered_json mark(const std::string& words, uint32_t by_user);
  struct Wish {
    std::string text;      ///< the value, with its unit
    bool keep = false;     ///< also for later runs
    uint32_t by_user = 0;  ///< uid
  };
  /// `name`: NODE.PARAM, or TYPE:PARAM for every node of that type.
  nlohmann::ordered_json set(const std::string& name, const Wish& wish);
  nlohmann::ordered_json set_one(const std::string& name, const Wish& wish);
  nlohmann::ordered_json set_all(const std::string& type, const std::string& key, const Wish& wish);
  /// Writes the value into the overlay of the graph, once the node has accepted it.
  nlohmann::ordered_json keep(const std::string& name, const std::string& text);
  nlohmann::ordered_json forget(const std::string& name);
  /// The value of one parameter; "": all that differ from the graph's file.
  nlohmann::ordered_json get(const std::string& name) const;
  /// Of `device` ("": of each), what can be made to go wrong and what is switched on.
  nlohmann::ordered_json faults(const std::string& device) const;
  /// Switches one of them.
  nlohmann::ordered_json switch_fault(const std::string& device, const std::string& fault, bool on, uint32_t by_user);
  /// Why there is nothing to switch: unknown, or not simulated.
  nlohmann::ordered_json not_switchable(const std::string& device) const;
  /// What somebody answered on the screen of `device`. Comes back once a job of the device has it.
  nlohmann::ordered_json give_answer(const std::string& device, const std::string& text, uint32_t by_user);
  nlohmann::ordered_json post_and_wait(size_t task, size_t param, const ParamValue& value, uint32_t by_user);
  /// A replay's sockets are apart from those of runs.
  SocketFolder::Of whom() const {
    return subject_.replay_of.empty() ? SocketFolder::Of::run : SocketFolder::Of::replay;
  }

  const Subject subject_;
  std::string lacks_;
  std::string note_;
  std::optional<SocketFolder> folder_;
  int listener_ = -1;
  std::atomic<bool> ending_{false};
  std::mutex setting_, keeping_;
  Taps taps_;
  Errands errands_;
  std::list<Client> clients_;
  OwnThread thread_;
};

}  // namespace takt::attach
