// EventPlace: the storey and the room of a contact.
#pragma once

#include <string>

#include "scene/model/model.hpp"
#include "scene/world/data/tick_report.hpp"

namespace enfilade::server {

/// References to names of the model; empty: unknown.
struct EventPlace {
  const std::string& storey;
  const std::string& room;      ///< its number: IfcSpace.Name
  const std::string& roomName;  ///< IfcSpace.LongName
};

/// The room is the space whose solid contains the point of `a`, or is the nearest within 5 cm. The
/// storey is that of the room, else of the object b, else of the object a, else the level below the
/// point.
EventPlace findEventPlace(const scene::Model& model, const scene::ContactEvent& event);

}  // namespace enfilade::server
