// A small bitmap font for captions: ASCII, five pixels wide, eight high with descenders.
#pragma once

namespace enfilade::render {

inline constexpr int kLetterWidth = 5, kLetterHeight = 8;
inline constexpr int kLetterAdvance = kLetterWidth + 1;

/// Whether the letter covers that pixel; what is not printable ASCII looks like '?'.
bool inked(char letter, int column, int row);

}  // namespace enfilade::render
