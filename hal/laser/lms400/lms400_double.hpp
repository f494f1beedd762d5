// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "hal/laser/lms400/frame.hpp"
#include "hal/laser/lms400/messages.hpp"
#include "hal/laser/range_source.hpp"
#include "hal/stream/line_double.hpp"

namespace takt::lms400 {

/// An LMS 400 at the end of a connection or a serial line, as far as D-2 knows it: login, scan configuration
/// with the answer of what became of it, Run, start and stop of the stream, filters taken but without effect. Methods
/// are answered twice. A scan is sent if the line is free when it is complete, and is lost otherwise. How long the real
/// one takes to answer is not known; this one takes 2 ms.
class Lms400Double final : public LineDouble {
 public:
  /// `baud` 0: the line needs no time.
  Lms400Double(std::unique_ptr<ByteStream> stream, RangeSource source, uint32_t baud, int64_t on_ns);
  bool streaming() const { return streaming_; }
  uint64_t scans_sent() const { return scans_sent_; }

 protected:
  void hear(std::span<const uint8_t> bytes, int64_t now_ns) override;
  void act(int64_t now_ns) override;

 private:
  void obey(std::string_view text, int64_t now_ns);
  void configure(std::string_view arguments, int64_t at_ns);
  void say_text(std::string_view text, int64_t at_ns);
  void send_scan(int64_t end_ns);

  RangeSource source_;
  Parser parser_;
  ScanConfiguration scan_;
  bool logged_in_ = false, streaming_ = false;
  int64_t last_end_ns_;
  uint16_t number_ = 0;
  uint64_t scans_sent_ = 0;
  std::vector<float> range_m_;
  std::vector<uint8_t> beams_, payload_;
};

}  // namespace takt::lms400
