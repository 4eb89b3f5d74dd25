// Captions on plans. Their places next to marks are free of marks and of each other. Those that a
// plan has no space for are in a list.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/image/canvas.hpp"

namespace enfilade::server {

/// A rectangle on a canvas.
struct CanvasBox {
  render::Point topLeft;
  double width = 0, height = 0;

  bool contains(render::Point p) const {
    return p.x >= topLeft.x && p.y >= topLeft.y && p.x <= topLeft.x + width &&
           p.y <= topLeft.y + height;
  }
};
bool isOverlapping(const CanvasBox& a, const CanvasBox& b);

/// A thin line from a mark to its caption.
struct Leader {
  render::Point from, to;
};

struct Caption {
  std::string text;
  render::TextStyle style;
  CanvasBox box;
  std::optional<Leader> leader = std::nullopt;  ///< of a caption away from its mark
};

/// A point with a caption.
struct CaptionMark {
  render::Point at;
  bool prefersLeft = false;  ///< the caption's side, if both are free
  bool needsLeader = false;  ///< also of a caption next to it
};

/// A line of the list below a plan: `key` stands on the plan in place of the text.
struct CaptionEntry {
  std::string key, text;
};

/// Finds places for captions. Marks are reserved first, so that no caption covers one. Works on a
/// raster, whose cells are larger than what they hold: places that are free there are free.
class CaptionPlacer {
 public:
  enum class Avoid : std::uint8_t { marks, marksAndLines };  ///< and always other captions

  /// Captions lie in `frame`. `unit`: canvas units of a thin line.
  CaptionPlacer(const CanvasBox& frame, double unit);

  const CanvasBox& frame() const { return frame_; }
  double unit() const { return unit_; }

  void reserve(const CanvasBox& box) { setCells(box, kMark); }
  void reserveLine(render::Point from, render::Point to, double thickness);
  /// Captions cover the line, such as a path, only if there is no other place.
  void avoidLine(render::Point from, render::Point to, double thickness);

  bool isFree(const CanvasBox& box, Avoid avoid) const;
  void take(const CanvasBox& box) { setCells(box, kCaption); }

  struct Place {
    CanvasBox box;
    std::optional<Leader> leader;
  };
  /// Takes the nearest free place around a mark: next to it, or with a leader of at most
  /// `maxLeader` units; nullopt if all are taken.
  std::optional<Place> place(const CaptionMark& mark, const render::TextSize& size,
                             double maxLeader);

 private:
  using Cell = std::uint8_t;
  static constexpr Cell kLine = 1, kMark = 2, kCaption = 4, kLeader = 8;

  template <class Visit>
  void visitLine(render::Point from, render::Point to, double thickness, const Visit& visit) const;
  template <class Visit>
  bool allCells(const CanvasBox& box, const Visit& visit) const;
  void setCells(const CanvasBox& box, Cell value);
  bool hasNone(const CanvasBox& box, Cell mask) const;
  bool isLeaderFree(const Leader& leader, Avoid avoid) const;
  std::optional<Place> findNear(const CaptionMark& mark, const render::TextSize& size,
                                Avoid avoid) const;
  std::optional<Place> findFar(render::Point mark, const render::TextSize& size, double maxLeader,
                               Avoid avoid) const;

  CanvasBox frame_;
  double unit_ = 1, cellSize_ = 1;
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
};

/// The captions of one plan and the list below the plans of one sheet.
class CaptionList {
 public:
  /// `entries` is shared by the plans of a sheet.
  CaptionList(const CanvasBox& frame, double unit, std::vector<CaptionEntry>& entries)
      : placer(frame, unit), entries_(entries) {}

  /// Places the text at a mark. A mark outside of the frame is only listed. Without space for it,
  /// the mark gets a number, and the text joins the list. `where` says in the list where a mark is
  /// that has no space for a number either.
  void add(const render::Canvas& measuring, const CaptionMark& mark, const std::string& text,
           const render::TextStyle& style, const std::string& where);
  /// A caption whose place the caller has taken.
  void addPlaced(Caption caption) { captions_.push_back(std::move(caption)); }
  void addEntry(CaptionEntry entry) { entries_.push_back(std::move(entry)); }

  const std::vector<Caption>& captions() const { return captions_; }
  /// Leaders come below the marks, texts above.
  void drawLeaders(render::Canvas& canvas) const;
  void drawTexts(render::Canvas& canvas) const;

  CaptionPlacer placer;

 private:
  std::vector<Caption> captions_;
  std::vector<CaptionEntry>& entries_;
};

}  // namespace enfilade::server
