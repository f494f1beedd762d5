// SPDX-License-Identifier: Apache-2.0
// What strangers send to takt web. The first byte chooses page or Foxglove, and whether the token was right at the
// handshake; then frames, each behind its kind (a byte) and its length (two). Whatever they are, nothing is asked of
// the run that changes it unless the token was given, and what waits for the stranger stays bounded.
#include <algorithm>
#include <span>
#include <string>

#include "graph/web/gate.hpp"
#include "graph/web/session.hpp"
#include "tests/fuzz/require.hpp"

using namespace takt;
using takt::fuzz::require;
using web::Json;

namespace {

constexpr size_t kMostWaiting = 2 << 20;

Json shown_graph() {
  return {{"name", "test"},
          {"nodes", {{{"name", "eye"}, {"inputs", Json::array()}, {"outputs", {"eye.pair"}}}}},
          {"ports", {{{"name", "eye.pair"}}}},
          {"parameters", {{{"node", "eye"}, {"param", "gain"}, {"unit", "s"}, {"kind", "number"}, {"value", "0.3"}}}}};
}

bool harmless(const Json& question) {
  const std::string what = question.value("do", "");
  return what == "get" || what == "top" || (what == "fault" && !question.contains("fault"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  std::span<const uint8_t> left(data + 1, size - 1);
  const bool page = (data[0] & 1) == 0, token = (data[0] & 2) != 0;
  bool given = token && !page;
  web::Hub hub([] {});
  hub.set_graph(shown_graph(), {{{"eye.pair"}, "eye.pair.left", "foxglove_msgs/msg/CompressedImage", "text"}});
  const web::Room room{hub, "secret", (data[0] & 4) != 0, [&](uint64_t, Json question, auto then) {
                         require(given || harmless(question));
                         then({{"ok", true}, {"parameters", Json::array()}});
                       }};
  const auto session = page ? web::page_session(room, 1) : web::foxglove_session(room, 1, given);
  session->look();
  while (left.size() >= 3) {
    const bool binary = (left[0] & 1) != 0;
    const size_t length = std::min<size_t>(left[1] | size_t{left[2]} << 8, left.size() - 3);
    const std::string_view frame(reinterpret_cast<const char*>(left.data() + 3), length);
    left = left.subspan(3 + length);
    if (page && frame.find("secret") != std::string_view::npos) given = true;
    try {
      if (!session->receive(frame, binary)) break;
    } catch (const Json::exception&) {  // the server lets such a one go
      break;
    }
    for (const web::Hub::Want& want : hub.wanted()) hub.put(want.view, {{1, web::frame_of("bytes")}});
    session->take_news(
        {{"state", {{"parameters", Json::array()}}}, {"jobs", Json::array()}, {"events", Json::array()}});
  }
  size_t waiting = 0;
  for (int i = 0; i < 100'000; ++i) {
    const auto message = session->next();
    if (!message) break;
    waiting += message->frame->size();
  }
  require(waiting < kMostWaiting);
  const web::Gate gate({"robot"}, 80);
  const std::string_view header(reinterpret_cast<const char*>(data), size);
  require(!gate.host(header) || header.find("localhost") != std::string_view::npos ||
          header.find("127.0.0.1") != std::string_view::npos || header.find("::1") != std::string_view::npos ||
          header.find("robot") != std::string_view::npos);
  static_cast<void>(gate.origin(header));
  return 0;
}
