// SPDX-License-Identifier: Apache-2.0
#include "hal/gpio/chip_double.hpp"

#include <algorithm>
#include <cerrno>

namespace takt::gpio {
namespace {

constexpr int64_t kMostSteps = 1000;

}  // namespace

/// One open chip of the double.
class ChipDoubleFile final : public LineChip {
 public:
  explicit ChipDoubleFile(ChipDouble& chip) : chip_(chip) {}
  ~ChipDoubleFile() override { ChipDoubleFile::close(); }
  int open(const std::string&) override {
    close();
    open_ = chip_.present();
    return open_ ? 0 : ENOENT;
  }
  void close() override {
    for (auto* line : slots_) {
      if (line != nullptr) line->taken = line->is_output = false;
    }
    slots_ = {};
    open_ = false;
  }
  std::optional<uint32_t> find(const std::string& name) override {
    for (uint32_t i = 0; i < chip_.lines_.size(); ++i) {
      if (chip_.lines_[i].name == name) return i;
    }
    return std::nullopt;
  }
  int request_input(size_t slot, uint32_t offset) override { return request(slot, offset, false); }
  int request_output(size_t slot, uint32_t offset, bool level) override {
    const int error = request(slot, offset, true);
    return error != 0 ? error : set(slot, level);
  }
  int get(size_t slot, bool& level) override {
    if (!there()) return ENODEV;
    chip_.live();
    level = slots_[slot]->level;
    return 0;
  }
  int set(size_t slot, bool level) override {
    if (!there()) return ENODEV;
    auto& line = *slots_[slot];
    const bool rises = level && !line.level;
    line.rises += rises ? 1 : 0;
    line.level = level;
    if (rises && chip_.on_rise_) chip_.on_rise_(static_cast<uint32_t>(&line - chip_.lines_.data()));
    return 0;
  }
  int next_event(size_t slot, LineEvent& event) override {
    if (!there()) return ENODEV;
    chip_.live();
    auto& events = slots_[slot]->events;
    if (events.empty()) return EAGAIN;
    event = events.front();
    events.pop_front();
    return 0;
  }

 private:
  /// Once gone, it must be opened again.
  bool there() { return open_ = open_ && chip_.present(); }
  int request(size_t slot, uint32_t offset, bool output) {
    if (!there()) return ENODEV;
    if (offset >= chip_.lines_.size()) return EINVAL;
    ChipDouble::Line& line = chip_.lines_[offset];
    if (line.taken) return EBUSY;
    line.taken = true;
    line.is_output = output;
    chip_.live();
    line.events.clear();
    slots_[slot] = &line;
    return 0;
  }

  ChipDouble& chip_;
  std::array<ChipDouble::Line*, kMostLines> slots_{};
  bool open_ = false;
};

ChipDouble::ChipDouble(std::vector<std::string> names, const Clock& clock, LevelSource source)
    : clock_(clock), source_(std::move(source)) {
  for (std::string& name : names) {
    Line line;
    line.name = std::move(name);
    lines_.push_back(std::move(line));
  }
}

std::unique_ptr<LineChip> ChipDouble::chip() { return std::make_unique<ChipDoubleFile>(*this); }

std::span<const Misbehaviour> ChipDouble::known() const {
  static constexpr std::array kKnown{Misbehaviour::none, Misbehaviour::unplugged, Misbehaviour::frozen};
  return kKnown;
}

void ChipDouble::live() {
  if (!source_) return;
  const int64_t now_ns = clock_.now_ns();
  // Nobody looks at edges that passed long ago.
  const int64_t from_ns =
      lived_ns_ == INT64_MIN ? now_ns : std::max(lived_ns_ + step_ns(), now_ns - kMostSteps * step_ns());
  for (int64_t at_ns = from_ns; at_ns <= now_ns; at_ns += step_ns()) {
    lived_ns_ = at_ns;
    if (how_.load() == Misbehaviour::frozen) continue;
    const uint32_t levels = source_(at_ns);
    for (uint32_t i = 0; i < lines_.size(); ++i) set(i, (levels >> i & 1) != 0, at_ns);
  }
}

void ChipDouble::set(uint32_t offset, bool level, int64_t at_ns) {
  Line& line = lines_[offset];
  if (line.is_output || line.level == level) return;
  line.level = level;
  if (!line.taken) return;
  if (line.events.size() == kEvents) line.events.pop_front();
  line.events.push_back({level, at_ns});
}

}  // namespace takt::gpio
