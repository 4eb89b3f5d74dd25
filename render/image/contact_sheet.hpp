// Contact sheets: grids of images with captions.
#pragma once

#include <string>
#include <vector>

#include "render/image/image.hpp"

namespace enfilade::render {

/// An image of a contact sheet with its caption.
struct CaptionedImage {
  Image image;
  std::string caption;
};
/// A grid of images, each scaled to fit its cell, with a caption below and a title on top.
Image makeContactSheet(const std::vector<CaptionedImage>& pictures, const std::string& title,
                       int columns);

}  // namespace enfilade::render
