// SPDX-License-Identifier: Apache-2.0
#include "rt/msg/object_reports.hpp"

#include "rt/msg/field_list.hpp"

namespace takt {

TAKT_FIELDS(ObjectReports, TAKT_FIELD(ObjectReports, in_map, ""), TAKT_FIELD(ObjectReports, names, ""),
            TAKT_FIELD(ObjectReports, places, ""), TAKT_FIELD(ObjectReports, attributes, ""))

}  // namespace takt
