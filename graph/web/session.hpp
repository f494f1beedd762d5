// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "graph/web/hub.hpp"

namespace takt::web {

/// What every session uses. Outlives them.
struct Room {
  Hub& hub;
  std::string token;           ///< lets change the run
  bool token_to_look = false;  ///< looking needs it, too
  /// Asks the run without waiting; `then` is called later, on the server's thread, unless the session has ended.
  std::function<void(uint64_t session, Json question, std::function<void(Json answer)> then)> ask;
};

/// One WebSocket, from its handshake to its end. On the server's thread, all of it.
class Session {
 public:
  struct Message {
    Frame frame;
    bool binary = false;
  };
  Session(const Room& room, uint64_t number) : room_(room), number_(number) {}
  virtual ~Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// False: the other side does not keep to the protocol, and is let go.
  virtual bool receive(std::string_view bytes, bool binary) = 0;
  /// State, jobs and events that came.
  virtual void take_news(const Json& news) = 0;
  /// Something may be new in the hub.
  virtual void look() {}
  /// The next message, when the other side can take one; nothing: there is none.
  std::optional<Message> next();
  uint64_t number() const { return number_; }

 protected:
  /// In order, each: what the other side does not take within kMostWaiting bytes is dropped, the oldest first, and
  /// counted.
  void send(Frame frame, bool binary = false);
  void send(const Json& json) { send(frame_of(json.dump(-1, ' ', false, Json::error_handler_t::replace))); }
  /// The newest of what is shown: passed over where the other side is slower.
  virtual std::optional<Message> next_shown() { return std::nullopt; }
  /// Tells that so many were dropped.
  virtual void tell_dropped(uint64_t count) = 0;
  const Room& room() const { return room_; }

 private:
  static constexpr size_t kMostWaiting = 1 << 20;
  const Room& room_;
  const uint64_t number_;
  std::deque<Message> waiting_;
  size_t waiting_bytes_ = 0;
  uint64_t dropped_ = 0;
};

std::unique_ptr<Session> page_session(const Room& room, uint64_t number);
std::unique_ptr<Session> foxglove_session(const Room& room, uint64_t number, bool may_change);

}  // namespace takt::web
