// SPDX-License-Identifier: Apache-2.0
// The page: sub-protocol takt.v1 of graph/web/README.md.
#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "graph/web/gate.hpp"
#include "graph/web/session.hpp"

namespace takt::web {
namespace {

constexpr size_t kMostLooks = 64;
constexpr double kScreenHz = 60;
constexpr std::array<std::string_view, 7> kKinds{"picture", "disparity", "cloud", "scan", "grid", "pose", "value"};
/// Questions that change the run; these and kFetches need the token.
constexpr std::array<std::string_view, 7> kChanges{"set", "forget", "mode", "mark", "stop", "answer", "task"};
/// Questions for what lies on the disk of the robot: its records, and a server that shows one.
constexpr std::array<std::string_view, 3> kFetches{"download", "replay", "replayed"};
constexpr std::array<std::string_view, 5> kLooks{"get", "top", "fault", "frozen", "know"};

template <size_t N>
bool among(const std::array<std::string_view, N>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool needs_token(const Json& question) {
  const std::string what = text_of(question, "do");
  return among(kChanges, what) || among(kFetches, what) || (what == "fault" && question.contains("fault"));
}

class PageSession final : public Session {
 public:
  PageSession(const Room& room, uint64_t number) : Session(room, number) {}
  ~PageSession() override {
    for (const auto& [view, look] : looks_) room().hub.leave(view, look.most_hz);
  }

  bool receive(std::string_view bytes, bool binary) override {
    const Json said = binary ? Json() : Json::parse(bytes, nullptr, false);
    if (!said.is_object()) return false;
    const std::string op = text_of(said, "op");
    if (op == "token") take_token(text_of(said, "token"));
    else if (op == "look") look_at(said);
    else if (op == "leave") leave({text_of(said, "port"), text_of(said, "as")});
    else if (op == "ask") ask(said);
    else return false;
    return true;
  }

  void take_news(const Json& news) override {
    if (!greeted_ || !may_look()) return;
    Json state{{"op", "state"}, {"state", news.at("state")}};
    send(state);
    if (!news.at("jobs").empty()) send(Json{{"op", "jobs"}, {"jobs", news.at("jobs")}});
    if (!news.at("events").empty()) send(Json{{"op", "events"}, {"events", news.at("events")}});
  }

  void look() override {
    const uint64_t version = room().hub.graph_version();
    if (version == std::exchange(graph_version_, version)) return;
    greet();
  }

 protected:
  std::optional<Message> next_shown() override {
    if (!may_look()) return std::nullopt;
    if (!parts_.empty()) {
      Message message = std::move(parts_.back());
      parts_.pop_back();
      return message;
    }
    // In turn, so that a stream of large pictures does not keep the others waiting.
    for (size_t tried = 0; tried < looks_.size(); ++tried) {
      auto at = looks_.upper_bound(last_);
      if (at == looks_.end()) at = looks_.begin();
      last_ = at->first;
      const auto shown = room().hub.newer(at->first, at->second.seen);
      if (!shown) continue;
      at->second.seen = shown->version;
      for (const Hub::Part& part : shown->parts) parts_.push_back({part.frame, at->first.as != "value"});
      if (!parts_.empty()) return next_shown();
    }
    return std::nullopt;
  }
  void tell_dropped(uint64_t count) override {
    send(Json{
        {"op", "events"},
        {"events",
         Json::array({{{"at_s", nullptr},
                       {"kind", "log"},
                       {"node", ""},
                       {"text", std::to_string(count) + " messages of the server were dropped: this browser was too "
                                                        "slow"}}})}});
  }

 private:
  struct Look {
    double most_hz = 0;
    uint64_t seen = 0;
  };

  bool may_look() const { return may_change_ || !room().token_to_look; }

  void greet() {
    if (!may_look()) {
      send(Json{{"op", "gone"}, {"why", "this address needs the token that `takt web` printed"}});
      return;
    }
    const Json graph = room().hub.graph();
    greeted_ = !graph.is_null();
    if (!greeted_) {
      send(Json{{"op", "gone"}, {"why", room().hub.why_gone()}});
      return;
    }
    send(Json{{"op", "hello"}, {"may_change", may_change_}, {"graph", graph}});
    if (const Json events = room().hub.events(); !events.empty()) send(Json{{"op", "events"}, {"events", events}});
  }

  void take_token(const std::string& token) {
    may_change_ = same_token(token, room().token);
    greet();
  }

  void look_at(const Json& said) {
    const View view{text_of(said, "port"), text_of(said, "as")};
    if (!may_look() || !among(kKinds, view.as) || looks_.size() >= kMostLooks || looks_.contains(view)) return;
    const Json hz = said.value("most_hz", Json(kScreenHz));
    Look& look = looks_[view];
    look.most_hz = hz.is_number() ? std::clamp(hz.get<double>(), 0.1, kScreenHz) : kScreenHz;
    room().hub.look(view, look.most_hz);
  }

  void leave(const View& view) {
    const auto look = looks_.find(view);
    if (look == looks_.end()) return;
    room().hub.leave(view, look->second.most_hz);
    looks_.erase(look);
  }

  void ask(const Json& said) {
    const Json id = said.value("id", Json());
    const Json question = said.value("question", Json());
    const auto refuse = [&](const char* why) { send(Json{{"op", "answer"}, {"id", id}, {"error", why}}); };
    if (!question.is_object()) return refuse("a question is an object with `do`");
    if (needs_token(question) && !may_change_)
      return refuse("this needs the token: open the address that `takt web` printed");
    if (!needs_token(question) && (!may_look() || !among(kLooks, text_of(question, "do"))))
      return refuse("the page may not ask that");
    room().ask(number(), question, [this, id](Json answer) {
      answer["op"] = "answer";
      answer["id"] = id;
      send(answer);
    });
  }

  bool may_change_ = false, greeted_ = false;
  uint64_t graph_version_ = UINT64_MAX;
  std::map<View, Look> looks_;
  View last_;
  std::vector<Message> parts_;  ///< of the view that is being sent
};

}  // namespace

std::unique_ptr<Session> page_session(const Room& room, uint64_t number) {
  return std::make_unique<PageSession>(room, number);
}

}  // namespace takt::web
