// Names of rooms on plans: the long name, and below it the number.
#pragma once

#include <cstdint>

#include "server/plans/captions.hpp"
#include "server/plans/plan_drawing.hpp"

namespace enfilade::server {

/// Places the names of the storey's spaces in them: in the middle, or where no mark is in the way;
/// in two lines or smaller where a room is narrow. A room without space for its name shows its
/// number alone, and the name joins the list.
void placeSpaceNames(CaptionList& captions, const render::Canvas& measuring, const PlanView& view,
                     const scene::Model& model, std::uint32_t storey);

}  // namespace enfilade::server
