// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "transport_conformance.hpp"

TEST_CASE("the local transport keeps what every transport promises") {
  const auto transport = takt::make_local_transport(takt::test::conformance_ports());
  takt::test::transport_conformance(*transport);
}
