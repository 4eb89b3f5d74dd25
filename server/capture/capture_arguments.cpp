#include "server/capture/capture_arguments.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>

namespace enfilade::server {
namespace {

constexpr double kRadians = 0.017453292519943295;  // a degree
constexpr int kLargest = 4096;                     // pixels, as render::Camera takes
constexpr std::uint32_t kMostShards = 100'000;
constexpr double kTumSteps = 5000;    // a metre, as the TUM RGB-D benchmark has them
constexpr double kPlainSteps = 1000;  // a metre

template <typename Number>
std::optional<Number> numberFrom(std::string_view text) {
  Number number{};
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
  if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

/// The parts between `separator`.
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

/// Checks that the text is a number that lies in a range.
CLI::Validator between(double low, double high, const char* name) {
  return CLI::Validator(
      [low, high](const std::string& text) -> std::string {
        const auto number = numberFrom<double>(text);
        if (number && *number >= low && *number <= high) return "";
        std::ostringstream problem;
        problem << text << ": give a number from " << low << " to " << high;
        return problem.str();
      },
      name);
}

CLI::Validator wholeBetween(std::uint64_t low, std::uint64_t high, const char* name) {
  return CLI::Validator(
      [low, high](const std::string& text) -> std::string {
        const auto number = numberFrom<std::uint64_t>(text);
        if (number && *number >= low && *number <= high) return "";
        return text + ": give a whole number from " + std::to_string(low) + " to " +
               std::to_string(high);
      },
      name);
}

struct Size {
  int width, height;
};
std::optional<Size> sizeFrom(const std::string& text) {
  const auto parts = split(text, 'x');
  if (parts.size() != 2) return std::nullopt;
  const auto width = numberFrom<int>(parts[0]), height = numberFrom<int>(parts[1]);
  const auto fits = [](std::optional<int> n) { return n && *n >= 1 && *n <= kLargest; };
  if (!fits(width) || !fits(height)) return std::nullopt;
  return Size{*width, *height};
}
std::string sizeProblem(const std::string& text) {
  return sizeFrom(text) ? "" : text + ": give WIDTHxHEIGHT, as 640x480, each 1 to 4096 pixels";
}

std::optional<render::Pinhole> pinholeFrom(const std::string& text) {
  const auto parts = split(text, ',');
  if (parts.size() != 4) return std::nullopt;
  std::array<double, 4> numbers{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto number = numberFrom<double>(parts[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers[i] = *number;
  }
  if (!(numbers[0] > 0 && numbers[1] > 0)) return std::nullopt;
  return render::Pinhole{numbers[0], numbers[1], numbers[2], numbers[3]};
}
std::string pinholeProblem(const std::string& text) {
  if (pinholeFrom(text)) return "";
  return text + ": give fx,fy,cx,cy in pixels, as 525,525,320,240, with fx and fy above 0";
}

std::optional<Shard> shardFrom(const std::string& text) {
  const auto parts = split(text, '/');
  if (parts.size() != 2) return std::nullopt;
  const auto index = numberFrom<std::uint32_t>(parts[0]);
  const auto count = numberFrom<std::uint32_t>(parts[1]);
  if (!index || !count || *count < 1 || *count > kMostShards || *index >= *count)
    return std::nullopt;
  return Shard{*index, *count};
}
std::string shardProblem(const std::string& text) {
  return shardFrom(text) ? "" : text + ": give I/N, counted from 0, as 0/4, 1/4, 2/4 and 3/4";
}

/// nullopt for a word that is none, or none at all.
std::optional<CaptureChannels> channelsFrom(const std::string& text) {
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
    } else {
      return std::nullopt;
    }
  }
  return channels;
}
std::string channelsProblem(const std::string& text) {
  if (channelsFrom(text)) return "";
  return text + ": give some of rgb, depth, ids, normals, range with commas between them";
}

/// nullopt for a word that is none.
std::optional<OverlayChoice> overlayFrom(const std::string& text) {
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
std::string overlayProblem(const std::string& text) {
  if (overlayFrom(text)) return "";
  return text + ": give some of contacts, boxes, names, paths with commas between them";
}

std::string folderProblem(const std::string& text) {
  return text.empty() ? "the folder's name is empty: give one, as out" : "";
}

void addPath(CLI::App& verb, CaptureArguments& into) {
  verb.add_option("PATH", into.path,
                  "The camera's path: TUM lines 't tx ty tz qx qy qz qw', a .json list of poses or "
                  "transforms.json, a walk script (.jsonl), or a .gltf or .glb with a camera")
      ->required();
  verb.add_option("--out", into.out, "Folder for the frames")
      ->required()
      ->check(CLI::Validator(folderProblem, "DIR"));
  verb.add_option("--axes", into.axes,
                  "The camera's axes in PATH's rotations. opengl: looks along -z, y up; opencv: "
                  "looks along +z, y down")
      ->capture_default_str()
      ->check(CLI::IsMember({"opengl", "opencv"}));
  verb.add_option("--fps", into.fps, "Frames a second of a glTF camera, and of poses without time")
      ->capture_default_str()
      ->check(between(0.001, 10000, "N"));
  verb.add_option("--camera", into.camera, "Name of the glTF camera (the first that moves)");
  verb.add_option("--every", into.every,
                  "Walk script: a frame every N ticks from an avatar's eyes; 0: one for each "
                  "capture of the script")
      ->capture_default_str()
      ->check(wholeBetween(0, 1'000'000'000, "TICKS"));
  verb.add_option("--avatar", into.avatar, "With --every: whose eyes (the first one's)");
  verb.add_flag("--still", into.still,
                "Along a camera path the scene stands as at its beginning, though the path's times "
                "pass");
  verb.add_option("--limit", into.limit, "Only the first N frames; 0: all")
      ->capture_default_str()
      ->check(wholeBetween(0, 1'000'000'000, "N"));
}

void addLens(CLI::App& verb, CaptureArguments& into) {
  verb.add_option("--size", into.size, "Pixels (PATH's own, else 640x480)")
      ->check(CLI::Validator(sizeProblem, "WxH"));
  CLI::Option* fov =
      verb.add_option("--fov", into.fov, "Vertical opening in degrees (PATH's own, else 68.75)")
          ->check(between(0.01, 179.99, "DEGREES"));
  verb.add_option("--intrinsics", into.intrinsics, "In pixels, cx and cy from the top left corner")
      ->check(CLI::Validator(pinholeProblem, "FX,FY,CX,CY"))
      ->excludes(fov);
  verb.add_option("--near", into.near, "Metres; what is nearer is cut away")
      ->capture_default_str()
      ->check(between(1e-6, 1e6, "METRES"));
  verb.add_option("--far", into.far, "Metres; what is farther is cut away")
      ->capture_default_str()
      ->check(between(1e-6, 1e9, "METRES"));
}

void addFiles(CLI::App& verb, CaptureArguments& into) {
  verb.add_option("--channels", into.channels, "Some of rgb, depth, ids, normals, range")
      ->capture_default_str()
      ->check(CLI::Validator(channelsProblem, "LIST"));
  verb.add_option("--rgb", into.rgb)->capture_default_str()->check(CLI::IsMember({"png", "jpeg"}));
  verb.add_option("--quality", into.quality, "Of JPEG")
      ->capture_default_str()
      ->check(wholeBetween(1, 100, "1..100"));
  verb.add_option("--depth", into.depth,
                  "Depth and range. npy: float32 metres; png: 16 bit steps; zst: the same, packed")
      ->capture_default_str()
      ->check(CLI::IsMember({"npy", "png", "zst"}));
  verb.add_option("--depth-scale", into.depthScale,
                  "Steps a metre of 16 bit depth (1000; 5000 in the TUM layout)")
      ->check(between(1e-3, 1e6, "STEPS"));
  verb.add_option("--too-far", into.tooFar,
                  "Depth that 16 bits cannot hold. refuse: an error; clamp: 65535, and told")
      ->capture_default_str()
      ->check(CLI::IsMember({"refuse", "clamp"}));
  verb.add_option("--ids", into.ids, "npy: uint32; png: 16 bit, an error where an id does not fit")
      ->capture_default_str()
      ->check(CLI::IsMember({"npy", "png"}));
  verb.add_option("--layout", into.layout,
                  "tum: rgb.txt, depth.txt and groundtruth.txt too, depth as 16 bit PNG")
      ->capture_default_str()
      ->check(CLI::IsMember({"plain", "tum"}));
  verb.add_option(
          "--overlay", into.overlay,
          "Copies of the colour in overlay/ with marks for people: some of contacts, boxes, "
          "names, paths; contacts and paths are a walk script's")
      ->check(CLI::Validator(overlayProblem, "LIST"));
  verb.add_option("--glass", into.glass,
                  "Depth, ids and normals of what is transparent. clear: of what lies behind; "
                  "solid: of the glass, which hides it in the colour too")
      ->capture_default_str()
      ->check(CLI::IsMember({"clear", "solid"}));
  verb.add_flag("--shadows", into.shadows, "The sun's, in the colour; clear glass casts none");
}

void addRun(CLI::App& verb, CaptureArguments& into) {
  verb.add_option("--renderer", into.renderer,
                  "gl: OpenGL; rays: cast with Embree; auto: the faster one for device, size and "
                  "channels, always the same")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "gl", "rays"}));
  verb.add_option("--shard", into.shard,
                  "Every Nth frame from frame I on; the shards together are the whole")
      ->capture_default_str()
      ->check(CLI::Validator(shardProblem, "I/N"));
  verb.add_option("--progress", into.progress, "On stderr")
      ->capture_default_str()
      ->check(CLI::IsMember({"bar", "json"}));
  verb.add_flag("--no-mp4", into.noMp4, "No video.mp4, which ffmpeg makes where it is installed");
  verb.add_flag("--report-depth", into.reportDepth,
                "Compare depth and ids of each frame with rays in doubles: depth_report.json, and "
                "one a frame; a second or so a frame");
  verb.add_flag("--strict", into.strict,
                "End with 3 when a walk script's order was refused or a walk blocked, or when a "
                "frame shows nothing or is seen from within a solid");
  verb.add_flag("--dry-run", into.dryRun, "Tell how many frames there are and write nothing");
}

}  // namespace

void addCapture(CLI::App& verb, CaptureArguments& into) {
  addPath(verb, into);
  addLens(verb, into);
  addFiles(verb, into);
  addRun(verb, into);
}

PictureOptions picturesFrom(const CaptureArguments& read) {
  PictureOptions options;
  if (const auto size = sizeFrom(read.size)) {
    options.width = size->width;
    options.height = size->height;
  }
  if (!read.fov.empty()) options.fovY = *numberFrom<double>(read.fov) * kRadians;
  if (!read.intrinsics.empty()) options.pinhole = pinholeFrom(read.intrinsics);
  options.near = *numberFrom<double>(read.near);
  options.far = *numberFrom<double>(read.far);
  options.axes = read.axes == "opencv" ? CameraAxes::opencv : CameraAxes::opengl;
  options.fps = *numberFrom<double>(read.fps);
  options.every = static_cast<std::uint32_t>(*numberFrom<std::uint64_t>(read.every));
  options.avatar = read.avatar;
  options.camera = read.camera;
  options.still = read.still;
  options.limit = *numberFrom<std::uint64_t>(read.limit);
  options.channels = *channelsFrom(read.channels);
  options.rgb = read.rgb == "jpeg" ? RgbFile::jpeg : RgbFile::png;
  options.quality = *numberFrom<int>(read.quality);
  options.layout = read.layout == "tum" ? FolderLayout::tum : FolderLayout::plain;
  const bool tum = options.layout == FolderLayout::tum;
  options.depth = tum || read.depth == "png" ? DepthFile::png
                  : read.depth == "zst"      ? DepthFile::zst
                                             : DepthFile::npy;
  options.depthSteps = tum ? kTumSteps : kPlainSteps;
  if (!read.depthScale.empty()) options.depthSteps = *numberFrom<double>(read.depthScale);
  options.tooFar = read.tooFar == "clamp" ? TooFar::clamp : TooFar::refuse;
  options.ids = read.ids == "png" ? IdsFile::png : IdsFile::npy;
  options.overlay = *overlayFrom(read.overlay);
  options.renderer =
      render::rendererKindFrom(read.renderer).value_or(render::RendererKind::automatic);
  options.shadows = read.shadows;
  options.glass = read.glass == "solid" ? render::Glass::solid : render::Glass::clear;
  return options;
}

CaptureRunOptions captureRunFrom(const CaptureArguments& read) {
  CaptureRunOptions run;
  run.shard = *shardFrom(read.shard);
  run.mp4 = !read.noMp4;
  run.dryRun = read.dryRun;
  run.reportDepth = read.reportDepth;
  run.strict = read.strict;
  run.progress = read.progress == "json" ? CaptureProgress::json : CaptureProgress::bar;
  return run;
}

}  // namespace enfilade::server
