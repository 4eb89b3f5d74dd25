// What a body's keys say (SIDECAR.md), for sidecars and for extras of glTF nodes. Private to
// scene/.
#pragma once

#include "scene/import/bodies/json_cursor.hpp"
#include "scene/model/body_spec.hpp"

namespace enfilade::scene {

/// Whether what has a default of its own was there.
struct BodyFields {
  bool anchor = false, axis = false;
};

/// Reads "kind". Throws SidecarError.
BodyKind kindOf(const JsonPlace& place);

/// Reads all keys of a body of body.kind into it, angles from degrees. `more`: keys besides that
/// the caller reads. Throws SidecarError for keys that are unknown, missing or senseless.
BodyFields readBodyFields(const JsonPlace& place, std::vector<const char*> more, BodySpec& body);

}  // namespace enfilade::scene
