// SPDX-License-Identifier: Apache-2.0
// Any bytes, to the parser, the decoders and the session of the LMS 2xx.
#include <cmath>
#include <initializer_list>
#include <vector>

#include "hal/laser/lms200/commands.hpp"
#include "hal/laser/lms200/session.hpp"
#include "tests/fuzz/session.hpp"

using namespace takt;
using namespace takt::lms200;
using takt::fuzz::require;

namespace {

void check_payload(std::span<const uint8_t> payload) {
  const Telegram again(kFromLms, payload);
  Parser parser = Parser::of_replies();
  size_t telegrams = 0;
  parse(parser, again.bytes(), [&](const Event& event) {
    require(event.kind == EventKind::telegram &&
            std::equal(event.payload.begin(), event.payload.end(), payload.begin(), payload.end()));
    ++telegrams;
  });
  require(telegrams == 1 && !parser.begun());
  read_success(payload);
  read_text(payload);
  read_variant(payload);
  if (const auto status = read_status(payload)) {
    const auto data = status_data(*status);
    const auto same =
        read_status(std::span(reply(Reply::status, data, 0x10).bytes()).subspan(kHeader, data.size() + 2));
    require(same && same->variant == status->variant && same->pollution == status->pollution);
  }
  if (const auto configuration = read_configuration(payload))
    require(write_configuration(*configuration).bytes().size() == 41);
  if (const auto error = read_error(payload)) require(error_text(*error)[0] != 0);
  const auto scan = read_scan(payload);
  if (!scan) return;
  for (size_t i = 0; i < scan->beams(); ++i)
    for (const uint8_t mode : std::initializer_list<uint8_t>{0, 4, 6, 0x3F}) {
      const float range = range_m(scan->word(i), mode, scan->millimetres);
      require(std::isnan(range) || (range >= 0 && range <= 327.6f));
    }
  if (scan->beams() <= 401) {
    const Telegram made = scan_telegram(*scan);
    const auto back = read_scan(made.bytes().subspan(kHeader, made.bytes().size() - kFraming));
    require(back && back->beams() == scan->beams() && back->indices == scan->indices &&
            back->quarters == scan->quarters);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::span<const uint8_t> input(data, size);
  Parser parser = Parser::of_replies();
  parse(parser, input, [](const Event& event) {
    if (event.kind == EventKind::telegram) check_payload(event.payload);
  });
  for (const bool commands : {false, true}) {
    const Parser fresh = commands ? Parser::of_commands() : Parser::of_replies();
    const size_t piece = size > 0 ? 1 + data[0] % 97 : 1;
    require(fuzz::events_in(input, SIZE_MAX, fresh) == fuzz::events_in(input, piece, fresh));
  }
  for (const Variant variant : {Variant{180, 100}, Variant{180, 25}}) {
    Session session({500000, variant, 0, true});
    fuzz::converse(session, input);
  }
  return 0;
}
