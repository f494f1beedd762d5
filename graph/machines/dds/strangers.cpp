// SPDX-License-Identifier: Apache-2.0
#include "graph/machines/dds/strangers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <utility>

namespace takt::machines {
namespace {

constexpr auto kLookEvery = std::chrono::seconds(1);
constexpr auto kHandshake = std::chrono::seconds(5);  ///< that takes less than half a second between two slow machines
constexpr size_t kMostSaid = 20;                      ///< messages of the library

/// The hexadecimal number in front, which goes, with one character behind it.
std::optional<uint32_t> hex_number(std::string_view& text) {
  uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(std::min(text.size(), static_cast<size_t>(end - text.data()) + 1));
  return number;
}

/// Of the form udp/ADDRESS:PORT@INTERFACE.
std::string address_in(std::string_view line) {
  const size_t from = line.find(" udp");
  const size_t begin = from == line.npos ? line.npos : line.find('/', from);
  if (begin == line.npos) return "";
  const std::string_view text = line.substr(begin + 1, line.find_first_of(" )@", begin) - begin - 1);
  return std::string(text.substr(0, text.rfind(':')));
}

std::array<uint32_t, 3> prefix_of(const dds_guid_t& guid) {
  std::array<uint32_t, 3> prefix{};
  for (size_t i = 0; i < 12; ++i) prefix[i / 4] = prefix[i / 4] << 8 | guid.v[i];
  return prefix;
}

/// Participants that send what these readers take: only who has passed is among them.
std::set<std::array<uint32_t, 3>> heard_by(const std::vector<dds_entity_t>& readers) {
  std::set<std::array<uint32_t, 3>> heard;
  for (const dds_entity_t reader : readers) {
    std::array<dds_instance_handle_t, 16> writers{};
    const dds_return_t count = dds_get_matched_publications(reader, writers.data(), writers.size());
    for (size_t i = 0; i < std::min(writers.size(), static_cast<size_t>(std::max(count, 0))); ++i)
      if (dds_builtintopic_endpoint_t* const writer = dds_get_matched_publication_data(reader, writers[i])) {
        heard.insert(prefix_of(writer->participant_key));
        dds_builtintopic_free_endpoint(writer);
      }
  }
  return heard;
}

}  // namespace

std::optional<Seen> seen_in(std::string_view line) {
  constexpr std::string_view kMark = "SPDP ST0 ";
  const size_t at = line.find(kMark);
  if (at == line.npos || line.find(" NEW", at) == line.npos) return std::nullopt;
  Seen seen;
  std::string_view rest = line.substr(at + kMark.size());
  for (uint32_t& part : seen.id) {
    const auto number = hex_number(rest);
    if (!number) return std::nullopt;
    part = *number;
  }
  seen.secure = rest.find("(secure)") != rest.npos;
  seen.address = address_in(rest);
  return seen;
}

Strangers::Strangers(bool with_keys, std::function<void(const std::string&)> say)
    : with_keys_(with_keys), say_(say ? std::move(say) : [](const std::string&) {}) {
  dds_set_log_sink(logged, this);
  dds_set_trace_sink(traced, this);
}

Strangers::~Strangers() {
  dds_set_trace_sink(nullptr, nullptr);
  dds_set_log_sink(nullptr, nullptr);
  if (!told_.empty()) say_(fmt::format("not listened to in this run: {}", fmt::join(told_, ", ")));
}

void Strangers::traced(void* self, const dds_log_data_t* line) {
  const auto seen = seen_in({line->message, line->size});
  if (!seen) return;
  auto& of = *static_cast<Strangers*>(self);
  const std::lock_guard lock(of.mutex_);
  of.waiting_.try_emplace(seen->id, Known{*seen, Clock::now()});
}

void Strangers::logged(void* self, const dds_log_data_t* line) {
  auto& of = *static_cast<Strangers*>(self);
  std::string text(line->message, line->size);
  while (!text.empty() && (text.back() == '\n' || text.back() == '\0')) text.pop_back();
  {
    const std::lock_guard lock(of.mutex_);
    if (of.said_.size() >= kMostSaid || !of.said_.insert(text).second) return;
  }
  of.say_("DDS: " + text);
}

void Strangers::look(const std::vector<dds_entity_t>& readers) {
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + kLookEvery;
  const auto heard = heard_by(readers);
  const std::lock_guard lock(mutex_);
  for (auto one = waiting_.begin(); one != waiting_.end();) {
    const bool certain = one->second.seen.secure != with_keys_;
    const bool over = certain || now - one->second.since > kHandshake;
    if (over && !heard.contains(one->first) && (with_keys_ || certain)) tell(one->second.seen);
    one = over || heard.contains(one->first) ? waiting_.erase(one) : std::next(one);
  }
}

void Strangers::tell(const Seen& stranger) {
  const std::string who = stranger.address.empty() ? "a machine" : stranger.address;
  const char* const why = !with_keys_       ? "it has keys, and this machine runs without --keys"
                          : stranger.secure ? "its keys are of another authority, another graph, or at an end"
                                            : "it runs without keys";
  if (told_.insert(fmt::format("{} ({})", who, why)).second) say_(fmt::format("{} is not listened to: {}", who, why));
}

}  // namespace takt::machines
