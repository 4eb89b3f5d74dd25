// The marks of a walk on the plan of one storey: paths, contacts, blocked walks, cameras, and
// their captions.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "server/plans/captions.hpp"
#include "server/plans/path_style.hpp"
#include "server/plans/plan_drawing.hpp"
#include "server/plans/walk_trace.hpp"

namespace enfilade::server {

/// A camera's field of view, on the canvas.
struct Wedge {
  render::Point eye, left, right;  ///< ends of the sides
};
/// The wedge at `eye` along the unit vector (x, y).
Wedge makeWedge(render::Point eye, double x, double y);
void drawWedge(render::Canvas& canvas, const Wedge& wedge);

class StoreyMarks {
 public:
  /// Finds the places of all marks and captions. A mark belongs to the storey that is nearest of
  /// those with plans, at `floors` (metres). `rooms` get their names. Captions without space join
  /// `entries`.
  StoreyMarks(const PlanView& view, const std::vector<double>& floors, const WalkTrace& trace,
              std::span<const scene::Space> rooms, std::vector<CaptionEntry>& entries);

  void draw(render::Canvas& canvas) const;

  const std::vector<Wedge>& wedges() const { return wedges_; }
  const std::vector<Caption>& captions() const { return captions_.captions(); }

 private:
  struct Line {
    std::vector<render::Point> points;
    PathStyle style;
  };
  struct Dot {
    render::Point at;
    double radius;
    render::Colour colour;
  };

  bool isHere(double height) const;
  bool startsHere(const WalkedPath& path) const;
  void addPath(const WalkedPath& path, const PathStyle& style);
  void addContact(const MapContact& contact);
  void addWedge(const MapCapture& capture);
  void addCaptions(const WalkTrace& trace, const std::vector<PathStyle>& styles);

  const PlanView& view_;
  const std::vector<double>& floors_;
  std::vector<Line> lines_;
  std::vector<Dot> starts_, blocked_, contacts_;
  std::vector<Wedge> wedges_;
  CaptionList captions_;
};

}  // namespace enfilade::server
