#include "render/reference/depth_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "render/gl/gl_renderer.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "tests/render/brute_force_rays.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

Camera makeCameraLookingIn(int width, int height, bool parallel = false) {
  Camera camera;
  camera.eye = {1, 2, 13};
  camera.forward = {-0.1, -0.2, -1};
  camera.heightY = 18;
  camera.far = 60;
  if (parallel) camera.projection = Camera::Projection::orthographic;
  camera.width = width;
  camera.height = height;
  return camera;
}

TEST(ReferenceTracer, AreThoseOfABruteForceSearchInDoubles) {
  const auto scene = makeScene(makeOpaque(makeCrowd(150)));
  ReferenceTracer rays(scene);
  std::size_t hits = 0, others = 0;
  for (const bool parallel : {false, true}) {
    const Camera camera = makeCameraLookingIn(97, 71, parallel);
    const ReferenceFrame truth = rays.render({}, camera);
    const std::vector<BruteHit> brute = computeBruteFrame(scene->model(), camera);
    EXPECT_EQ(truth.undecided, 0u);
    for (std::size_t i = 0; i < brute.size(); ++i) {
      if (truth.ids[i] != brute[i].id) ++others;  // two formulas may differ on one edge
      if (truth.ids[i] != brute[i].id || brute[i].id == 0) continue;
      ++hits;
      EXPECT_NEAR(truth.depth[i], brute[i].depth, 1e-11 * brute[i].depth);
    }
  }
  EXPECT_GT(hits, 97u * 71u / 2);
  EXPECT_LE(others, 1u);
}

TEST(ReferenceTracer, EdgesAreWhereSomethingElseBegins) {
  ReferenceTracer rays(makeScene({{{0, 0, -5}, {2, 2, 2}, {}}, {{0, 0, -9}, {40, 40, 1}, {}}}));
  const ReferenceFrame truth =
      rays.render({}, makeSquareCamera());  // the box covers pixels 75 to 124
  const auto edge = [&](int x, int y) { return truth.edge[static_cast<std::size_t>(200 * y + x)]; };
  EXPECT_TRUE(edge(75, 100));
  EXPECT_TRUE(edge(74, 100));
  EXPECT_FALSE(edge(76, 100));
  EXPECT_FALSE(edge(73, 100));
  EXPECT_FALSE(edge(100, 100));
  EXPECT_FALSE(edge(10, 10));
}

TEST(DepthReport, GlIsWithinItsPromiseAndRaysWithinTheirs) {
  const auto scene = makeScene(makeOpaque(makeCrowd(300)));
  ReferenceTracer rays(scene);
  GlRenderer gl(scene);
  RayRenderer cast(scene);
  DepthReport glReport, castReport;
  Camera camera = makeCameraLookingIn(160, 120);
  for (int i = 0; i < 4; ++i) {
    camera.forward = {std::cos(1.5 * i), -0.1, std::sin(1.5 * i)};
    const ReferenceFrame truth = rays.render({}, camera);
    mergeReports(glReport, compareWithReference(gl.render({}, camera), truth));
    mergeReports(castReport, compareWithReference(cast.render({}, camera), truth));
  }
  for (const DepthReport* report : {&glReport, &castReport}) {
    EXPECT_EQ(report->frames, 4u);
    EXPECT_EQ(report->pixels, 4u * 160u * 120u);
    EXPECT_EQ(report->undecided, 0u);
    EXPECT_GT(report->awayFromEdges.pixels, 1000u);
    EXPECT_EQ(report->idsDiffer[2] + report->idsDiffer[3] + report->idsDiffer[4], 0u);
    EXPECT_LT(report->idsDiffer[0] + report->idsDiffer[1], report->pixels / 2000);
  }
  EXPECT_LT(glReport.awayFromEdges.mean(), 2e-5);
  EXPECT_LT(glReport.awayFromEdges.max, 3e-3);
  EXPECT_LT(castReport.awayFromEdges.mean(), 1e-6);
  EXPECT_LT(castReport.awayFromEdges.max, 1e-5);
  EXPECT_LT(castReport.awayFromEdges.mean(), glReport.awayFromEdges.mean());
}

/// Errors of a GPU, which rounds vertices to 1/256 pixel.
DepthReport reportRoundedVertices(DepthSource depthSource, bool orthographic) {
  const auto scene = makeScene(makeOpaque(makeCrowd(300)));
  ReferenceTracer rays(scene);
  GlRenderer gl(scene, {.device = "", .depthSource = depthSource, .roundsVertices = true});
  Camera camera = makeCameraLookingIn(160, 120, orthographic);
  DepthReport report;
  for (int i = 0; i < 4; ++i) {
    camera.forward = {std::cos(1.5 * i), -0.4, std::sin(1.5 * i)};
    for (const bool rgb : {true, false}) {  // depth alone takes another path
      const FrameOptions options{.channels = {rgb, false, true, false}};
      mergeReports(report,
                   compareWithReference(gl.render({}, camera, options), rays.render({}, camera)));
    }
  }
  EXPECT_GT(report.awayFromEdges.pixels, 1000u);
  EXPECT_LT(report.missing + report.extra, report.pixels / 2000);
  return report;
}

TEST(DepthReport, ThePlaneDepthIsExactWhereVerticesAreRounded) {
  for (const bool orthographic : {false, true}) {
    const DepthErrors plane = reportRoundedVertices(DepthSource::plane, orthographic).awayFromEdges;
    const DepthErrors buffer =
        reportRoundedVertices(DepthSource::buffer, orthographic).awayFromEdges;
    EXPECT_LT(plane.mean(), 2e-6) << orthographic;
    EXPECT_LT(plane.mean(), buffer.mean() / 10) << orthographic;
    EXPECT_LT(plane.max, buffer.max / 4) << orthographic;
  }
}

TEST(DepthReport, ErrorsAreFoundWhereTheyWereMade) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}, {{0, 0, -9}, {40, 40, 1}, {}}});
  ReferenceTracer rays(scene);
  RayRenderer renderer(scene);
  const ReferenceFrame truth = rays.render({}, makeSquareCamera());
  Frame frame = renderer.render({}, makeSquareCamera());
  const DepthReport exact = compareWithReference(frame, truth);
  EXPECT_EQ(exact.idsEqual, 40000u);
  EXPECT_LT(exact.awayFromEdges.max, 1e-6);
  frame.depth[getPixelIndex(frame, 100, 100)] += 0.25f;       // on the box, 4 m away
  frame.depth[getPixelIndex(frame, 10, 10)] = std::nanf("");  // on the wall
  frame.ids[getPixelIndex(frame, 100, 90)] = 2;               // far from any edge
  frame.ids[getPixelIndex(frame, 76, 100)] = 2;               // next to an edge
  const DepthReport wrong = compareWithReference(frame, truth);
  EXPECT_NEAR(wrong.awayFromEdges.max, 0.25, 1e-6);
  EXPECT_NEAR(wrong.bands[1].max, 0.25, 1e-6);
  EXPECT_LT(wrong.bands[2].max, 1e-6);
  EXPECT_EQ(wrong.missing, 1u);
  EXPECT_EQ(wrong.idsDiffer[1], 1u);
  EXPECT_EQ(wrong.idsDiffer[4], 1u);
  frame.depth.clear();
  EXPECT_THROW(compareWithReference(frame, truth), RenderError);
}

TEST(DepthReport, ObjectsInOnePlaceAreTiesAndNoDisagreement) {
  const PlacedBox box{{0, 0, -5}, {2, 2, 2}, {}};
  const auto scene = makeScene({box, box});
  ReferenceTracer rays(scene);
  const ReferenceFrame truth = rays.render({}, makeSquareCamera());
  Frame frame = RayRenderer(scene).render({}, makeSquareCamera());
  for (std::uint32_t& id : frame.ids) id = id == 0 ? 0 : 2;
  const DepthReport report = compareWithReference(frame, truth);
  EXPECT_EQ(report.idsTied, 2500u);
  EXPECT_EQ(report.idsEqual, 37500u);
}

TEST(DepthReport, ItsPercentileIsThatOfTheSortedErrorsWithinABin) {
  DepthErrors errors;
  for (int i = 1; i <= 1000; ++i) errors.addError(1e-6 * i);
  EXPECT_NEAR(errors.percentile99(), 0.00099, 0.06 * 0.00099);
  EXPECT_NEAR(errors.mean(), 500.5e-6, 1e-12);
  errors.addError(7);
  EXPECT_EQ(errors.max, 7);
}

TEST(DepthReport, ItsTextIsJsonWithAllBands) {
  const auto scene = makeScene({{{0, 0, -5}, {2, 2, 2}, {}}});
  const DepthReport report =
      compareWithReference(RayRenderer(scene).render({}, makeSquareCamera()),
                           ReferenceTracer(scene).render({}, makeSquareCamera()));
  const nlohmann::json read = nlohmann::json::parse(formatReportJson(report));
  EXPECT_EQ(read["pixels"], 40000);
  EXPECT_EQ(read["depth"]["bands"].size(), 6u);
  EXPECT_EQ(read["depth"]["bands"][1]["to_m"], 5);
  EXPECT_EQ(read["ids"]["equal"], 40000);
}

}  // namespace
}  // namespace enfilade::render
