#include "scene/model/diagnostic_catalog.hpp"

#include <algorithm>
#include <array>

namespace enfilade::scene {
namespace {

constexpr bool kInfo = true, kWarning = false;

constexpr std::array kCatalog{
    // file
    DiagnosticKind{"cut_off_file", kWarning, "the file ends too early; copy or export it again"},
    DiagnosticKind{"damaged_statement", kWarning, "lines that are not STEP were ignored"},
    DiagnosticKind{"ifc_reader_absent", kWarning,
                   "a reader is not installed: another one read the file; ./dev installs all"},
    DiagnosticKind{"ifc_reader_failed", kWarning,
                   "a reader failed, and another one read the file; --ifc-reader chooses a reader"},
    DiagnosticKind{"guessed_up_axis", kInfo,
                   "the file states no up axis: that of the largest level area; --up sets it"},
    DiagnosticKind{"ignored_extension", kWarning,
                   "a glTF extension that is not read, so shapes may differ; export without it"},
    DiagnosticKind{"mended_text", kWarning,
                   "the text was repaired in memory; export the file again"},
    DiagnosticKind{"missing_material_file", kWarning, "put the .mtl file next to the model"},
    DiagnosticKind{"no_unit", kWarning, "the file defines no unit; set it with --unit"},
    DiagnosticKind{"other_scenes", kInfo, "scenes of the file that are not its default: not read"},
    DiagnosticKind{"unit_assumed", kWarning, "the file's unit is doubtful; set it with --unit"},
    // placement
    DiagnosticKind{"broken_transform_dropped", kWarning,
                   "its transform is not finite or out of range: ignored"},
    DiagnosticKind{"coarse_coordinates", kWarning,
                   "far from its own origin: its vertices have low precision"},
    DiagnosticKind{"coarse_placement", kWarning,
                   "placed far from the file's origin: its position has low precision"},
    DiagnosticKind{"far_object", kWarning,
                   "far from all others; move or delete it in the modeller"},
    DiagnosticKind{"far_object_dropped", kWarning,
                   "so far that it cannot belong to the scene: ignored"},
    DiagnosticKind{"far_reaching_object", kWarning,
                   "extends far beyond all others; check its size"},
    DiagnosticKind{"flat_object", kWarning, "scaled to zero along an axis: it has no inside"},
    DiagnosticKind{"mirrored_object", kWarning,
                   "mirrored: its faces were flipped to face outwards"},
    // surfaces
    DiagnosticKind{"broken_triangle_dropped", kWarning, "vertices are not finite: ignored"},
    DiagnosticKind{
        "convexity_untried", kWarning,
        "too large for the convexity test; it stays triangles, equally exact but slower"},
    DiagnosticKind{"degenerate_triangle", kWarning, "triangles without area; harmless, ignored"},
    DiagnosticKind{"duplicate_triangle", kWarning,
                   "the same triangle twice; harmless, may flicker"},
    DiagnosticKind{"inconsistent_winding", kWarning,
                   "neighbouring faces have opposite winding; flipped to match the majority"},
    DiagnosticKind{"inside_out_solid", kWarning,
                   "faces look inwards: treated as the solid that they bound; flip its normals"},
    DiagnosticKind{
        "inward_shell", kWarning,
        "a closed shell whose faces look inwards; if it is not a room, flip its normals"},
    DiagnosticKind{"non_manifold_edge", kWarning,
                   "more than two faces share an edge, so inside and outside are undefined"},
    DiagnosticKind{"object_without_area", kWarning, "it has no surface to collide with"},
    DiagnosticKind{"points_and_lines_dropped", kWarning,
                   "points and lines are neither drawn nor solid"},
    DiagnosticKind{"repeated_object", kWarning,
                   "the same shape twice in the same place; delete one, they flicker"},
    // appearance
    DiagnosticKind{"emissive_texture_ignored", kWarning, "emissive textures are not drawn"},
    DiagnosticKind{
        "missing_texture", kWarning,
        "missing, or of a kind that is not decoded: drawn without it; put a PNG next to the model"},
    DiagnosticKind{"opacity_zero", kWarning, "the material is invisible; drawn opaque"},
    DiagnosticKind{"reduced_texture", kWarning,
                   "the textures are many or large; drawn at a lower resolution"},
    DiagnosticKind{"unreadable_texture", kWarning,
                   "not a readable PNG, JPEG or WebP; drawn without it"},
    DiagnosticKind{"vertex_colours_ignored", kWarning, "vertex colours are not drawn"},
    DiagnosticKind{"instance_attributes_ignored", kInfo,
                   "attributes of instances that neither place nor shape them"},
    // of IFC
    DiagnosticKind{"cut_away_product", kWarning, "its openings leave nothing of it"},
    DiagnosticKind{"missing_product", kWarning, "no reader could build its shape: it is missing"},
    DiagnosticKind{"opening_unchecked", kWarning, "its opening could not be tested"},
    DiagnosticKind{"openings_unverified", kWarning,
                   "read by the second reader, which may leave openings closed"},
    DiagnosticKind{"uncut_opening", kWarning,
                   "a door or window whose wall is closed behind it: it is impassable"},
    DiagnosticKind{"map_place", kInfo, "where the file's own coordinates lie on a map"},
    DiagnosticKind{"skipped_openings", kInfo, "openings are air"},
    DiagnosticKind{"skipped_spaces", kInfo, "spaces are air"},
    // bodies
    DiagnosticKind{"body_without_area", kWarning, "a body of objects without surface: ignored"},
    DiagnosticKind{"collision_shape_alone", kWarning,
                   "named as the collision shape of a missing object"},
    DiagnosticKind{"extras_without_kind", kWarning, "walk_* without walk_kind: it is static"},
    DiagnosticKind{"unsupported_physics", kWarning, "the file has physics that is not simulated"},
    DiagnosticKind{"collision_suffix", kInfo, "solid, visual or moving by the suffix of its name"},
    DiagnosticKind{"guessed_doors", kInfo, "how they open was guessed; a sidecar can define it"},
    DiagnosticKind{"replaced_bodies", kInfo, "described in several sources; the first one wins"},
    DiagnosticKind{"still_doors", kInfo, "doors that are static; a sidecar can move them"},
    DiagnosticKind{"still_lifts", kInfo, "lifts that are static; a sidecar can move them"},
};

}  // namespace

DiagnosticKind findDiagnosticKind(const Diagnostic& diagnostic) {
  const auto found =
      std::find_if(kCatalog.begin(), kCatalog.end(),
                   [&](const DiagnosticKind& kind) { return kind.name == diagnostic.kind; });
  return found == kCatalog.end() ? DiagnosticKind{diagnostic.kind, kWarning, {}} : *found;
}

}  // namespace enfilade::scene
