// A figure consists of closed surfaces that overlap: limbs between joints, torso and head. Its
// dimensions are those of a person of 1.75 m (metres, feet at the origin, x ahead, z to the right).
// They are then scaled to height and radius 1.
//
// A crouching person bends the knees and leans forward, down to 0.6 of the height; the figure of a
// lower avatar is compressed. In deep poses limbs are foreshortened, so that the figure stays
// within the prism that the world moves.
#include "render/figure.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

using scene::Vec3;

constexpr double kPersonHeight = 1.75, kPersonRadius = 0.3;  // metres; the default avatar
constexpr double kMaxGirth = 1.25;     // of the person's width; wider avatars stay slim
constexpr double kDeepestPose = 0.6;   // height of the deepest pose, of the standing one
constexpr std::size_t kPoses = 9;      // from standing to the deepest one
constexpr double kDeepestLean = 0.24;  // radians, of the torso
constexpr double kHipHeight = 0.88;    // metres, standing
constexpr int kLimbSides = 10, kTorsoSides = 16;
constexpr int kCapRings = 2;  // of each rounded end of a limb

double blend(double standing, double deepest, double crouch) {
  return standing + crouch * (deepest - standing);
}
Vec3 blend(const Vec3& standing, const Vec3& deepest, double crouch) {
  return standing + crouch * (deepest - standing);
}

/// The closed surface through rings of equally many points, counter-clockwise around the line from
/// the first pole to the last one.
struct Surface {
  Vec3 first, last;  ///< poles
  std::vector<std::vector<Vec3>> rings;
};

void addSurface(scene::Mesh& mesh, const Surface& surface) {
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  const auto sides = static_cast<std::uint32_t>(surface.rings.front().size());
  const auto count = static_cast<std::uint32_t>(surface.rings.size());
  mesh.positions.push_back(surface.first.cast<float>());
  for (const std::vector<Vec3>& ring : surface.rings)
    for (const Vec3& point : ring) mesh.positions.push_back(point.cast<float>());
  mesh.positions.push_back(surface.last.cast<float>());
  const std::uint32_t last = base + 1 + count * sides;
  const auto corner = [&](std::uint32_t ring, std::uint32_t side) {
    return base + 1 + ring * sides + side % sides;
  };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  };
  for (std::uint32_t side = 0; side < sides; ++side) {
    add(base, corner(0, side + 1), corner(0, side));
    for (std::uint32_t ring = 0; ring + 1 < count; ++ring) {
      add(corner(ring, side), corner(ring, side + 1), corner(ring + 1, side + 1));
      add(corner(ring, side), corner(ring + 1, side + 1), corner(ring + 1, side));
    }
    add(corner(count - 1, side), corner(count - 1, side + 1), last);
  }
}

/// The end of a limb: a sphere.
struct Ball {
  Vec3 centre;
  double radius;
};

/// The convex hull of two spheres, neither of which contains the other.
void addLimb(scene::Mesh& mesh, const Ball& from, const Ball& to) {
  const Vec3 axis = to.centre - from.centre;
  const Vec3 along = axis.normalized();
  const Vec3 across = along.unitOrthogonal(), aside = along.cross(across);
  // The cone touches both spheres where their normal has this angle to the axis.
  const double tangent = std::acos(std::clamp((from.radius - to.radius) / axis.norm(), -1.0, 1.0));
  const auto at = [&](const Ball& ball, double angle, double turn) {
    return Vec3(ball.centre + ball.radius * (std::cos(angle) * along +
                                             std::sin(angle) * (std::cos(turn) * across +
                                                                std::sin(turn) * aside)));
  };
  Surface surface{at(from, std::numbers::pi, 0), at(to, 0, 0), {}};
  const auto addRing = [&](const Ball& ball, double angle) {
    std::vector<Vec3>& ring = surface.rings.emplace_back();
    for (int side = 0; side < kLimbSides; ++side)
      ring.push_back(at(ball, angle, 2 * std::numbers::pi * side / kLimbSides));
  };
  for (int ring = 1; ring <= kCapRings; ++ring)
    addRing(from, blend(std::numbers::pi, tangent, double{1} * ring / kCapRings));
  for (int ring = kCapRings; ring >= 1; --ring) addRing(to, tangent * ring / kCapRings);
  addSurface(mesh, surface);
}

/// A horizontal ellipse of the standing person.
struct Section {
  double height, halfWidth, halfDepth;  ///< metres
};

/// The surface through sections around a vertical axis at `ahead`, each point moved by `pose`.
template <class Pose>
void addSections(scene::Mesh& mesh, const std::vector<Section>& sections, double ahead,
                 const Pose& pose) {
  Surface surface{pose(Vec3(ahead, sections.front().height, 0)),
                  pose(Vec3(ahead, sections.back().height, 0)),
                  {}};
  for (std::size_t i = 1; i + 1 < sections.size(); ++i) {
    std::vector<Vec3>& ring = surface.rings.emplace_back();
    for (int side = 0; side < kTorsoSides; ++side) {
      const double turn = 2 * std::numbers::pi * side / kTorsoSides;
      ring.push_back(pose(Vec3(ahead + sections[i].halfDepth * std::sin(turn), sections[i].height,
                               sections[i].halfWidth * std::cos(turn))));
    }
  }
  addSurface(mesh, surface);
}

/// The first and last sections are poles.
const std::vector<Section>& getTorsoSections() {
  static const std::vector<Section> sections{
      {0.775, 0, 0},         {0.785, 0.070, 0.060}, {0.820, 0.130, 0.090}, {0.900, 0.163, 0.110},
      {0.980, 0.152, 0.104}, {1.080, 0.134, 0.094}, {1.190, 0.148, 0.102}, {1.300, 0.172, 0.110},
      {1.370, 0.188, 0.102}, {1.415, 0.180, 0.090}, {1.450, 0.130, 0.072}, {1.480, 0.056, 0.052},
      {1.490, 0, 0}};
  return sections;
}

std::vector<Section> makeHeadSections() {
  constexpr double kMiddle = 1.620, kHalfHeight = 0.130, kHalfWidth = 0.083, kHalfDepth = 0.098;
  constexpr int kRings = 9;
  std::vector<Section> sections;
  for (int ring = 0; ring <= kRings + 1; ++ring) {
    const double angle = std::numbers::pi * ring / (kRings + 1);
    // A chin: narrower below the middle than an ellipsoid.
    const double narrow = 1 - 0.18 * std::max(0.0, std::cos(angle));
    sections.push_back({kMiddle - kHalfHeight * std::cos(angle),
                        kHalfWidth * narrow * std::sin(angle),
                        kHalfDepth * narrow * std::sin(angle)});
  }
  return sections;
}

void addLeg(scene::Mesh& mesh, double side, double crouch, const Vec3& hip) {
  const Vec3 knee(blend(0.012, 0.20, crouch), blend(0.49, 0.36, crouch),
                  side * blend(0.095, 0.125, crouch));
  const Vec3 ankle(blend(-0.015, -0.04, crouch), 0.085, side * 0.1);
  const Vec3 heel(ankle.x() - 0.012, 0.043, ankle.z());
  const Vec3 toes(ankle.x() + 0.155, 0.030, ankle.z() + side * 0.014);
  addLimb(mesh, {hip + Vec3(0, 0, side * 0.088), 0.084}, {knee, 0.054});
  addLimb(mesh, {knee, 0.054}, {ankle, 0.037});
  addLimb(mesh, {heel, 0.043}, {toes, 0.030});
}

template <class Pose>
void addArm(scene::Mesh& mesh, double side, double crouch, const Pose& lean) {
  const Vec3 shoulder = lean(Vec3(0, 1.366, side * 0.170));
  const Vec3 elbow =
      blend(Vec3(-0.022, 1.115, side * 0.218), Vec3(0.0, 0.50, side * 0.232), crouch);
  const Vec3 wrist =
      blend(Vec3(0.042, 0.865, side * 0.228), Vec3(0.16, 0.445, side * 0.165), crouch);
  const Vec3 fingers =
      blend(Vec3(0.070, 0.780, side * 0.222), Vec3(0.205, 0.405, side * 0.13), crouch);
  addLimb(mesh, {shoulder, 0.058}, {elbow, 0.039});
  addLimb(mesh, {elbow, 0.039}, {wrist, 0.028});
  addLimb(mesh, {wrist, 0.031}, {fingers, 0.024});
}

/// Averages of the faces' normals, weighted by area.
void addNormals(scene::Mesh& mesh) {
  std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    std::array<Vec3, 3> corners;
    for (std::size_t c = 0; c < 3; ++c)
      corners[c] = mesh.positions[mesh.indices[i + c]].cast<double>();
    const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    for (std::size_t c = 0; c < 3; ++c) normals[mesh.indices[i + c]] += normal;
  }
  for (const Vec3& normal : normals) mesh.normals.push_back(normal.normalized().cast<float>());
}

/// Scales to height 1 and to the radius of the person's prism.
void scaleToUnits(scene::Mesh& mesh) {
  float top = 0;
  for (const Eigen::Vector3f& position : mesh.positions) top = std::max(top, position.y());
  const Eigen::Vector3f metres(static_cast<float>(kPersonRadius), top,
                               static_cast<float>(kPersonRadius));  // per unit
  for (Eigen::Vector3f& position : mesh.positions) {
    position = position.cwiseQuotient(metres);
    position.y() = std::clamp(position.y(), 0.0f, 1.0f);
  }
  for (Eigen::Vector3f& normal : mesh.normals) normal = normal.cwiseProduct(metres).normalized();
}

/// `crouch`: 0 standing, 1 the deepest pose.
scene::Mesh makePose(double crouch) {
  const double angle = kDeepestLean * crouch;
  const double above = (kPersonHeight - kHipHeight) * std::cos(angle);  // from the hips to the top
  const double height = kPersonHeight * blend(1, kDeepestPose, crouch);
  const Vec3 hip(-0.10 * crouch, height - above, 0);
  const double c = std::cos(angle), s = std::sin(angle);
  const auto lean = [&](const Vec3& standing) {
    const double y = standing.y() - kHipHeight;
    return Vec3(hip.x() + c * standing.x() + s * y, hip.y() - s * standing.x() + c * y,
                standing.z());
  };
  scene::Mesh mesh;
  mesh.name = "figure";
  addSections(mesh, getTorsoSections(), 0, lean);
  addSections(mesh, makeHeadSections(), 0.016, lean);
  addLimb(mesh, {lean(Vec3(-0.004, 1.44, 0)), 0.058}, {lean(Vec3(0.008, 1.56, 0)), 0.050});
  for (const double side : {-1.0, 1.0}) {
    addLeg(mesh, side, crouch, hip);
    addArm(mesh, side, crouch, lean);
  }
  addNormals(mesh);
  scaleToUnits(mesh);
  return mesh;
}

const std::array<scene::Mesh, kPoses>& getPoses() {
  static const std::array<scene::Mesh, kPoses> all = [] {
    std::array<scene::Mesh, kPoses> made;
    for (std::size_t i = 0; i < kPoses; ++i)
      made[i] = makePose(static_cast<double>(i) / (kPoses - 1));
    return made;
  }();
  return all;
}

/// The number of the pose of a person who is `height` high, of `standing`.
std::size_t choosePose(double height, double standing) {
  const double crouch = (1 - height / standing) / (1 - kDeepestPose);
  return static_cast<std::size_t>(std::lround(std::clamp(crouch, 0.0, 1.0) * (kPoses - 1)));
}

/// Metres from the axis to the rim.
double computeRadius(const scene::AvatarPart& prism) {
  double radius = 0;
  for (const Vec3& v : prism.hull->vertices) radius = std::max(radius, std::hypot(v.x(), v.z()));
  return radius;
}

}  // namespace

bool isPerson(const scene::AvatarSnapshot& avatar) {
  return avatar.spawnHeight > 0 && avatar.shape && avatar.shape->parts.size() == 1 &&
         avatar.joints.empty();
}

Figure placeFigure(const scene::AvatarSnapshot& avatar) {
  ENFILADE_ASSERT(isPerson(avatar));
  const double slim = kMaxGirth * kPersonRadius / kPersonHeight * avatar.spawnHeight;
  const double width = std::min(computeRadius(avatar.shape->parts.front()), slim);
  Vec3 ahead(avatar.viewDirection.x(), 0, avatar.viewDirection.z());
  ahead = ahead.norm() > 1e-6 ? ahead.normalized() : Vec3(Vec3::UnitX());
  Figure figure{&getPoses()[choosePose(avatar.height, avatar.spawnHeight)],
                Eigen::Affine3d::Identity()};
  figure.worldFromMesh.translation() = avatar.footPosition;
  figure.worldFromMesh.linear().col(0) = width * ahead;
  figure.worldFromMesh.linear().col(1) = avatar.height * Vec3::UnitY();
  figure.worldFromMesh.linear().col(2) = width * ahead.cross(Vec3::UnitY());
  return figure;
}

}  // namespace enfilade::render
