// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <dds/dds.h>
#include <fmt/format.h>

#include <stdexcept>
#include <string>

#include "hal/dds/socket_buffer.hpp"

namespace takt::dds {

/// The entity itself. Throws std::runtime_error with what could not be made.
inline dds_entity_t made(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw std::runtime_error(fmt::format("DDS: no {}: {}", what, dds_strretcode(-entity)));
  return entity;
}

/// A domain on one interface, by its IP address: nothing is sent or heard on any other. Multicast is for finding each
/// other alone. `general`, `more`: what else Cyclone DDS is told, as XML in and behind `General`. Throws
/// std::runtime_error.
inline dds_entity_t domain_on(const std::string& address, int domain, const std::string& general,
                              const std::string& more) {
  const std::string configuration = fmt::format(
      "<General><Interfaces><NetworkInterface address=\"{}\"/></Interfaces><AllowMulticast>spdp</AllowMulticast>"
      "{}</General><Internal><SocketReceiveBufferSize min=\"default\" max=\"{}B\"/></Internal>{}",
      address, general, kSocketBuffer, more);
  return made(dds_create_domain(static_cast<dds_domainid_t>(domain), configuration.c_str()),
              fmt::format("domain on {}; is that address one of this machine?", address));
}

}  // namespace takt::dds
