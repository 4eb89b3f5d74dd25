// Reads the keys of a body (SIDECAR.md), from sidecars and from extras of glTF nodes. Private to
// scene/.
#pragma once

#include "scene/import/bodies/json_cursor.hpp"
#include "scene/model/body_spec.hpp"

namespace enfilade::scene {

/// Keys with a default that were given.
struct ExplicitBodyFields {
  bool anchor = false, axis = false;
};

/// Reads "kind". Throws SidecarError.
BodyKind readBodyKind(const JsonCursor& cursor);

/// Reads all keys of a body of body.kind into it, angles from degrees. `more`: additional keys that
/// the caller reads. Throws SidecarError for unknown, missing or invalid keys.
ExplicitBodyFields readBodyFields(const JsonCursor& cursor, std::vector<const char*> more,
                                  BodySpec& body);

}  // namespace enfilade::scene
