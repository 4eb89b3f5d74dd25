#include "server/app/capture_arguments.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>

#include "collision/sine_cosine.hpp"
#include "server/app/validators.hpp"
#include "server/base/parse_number.hpp"

namespace enfilade::server {
namespace {

constexpr int kMaxPixels = 4096;  // pixels, limit of render::Camera
constexpr std::uint32_t kMaxShards = 100'000;
constexpr double kTumStepsPerMetre = 5000;      // per metre, as in the TUM RGB-D benchmark
constexpr double kDefaultStepsPerMetre = 1000;  // per metre

/// Splits the text at `separator`.
std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && text[i] != separator) continue;
    parts.push_back(text.substr(from, i - from));
    from = i + 1;
  }
  return parts;
}

struct Size {
  int width, height;
};
std::optional<Size> parseSize(const std::string& text) {
  const auto parts = split(text, 'x');
  if (parts.size() != 2) return std::nullopt;
  const auto width = parseNumber<int>(parts[0]), height = parseNumber<int>(parts[1]);
  const auto fits = [](std::optional<int> n) { return n && *n >= 1 && *n <= kMaxPixels; };
  if (!fits(width) || !fits(height)) return std::nullopt;
  return Size{*width, *height};
}
std::string validateSize(const std::string& text) {
  return parseSize(text) ? ""
                         : text +
                               ": give WIDTHxHEIGHT, for example 640x480, each 1 to 4096 "
                               "pixels";
}

std::optional<render::Pinhole> parsePinhole(const std::string& text) {
  const auto parts = split(text, ',');
  if (parts.size() != 4) return std::nullopt;
  std::array<double, 4> numbers{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto number = parseNumber<double>(parts[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers[i] = *number;
  }
  if (!(numbers[0] > 0 && numbers[1] > 0)) return std::nullopt;
  return render::Pinhole{numbers[0], numbers[1], numbers[2], numbers[3]};
}
std::string validatePinhole(const std::string& text) {
  if (parsePinhole(text)) return "";
  return text + ": give fx,fy,cx,cy in pixels with fx and fy above 0, for example 525,525,320,240";
}

std::optional<Shard> parseShard(const std::string& text) {
  const auto parts = split(text, '/');
  if (parts.size() != 2) return std::nullopt;
  const auto index = parseNumber<std::uint32_t>(parts[0]);
  const auto count = parseNumber<std::uint32_t>(parts[1]);
  if (!index || !count || *count < 1 || *count > kMaxShards || *index >= *count)
    return std::nullopt;
  return Shard{*index, *count};
}
std::string validateShard(const std::string& text) {
  return parseShard(text) ? ""
                          : text +
                                ": give I/N with I from 0, for example 0/4, 1/4, 2/4 and "
                                "3/4";
}

/// Parses channel names; nullopt for an unknown name or an empty list.
std::optional<CaptureChannels> parseChannels(const std::string& text) {
  CaptureChannels channels{false, false, false, false, false};
  for (const std::string& word : split(text, ',')) {
    if (word == "rgb") {
      channels.rgb = true;
    } else if (word == "depth") {
      channels.depth = true;
    } else if (word == "ids") {
      channels.ids = true;
    } else if (word == "normals") {
      channels.normals = true;
    } else if (word == "range") {
      channels.range = true;
    } else if (word == "class") {
      channels.classes = true;
    } else if (word == "thing") {
      channels.things = true;
    } else {
      return std::nullopt;
    }
  }
  return channels;
}
std::string validateChannels(const std::string& text) {
  if (parseChannels(text)) return "";
  return text + ": give a comma-separated list of rgb, depth, ids, normals, range, class, thing";
}

/// Parses overlay names; nullopt for an unknown name.
std::optional<OverlayChoice> parseOverlay(const std::string& text) {
  OverlayChoice choice;
  if (text.empty()) return choice;
  for (const std::string& word : split(text, ',')) {
    bool* chosen = word == "contacts" ? &choice.contacts
                   : word == "boxes"  ? &choice.boxes
                   : word == "names"  ? &choice.names
                   : word == "paths"  ? &choice.paths
                                      : nullptr;
    if (!chosen) return std::nullopt;
    *chosen = true;
  }
  return choice;
}
std::string validateOverlay(const std::string& text) {
  if (parseOverlay(text)) return "";
  return text + ": give a comma-separated list of contacts, boxes, names, paths";
}

void addPath(CLI::App& verb, CaptureArguments& into) {
  verb.option_defaults()->group("Path");
  verb.add_option("PATH", into.path,
                  "Camera path: TUM lines 't tx ty tz qx qy qz qw', poses in .json, "
                  "transforms.json, a walk script (.jsonl), or a .gltf or .glb with a camera")
      ->required();
  verb.add_option("--out", into.out, "Output folder for the frames")
      ->required()
      ->check(CLI::Validator(validateFolder, "DIR"));
  verb.add_option("--axes", into.axes,
                  "Camera axes of the rotations in PATH. opengl: looks along -z, y up; opencv: "
                  "looks "
                  "along +z, y down")
      ->capture_default_str()
      ->check(makeChoiceValidator({"opengl", "opencv"}));
  verb.add_option("--fps", into.fps,
                  "Frames per second for glTF cameras and for poses without "
                  "times")
      ->capture_default_str()
      ->check(makeRangeValidator(0.001, 10000, "N"));
  verb.add_option("--camera", into.camera,
                  "Name of the glTF camera (default: the first animated camera)")
      ->type_name("NAME");
  verb.add_option("--every", into.every,
                  "Walk script: one frame every N ticks from an avatar's eyes; 0: one frame per "
                  "capture command")
      ->capture_default_str()
      ->check(makeWholeRangeValidator(0, 1'000'000'000, "TICKS"));
  verb.add_option("--avatar", into.avatar, "Avatar whose view --every renders (default: the first)")
      ->type_name("NAME");
  verb.add_flag("--still", into.still,
                "Camera path: bodies keep their initial poses, although the times of the path "
                "pass");
  verb.add_option("--limit", into.limit, "Maximum number of frames; 0: all")
      ->capture_default_str()
      ->check(makeWholeRangeValidator(0, 1'000'000'000, "N"));
}

void addLens(CLI::App& verb, CaptureArguments& into) {
  verb.option_defaults()->group("Camera");
  verb.add_option("--size", into.size, "Picture size in pixels (default: from PATH, else 640x480)")
      ->check(CLI::Validator(validateSize, "WxH"));
  CLI::Option* fov = verb.add_option("--fov", into.fov,
                                     "Vertical field of view in degrees (default: from PATH, "
                                     "else 68.75)")
                         ->check(makeRangeValidator(0.01, 179.99, "DEGREES"));
  verb.add_option("--intrinsics", into.intrinsics,
                  "Pinhole intrinsics in pixels; cx, cy from "
                  "the top left corner")
      ->check(CLI::Validator(validatePinhole, "FX,FY,CX,CY"))
      ->excludes(fov);
  verb.add_option("--near", into.near, "Near clip distance in metres")
      ->capture_default_str()
      ->check(makeRangeValidator(1e-6, 1e6, "METRES"));
  verb.add_option("--far", into.far, "Far clip distance in metres")
      ->capture_default_str()
      ->check(makeRangeValidator(1e-6, 1e9, "METRES"));
}

void addFiles(CLI::App& verb, CaptureArguments& into) {
  verb.option_defaults()->group("Files");
  verb.add_option("--channels", into.channels,
                  "Comma-separated list of rgb, depth, ids, "
                  "normals, range, class, thing")
      ->capture_default_str()
      ->check(CLI::Validator(validateChannels, "LIST"));
  verb.add_option("--rgb", into.rgb, "File format of rgb")
      ->capture_default_str()
      ->check(makeChoiceValidator({"png", "jpeg"}));
  verb.add_option("--quality", into.quality, "JPEG quality, 1 to 100")
      ->capture_default_str()
      ->check(makeWholeRangeValidator(1, 100, "N"));
  verb.add_option("--depth", into.depth,
                  "File format of depth and range. npy: float32 metres; png: 16-bit steps; zst: "
                  "the "
                  "same, compressed")
      ->capture_default_str()
      ->check(makeChoiceValidator({"npy", "png", "zst"}));
  verb.add_option("--depth-scale", into.depthScale,
                  "Steps per metre of 16-bit depth (1000; 5000 in the TUM layout)")
      ->check(makeRangeValidator(1e-3, 1e6, "STEPS"));
  verb.add_option(
          "--depth-noise", into.depthNoise,
          "Noise of a structured-light camera in depth, from this seed. The same seed gives "
          "the same noise to a frame in each shard; depths from 10 m on are lost")
      ->check(makeWholeRangeValidator(0, std::numeric_limits<std::uint64_t>::max(), "SEED"));
  verb.add_option("--too-far", into.tooFar,
                  "Depth beyond 16 bits. refuse: error; clamp: write 65535 and report it")
      ->capture_default_str()
      ->check(makeChoiceValidator({"refuse", "clamp"}));
  verb.add_option("--ids", into.ids, "npy: uint32; png: 16 bits, ids beyond that are an error")
      ->capture_default_str()
      ->check(makeChoiceValidator({"npy", "png"}));
  verb.add_option("--layout", into.layout,
                  "tum: adds rgb.txt, depth.txt and groundtruth.txt, depth as 16-bit PNG")
      ->capture_default_str()
      ->check(makeChoiceValidator({"plain", "tum"}));
  verb.add_option(
          "--overlay", into.overlay,
          "Colour copies in overlay/ with marks: list of contacts, boxes, names, paths; contacts "
          "and paths need a walk script")
      ->check(CLI::Validator(validateOverlay, "LIST"));
  verb.add_option("--glass", into.glass,
                  "Depth, ids and normals at transparent surfaces. clear: of the object behind; "
                  "solid: of the glass, which is then opaque in colour, too")
      ->capture_default_str()
      ->check(makeChoiceValidator({"clear", "solid"}));
  verb.add_option("--avatars", into.avatars,
                  "Shape of avatars in all channels. people: figures, within the shapes that "
                  "collide; shapes: the shapes that collide")
      ->capture_default_str()
      ->check(makeChoiceValidator({"people", "shapes"}));
  verb.add_option("--samples", into.samples,
                  "Samples of the colour in each pixel, which smooth its edges; the other channels "
                  "have one. The time of the colour grows with it")
      ->capture_default_str()
      ->check(makeChoiceValidator({"1", "4", "16"}));
  verb.add_flag("--no-shadows", into.noShadows, "Draw no shadows of the sun in the colour");
  verb.add_flag("--shadows")->group("");  // the default, which earlier versions had to be given
}

void addRun(CLI::App& verb, CaptureArguments& into) {
  verb.option_defaults()->group("Run");
  verb.add_option("--renderer", into.renderer,
                  "gl: OpenGL; rays: Embree ray tracing; auto: the faster one for device, size and "
                  "channels, the same for all frames")
      ->capture_default_str()
      ->check(makeChoiceValidator({"auto", "gl", "rays"}));
  verb.add_option("--shard", into.shard,
                  "Render every Nth frame starting at frame I; all N shards form the full set")
      ->capture_default_str()
      ->check(CLI::Validator(validateShard, "I/N"));
  verb.add_option("--progress", into.progress, "Progress format on stderr")
      ->capture_default_str()
      ->check(makeChoiceValidator({"bar", "json"}));
  verb.add_flag("--no-mp4", into.noMp4, "Do not make video.mp4 (which needs ffmpeg)");
  verb.add_flag("--report-depth", into.reportDepth,
                "Compare depth and ids of each frame with ray-traced ground truth; writes "
                "depth_report.json and one report per frame; about 1 s per frame");
  verb.add_flag("--strict", into.strict,
                "Exit with 3 if an order was refused, a walk was blocked, or a frame shows no "
                "object or the inside of a solid");
  verb.add_flag("--dry-run", into.dryRun, "Print the number of frames and write no files");
}

}  // namespace

std::string validateFolder(const std::string& text) {
  return text.empty() ? "the folder name is empty: give one, for example out" : "";
}

void addCaptureOptions(CLI::App& verb, CaptureArguments& into) {
  addPath(verb, into);
  addLens(verb, into);
  addFiles(verb, into);
  addRun(verb, into);
}

PictureOptions makePictureOptions(const CaptureArguments& read) {
  PictureOptions options;
  if (const auto size = parseSize(read.size)) {
    options.width = size->width;
    options.height = size->height;
  }
  if (!read.fov.empty())
    options.fovY = *parseNumber<double>(read.fov) * collision::kRadiansPerDegree;
  if (!read.intrinsics.empty()) options.pinhole = parsePinhole(read.intrinsics);
  options.near = *parseNumber<double>(read.near);
  options.far = *parseNumber<double>(read.far);
  options.axes = read.axes == "opencv" ? CameraAxes::opencv : CameraAxes::opengl;
  options.fps = *parseNumber<double>(read.fps);
  options.every = static_cast<std::uint32_t>(*parseNumber<std::uint64_t>(read.every));
  options.avatar = read.avatar;
  options.camera = read.camera;
  options.freezeScene = read.still;
  options.limit = *parseNumber<std::uint64_t>(read.limit);
  options.channels = *parseChannels(read.channels);
  options.rgb = read.rgb == "jpeg" ? RgbFile::jpeg : RgbFile::png;
  options.quality = *parseNumber<int>(read.quality);
  options.layout = read.layout == "tum" ? FolderLayout::tum : FolderLayout::plain;
  const bool tum = options.layout == FolderLayout::tum;
  options.depth = tum || read.depth == "png" ? DepthFile::png
                  : read.depth == "zst"      ? DepthFile::zst
                                             : DepthFile::npy;
  options.depthStepsPerMetre = tum ? kTumStepsPerMetre : kDefaultStepsPerMetre;
  if (!read.depthScale.empty()) options.depthStepsPerMetre = *parseNumber<double>(read.depthScale);
  if (!read.depthNoise.empty()) options.depthNoise = parseNumber<std::uint64_t>(read.depthNoise);
  options.tooFar = read.tooFar == "clamp" ? TooFar::clamp : TooFar::refuse;
  options.ids = read.ids == "png" ? IdsFile::png : IdsFile::npy;
  options.overlay = *parseOverlay(read.overlay);
  options.renderer =
      render::parseRendererKind(read.renderer).value_or(render::RendererKind::automatic);
  options.shadows = !read.noShadows;
  options.samples = *parseNumber<std::uint32_t>(read.samples);
  options.avatars =
      read.avatars == "shapes" ? render::AvatarForm::collision : render::AvatarForm::figure;
  options.glass =
      read.glass == "solid" ? render::TransparencyMode::opaque : render::TransparencyMode::blend;
  return options;
}

CaptureRunOptions makeCaptureRunOptions(const CaptureArguments& read) {
  CaptureRunOptions run;
  run.shard = *parseShard(read.shard);
  run.mp4 = !read.noMp4;
  run.dryRun = read.dryRun;
  run.reportDepth = read.reportDepth;
  run.strict = read.strict;
  run.progress = read.progress == "json" ? ProgressFormat::json : ProgressFormat::bar;
  return run;
}

}  // namespace enfilade::server
