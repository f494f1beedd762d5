// SPDX-License-Identifier: Apache-2.0
// Any bytes, to the parser, the decoders and the session of the LMS 400.
#include <vector>

#include "hal/laser/lms400/messages.hpp"
#include "hal/laser/lms400/session.hpp"
#include "tests/fuzz/session.hpp"

using namespace takt;
using namespace takt::lms400;
using takt::fuzz::require;

namespace {

void check_payload(std::span<const uint8_t> payload) {
  Parser parser;
  size_t frames = 0;
  parse(parser, Frame(payload).bytes(), [&](const Event& event) {
    require(event.kind == EventKind::frame &&
            std::equal(event.payload.begin(), event.payload.end(), payload.begin(), payload.end()));
    ++frames;
  });
  require(frames == 1 && !parser.begun());
  if (const auto answer = read_answer(payload))
    for (size_t i = 0; i < 5; ++i) {
      read_hex(answer->word(i));
      read_float_bits(answer->word(i));
    }
  const auto m = read_measurement(payload);
  if (!m) return;
  uint32_t sum = 0;
  for (size_t i = 0; i < m->count(); ++i) sum += m->distance(i) + m->remission(i);
  std::vector<uint8_t> written(kLargestPayload);
  require(write_measurement(*m, written) == payload.size());
  const auto again = read_measurement(std::span(written).first(payload.size()));
  require(again && again->count() == m->count() && again->number == m->number && again->first_tdeg == m->first_tdeg);
  for (size_t i = 0; i < m->count(); ++i) sum -= again->distance(i) + again->remission(i);
  require(sum == 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::span<const uint8_t> input(data, size);
  Parser parser;
  parse(parser, input, [](const Event& event) {
    if (event.kind == EventKind::frame) check_payload(event.payload);
  });
  const size_t piece = size > 0 ? 1 + data[0] % 97 : 1;
  require(fuzz::events_in(input, SIZE_MAX, Parser()) == fuzz::events_in(input, piece, Parser()));
  SessionSettings settings;
  settings.scan = {250, 1, 55, 70};
  Session session(settings);
  fuzz::converse(session, input);
  return 0;
}
