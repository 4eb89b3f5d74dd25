// Names of rooms on plans: the long name, and below it the number.
#pragma once

#include <span>

#include "server/plans/captions.hpp"
#include "server/plans/plan_drawing.hpp"

namespace enfilade::server {

/// Places the names of spaces in them: in the middle, or where no mark is in the way. Names have
/// two lines or are smaller where a room is narrow. A room without space for its name shows its
/// number alone, and the name joins the list.
void placeSpaceNames(CaptionList& captions, const render::Canvas& measuring, const PlanView& view,
                     std::span<const scene::Space> spaces);

}  // namespace enfilade::server
