// Plans from above, for maps of walks and for `inspect --plan`: where storeys are, how a plan is
// taken and made ready to be drawn on.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "render/image/image.hpp"

namespace enfilade::server {

using collision::Vec3;

/// A plan as it was drawn, with the ids of what is seen, pixel by pixel.
struct PlanPicture {
  render::Image colour;
  std::vector<std::uint32_t> ids;
};

/// Takes the picture that a camera asks for; nullopt when there is none to be had.
using TakePicture = std::function<std::optional<PlanPicture>(const render::Camera&)>;

inline constexpr double kPlanCut = 1.2;  ///< metres above the floor at which storeys are cut, as
                                         ///< plans are drawn: through the windows

inline constexpr render::Colour kPlanInk{40, 40, 46}, kPlanPaper{250, 249, 246};

/// The camera of a plan of `bounds`, as large as fits into so many pixels, cut kPlanCut above
/// `floor`.
render::Camera planCamera(const scene::Box& bounds, double floor, double widest, double highest);

/// Softened, so that what is drawn on it is read first, and outlined by object: a cut wall is
/// hollow, and would be hard to tell from the floor by its colour.
render::Image planGround(const PlanPicture& plan);

/// Copies `image`, which fits, to where its top left corner comes to (left, top).
void paste(render::Image& onto, const render::Image& image, int left, int top);
render::Image blankImage(int width, int height);

/// Something at a height, in metres: where feet were, or a floor; `weight` > 0, of any unit.
struct WeightedHeight {
  double height = 0;
  double weight = 1;
};

/// Where most of the weight lies: at most `most` heights, ascending, two metres and more apart. A
/// height with less than `leastShare` of all weight is none, the first excepted.
std::vector<double> storeyHeights(std::span<const WeightedHeight> heights, double leastShare,
                                  std::size_t most);

}  // namespace enfilade::server
