// SPDX-License-Identifier: Apache-2.0
// What the thread that reads from a run and the one that serves browsers share.
//
//   hub.look({"head_camera.pair", "picture"}, 15);         // a session: somebody wants to see that
//   for (const Hub::Want& want : hub.wanted()) ...          // the link: what to ask the run for
//   hub.put({"head_camera.pair", "picture"}, {part});      // the link: made once, for all
//   if (const auto shown = hub.newer(view, seen)) ...       // a session: the newest one, others are passed over
//
// A view is made only while somebody looks at it. Any thread.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "hal/settings/json_text.hpp"

namespace takt::web {

using Json = nlohmann::ordered_json;

/// Where a server has the frozen records of its run.
inline constexpr std::string_view kFrozenPath = "/frozen/";

/// What is sent as it is, to as many as want it.
using Frame = std::shared_ptr<const std::string>;

inline Frame frame_of(std::string bytes) { return std::make_shared<const std::string>(std::move(bytes)); }

/// An output, and how it is wanted: a `kind` of the page, or what cdr_view() makes of a topic.
struct View {
  std::string port, as;
  bool operator<(const View& other) const { return std::tie(port, as) < std::tie(other.port, other.as); }
  bool operator==(const View&) const = default;
};

/// A topic that Foxglove can subscribe. Several outputs may tell of "/tf".
struct Channel {
  std::vector<std::string> ports;
  std::string topic, schema, definition;
};

inline View cdr_view(std::string port, const Channel& channel) {
  return {std::move(port), "cdr " + channel.schema + " " + channel.topic};
}

class Hub {
 public:
  /// One frame of a view; a pair of pictures has two.
  struct Part {
    int64_t stamp_ns = 0;
    Frame frame;
  };
  struct Shown {
    uint64_t version = 0;  ///< grows with each that is put
    std::vector<Part> parts;
  };
  struct Want {
    View view;
    double most_hz = 0;  ///< of the one who wants it most often
  };

  /// `wake`: called after anything new is there, by the thread that brought it.
  explicit Hub(std::function<void()> wake) : wake_(std::move(wake)) {}

  void look(const View& view, double most_hz);
  /// Once for each look().
  void leave(const View& view, double most_hz);
  std::vector<Want> wanted() const;
  /// Changes with each look() and leave().
  uint64_t wants() const;

  void put(const View& view, std::vector<Part> parts);
  std::optional<Shown> newer(const View& view, uint64_t seen) const;

  /// What the run is (attach::describe_json); null: there is none. `why` it ended.
  void set_graph(Json graph, std::vector<Channel> channels, std::string why = "");
  Json graph() const;
  std::vector<Channel> channels() const;
  std::string why_gone() const;
  uint64_t graph_version() const;

  /// State, jobs and events, for everybody who shows them.
  void broadcast(Json news);
  /// What was broadcast since the last call. By one thread.
  std::vector<Json> take_news();
  /// All events of this run, the newest kEvents; those who come later want them, too.
  Json events() const;
  static constexpr size_t kEvents = 1000;

 private:
  struct Slot {
    std::multiset<double> rates;
    Shown shown;
  };
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::map<View, Slot> slots_;
  uint64_t versions_ = 0, wants_ = 0, graph_version_ = 0;
  Json graph_;
  std::vector<Channel> channels_;
  std::string why_gone_;
  std::vector<Json> news_;
  Json events_ = Json::array();
};

}  // namespace takt::web
