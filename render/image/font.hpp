// A bitmap font for captions: ASCII, five pixels wide, eight pixels high with descenders.
#pragma once

namespace enfilade::render {

inline constexpr int kLetterWidth = 5, kLetterHeight = 8;
inline constexpr int kLetterAdvance = kLetterWidth + 1;

/// Whether the letter covers the pixel; characters other than printable ASCII look like '?'.
bool isLetterPixel(char letter, int column, int row);

}  // namespace enfilade::render
