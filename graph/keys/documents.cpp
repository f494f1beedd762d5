// SPDX-License-Identifier: Apache-2.0
#include "graph/keys/documents.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace takt::keys {
namespace {

constexpr const char* kHead = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";

std::string topics_of(const graph::GraphSpec& graph, const std::string& machine) {
  return fmt::format("takt/{}/{}/*", graph.name, machine);
}

/// `what`: publish or subscribe.
std::string topics(const char* what, const std::vector<std::string>& names) {
  std::string text = fmt::format("        <{}><topics>\n", what);
  for (const std::string& name : names) text += fmt::format("          <topic>{}</topic>\n", name);
  return text + fmt::format("        </topics></{}>\n", what);
}

}  // namespace

std::string subject_of(const graph::GraphSpec& graph, const std::string& machine) {
  return fmt::format("CN={}.{}", machine, graph.name);
}

std::string governance(const graph::GraphSpec& graph) {
  return fmt::format(R"({}<dds>
  <domain_access_rules>
    <domain_rule>
      <domains><id>{}</id></domains>
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>NONE</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>NONE</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)",
                     kHead, graph.network.domain);
}

std::string permissions(const graph::GraphSpec& graph, const std::string& machine, std::time_t from,
                        std::time_t until) {
  std::vector<std::string> others;
  for (const graph::MachineSpec& other : graph.machines)
    if (other.name != machine) others.push_back(topics_of(graph, other.name));
  return fmt::format(R"({}<dds>
  <permissions>
    <grant name="{}">
      <subject_name>{}</subject_name>
      <validity><not_before>{}</not_before><not_after>{}</not_after></validity>
      <allow_rule>
        <domains><id>{}</id></domains>
{}{}      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)",
                     kHead, machine, subject_of(graph, machine), utc(from), utc(until), graph.network.domain,
                     topics("publish", {topics_of(graph, machine)}), topics("subscribe", others));
}

std::string utc(std::time_t time) { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(time)); }

}  // namespace takt::keys
