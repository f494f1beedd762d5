// SPDX-License-Identifier: Apache-2.0
#include "hal/stream/line_double.hpp"

namespace takt {
namespace {

constexpr std::array kKnown{Misbehaviour::none,    Misbehaviour::silent, Misbehaviour::unplugged,
                            Misbehaviour::garbage, Misbehaviour::frozen, Misbehaviour::wrong_crc};

}  // namespace

std::span<const Misbehaviour> LineDouble::known() const { return kKnown; }

void LineDouble::run_to(int64_t now_ns) {
  for (auto heard = line_.receive(); !heard.empty(); heard = line_.receive()) hear(heard, now_ns);
  act(now_ns);
  line_.run_to(now_ns);
}

void LineDouble::misbehave(Misbehaviour how) {
  if (how == misbehaviour_) return;
  if (how == Misbehaviour::unplugged) stream_->close();
  else if (misbehaviour_ == Misbehaviour::unplugged) static_cast<void>(stream_->open());
  misbehaviour_ = how;
}

void LineDouble::say(int64_t at_ns, std::span<const uint8_t> bytes) {
  std::vector<uint8_t> said(bytes.begin(), bytes.end());
  if (misbehaviour_ == Misbehaviour::silent) return;
  if (misbehaviour_ == Misbehaviour::garbage) {
    for (uint8_t& byte : said) byte = static_cast<uint8_t>((noise_ = noise_ * 1664525 + 1013904223) >> 24);
  }
  // Telegrams of all these devices end with their checksum.
  if (misbehaviour_ == Misbehaviour::wrong_crc && said.size() > 1) said.back() = static_cast<uint8_t>(~said.back());
  line_.send(at_ns, said);
}

}  // namespace takt
