// SPDX-License-Identifier: Apache-2.0
// Objects as messages tell of them, by names and with values as text: understood by the network, and written by it.
#pragma once
#include <algorithm>
#include <cmath>
#include <optional>

#include "nodes/mapping_3d/pose.hpp"
#include "nodes/semantic/similarity.hpp"
#include "rt/msg/ace/object_reports.hpp"

namespace takt::semantic {

/// One object of a message; valid as long as that.
struct Report {
  std::string_view name, type;
  ObjectPlace place;
  std::span<const ObjectAttribute> attributes;
};

/// visit(report) for each object of a message, whatever it holds: what its arrays lack or promise too much of is not
/// there.
template <class Visit>
void for_each_report(const ObjectReports& reports, Visit visit);

/// What of a report the network has no place for, and so is left out.
enum class Misfit : uint8_t { type, attribute, value, place };
constexpr size_t kMisfits = 4;

/// Memory is taken by the constructor. One thread at a time.
class ReportReader {
 public:
  explicit ReportReader(const SemanticMap& map) : map_(map) {}

  /// The report as an observation of a type of the network, its place moved by `to_map`; valid until the next call.
  /// None where the type is unknown or the place no number. misfit(what, attribute) for all that is left out, the
  /// attribute null where the whole report is.
  template <class OnMisfit>
  std::optional<Observation> read(const Report& report, const mapping_3d::Affine& to_map, int64_t stamp_ns,
                                  OnMisfit misfit);

 private:
  /// Of that kind and name, or kNoNode.
  NodeId find(std::string_view name, Kind kind) const {
    const NodeId node = map_.network().find(name);
    return node != kNoNode && map_.network().kind(node) == kind ? node : kNoNode;
  }
  const SemanticMap& map_;
  std::array<State, kMostStates> states_;
};

/// Writes as much as fits and returns what was written: "left out level of a cup, `half` is no value of it: 3 such so
/// far". No allocation.
std::string_view explain(const Report& report, Misfit misfit, const ObjectAttribute* attribute, uint64_t so_far,
                         std::span<char> into);

/// All objects of the map with their known states, in the map frame; as many as the message holds.
void write_reports(const SemanticMap& map, ObjectReports& out);

/// Text in an array of a message, which need not be ended.
template <size_t Size>
std::string_view text_in(const char (&text)[Size]) {
  return {text, static_cast<size_t>(std::find(text, text + Size, '\0') - text)};
}
/// False: too long, and nothing is written.
template <size_t Size>
bool set_text(std::string_view text, char (&into)[Size]) {
  if (text.size() >= Size) return false;
  into[text.copy(into, Size)] = '\0';
  return true;
}

// ---------------------------------------------------------------------------------------------------------------------

template <class Visit>
void for_each_report(const ObjectReports& reports, Visit visit) {
  const auto attributes = reports.attributes.items();
  size_t first = 0;
  for (size_t i = 0; i < std::min(reports.names.size, reports.places.size); ++i) {
    const ObjectPlace& place = reports.places[i];
    const size_t left = attributes.size() - first;
    const size_t count =
        place.attributes > 0 ? static_cast<size_t>(std::min(place.attributes, static_cast<float>(left))) : 0;
    const ObjectName& name = reports.names[i];
    visit(Report{text_in(name.name), text_in(name.type), place, attributes.subspan(first, count)});
    first += count;
  }
}

template <class OnMisfit>
std::optional<Observation> ReportReader::read(const Report& report, const mapping_3d::Affine& to_map, int64_t stamp_ns,
                                              OnMisfit misfit) {
  const ObjectPlace& at = report.place;
  const NodeId type = find(report.type, Kind::type);
  if (type == kNoNode) return misfit(Misfit::type, nullptr), std::nullopt;
  if (!std::isfinite(at.x_m + at.y_m + at.z_m)) return misfit(Misfit::place, nullptr), std::nullopt;
  size_t count = 0;
  for (const ObjectAttribute& said : report.attributes) {
    const NodeId attribute = find(text_in(said.name), Kind::attribute);
    const Value value = attribute == kNoNode ? Value{} : value_of(map_.attribute(attribute), text_in(said.value));
    if (attribute == kNoNode || count == states_.size()) misfit(Misfit::attribute, &said);
    else if (!known(value)) misfit(Misfit::value, &said);
    else states_[count++] = {attribute, value};
  }
  const mapping_3d::Position place = transformed(to_map, at.x_m, at.y_m, at.z_m);
  const double score = at.score >= 0 && at.score <= 1 ? at.score : 0;
  return Observation{type, place.x_m, place.y_m, score, stamp_ns, std::span(states_).first(count), report.name};
}

}  // namespace takt::semantic
