#include "scene/model/diagnostic_catalog.hpp"

#include <algorithm>
#include <array>

namespace enfilade::scene {
namespace {

using enum Severity;

constexpr std::array kCatalog{
    // file
    DiagnosticKind{"cut_off_file", error, "the file ends too early; copy or export it again"},
    DiagnosticKind{"damaged_statement", error, "lines that are not STEP were ignored"},
    DiagnosticKind{"duplicate_key", warning,
                   "a key twice in one object of the file's JSON: the last value counts"},
    DiagnosticKind{"ifc_reader_absent", warning,
                   "a reader is not installed: another one read the file; ./dev installs all"},
    DiagnosticKind{"ifc_reader_failed", warning,
                   "a reader failed, and another one read the file; --ifc-reader chooses a reader"},
    DiagnosticKind{"guessed_up_axis", note,
                   "the file states no up axis: that of the largest level area; --up sets it"},
    DiagnosticKind{
        "unclear_up_axis", warning,
        "the file states no up axis, and no level is clearly the largest: give it with --up"},
    DiagnosticKind{"ignored_extension", error,
                   "a glTF extension that is not read, so shapes may differ; export without it"},
    DiagnosticKind{"ignored_appearance", warning,
                   "a glTF extension of materials, textures or lights that the file requires is "
                   "not read: it looks different"},
    DiagnosticKind{"mended_text", note, "the text was repaired in memory; export the file again"},
    DiagnosticKind{"missing_material_file", warning, "put the .mtl file next to the model"},
    DiagnosticKind{"no_scene", note, "the glTF file has no scene: all its nodes form one"},
    DiagnosticKind{"no_unit", warning, "the file defines no unit; set it with --unit"},
    DiagnosticKind{"other_scenes", note,
                   "scenes of the file that were not read; --gltf-scene chooses one"},
    DiagnosticKind{"trailing_data", warning,
                   "data after the announced triangles or elements is not read; export it again"},
    DiagnosticKind{"unit_assumed", warning, "the file's unit is doubtful; set it with --unit"},
    // placement
    DiagnosticKind{
        "broken_transform_dropped", error,
        "a part of its transform is malformed, not allowed, not finite or out of range: ignored"},
    DiagnosticKind{
        "shared_node", warning,
        "a glTF node is listed several times, which glTF does not allow: it stands at each place"},
    DiagnosticKind{"coarse_coordinates", warning,
                   "far from its own origin: its vertices have low precision"},
    DiagnosticKind{"coarse_placement", warning,
                   "placed far from the file's origin: its position has low precision"},
    DiagnosticKind{"far_object", warning, "far from all others; move or delete it in the modeller"},
    DiagnosticKind{"far_object_dropped", error,
                   "so far that it cannot belong to the scene: ignored"},
    DiagnosticKind{"far_reaching_object", warning, "extends far beyond all others; check its size"},
    DiagnosticKind{"flat_object", warning, "scaled to zero along an axis: it has no inside"},
    DiagnosticKind{"rescaled_rotation", warning,
                   "a rotation is not a unit quaternion: its length was ignored"},
    DiagnosticKind{"missing_camera", warning, "a node names a camera that the file lacks"},
    DiagnosticKind{"missing_node", error,
                   "a scene or node names a node that the file lacks: it is missing"},
    DiagnosticKind{"mirrored_object", note, "mirrored: its faces were flipped to face outwards"},
    // surfaces
    DiagnosticKind{"broken_triangle_dropped", error,
                   "a triangle with a vertex that is broken or missing: ignored"},
    DiagnosticKind{
        "convexity_untried", note,
        "too large for the convexity test; it stays triangles, equally exact but slower"},
    DiagnosticKind{"degenerate_triangle", note, "triangles without area; harmless, ignored"},
    DiagnosticKind{"duplicate_triangle", note, "the same triangle twice; harmless, may flicker"},
    DiagnosticKind{"inconsistent_winding", note,
                   "neighbouring faces have opposite winding; flipped to match the majority"},
    DiagnosticKind{"inside_out_solid", warning,
                   "faces look inwards: treated as the solid that they bound; flip its normals"},
    DiagnosticKind{
        "inward_shell", warning,
        "a closed shell whose faces look inwards; if it is not a room, flip its normals"},
    DiagnosticKind{"missing_mesh", error,
                   "a mesh does not exist, or cannot be read and states no extent: it is missing"},
    DiagnosticKind{"solid_mesh", error,
                   "a mesh cannot be read: it is a solid box of the extent that the file states"},
    DiagnosticKind{"plain_data_used", warning,
                   "its compressed data cannot be read; the plain data of the file was read"},
    DiagnosticKind{"non_manifold_edge", note,
                   "more than two faces share an edge, so inside and outside are undefined"},
    DiagnosticKind{"object_without_area", note, "it has no surface to collide with"},
    DiagnosticKind{"points_and_lines_dropped", note,
                   "points and lines are neither drawn nor solid"},
    DiagnosticKind{
        "coplanar_surfaces", note,
        "surfaces of two objects in one plane: pictures show the smaller object, or, above two "
        "million triangles, flicker; move one by a millimetre"},
    DiagnosticKind{"coplanar_search_ended", note,
                   "there are too many triangles to look for all surfaces in one plane"},
    DiagnosticKind{"repeated_object", warning,
                   "the same shape twice in the same place; delete one, they flicker"},
    // appearance
    DiagnosticKind{"emissive_texture_ignored", warning, "emissive textures are not drawn"},
    DiagnosticKind{"missing_material", warning,
                   "a mesh names a material that the file lacks: drawn in a plain colour"},
    DiagnosticKind{
        "missing_texture", warning,
        "missing, or of a kind that is not read: drawn without it; a PNG next to the model, or the "
        "model as glTF with a PNG texture, is drawn"},
    DiagnosticKind{"opacity_zero", warning, "the material is invisible; drawn opaque"},
    DiagnosticKind{"reduced_texture", note,
                   "the textures are many or large; drawn at a lower resolution"},
    DiagnosticKind{"unreadable_texture", warning,
                   "not a readable PNG, JPEG or WebP; drawn without it"},
    DiagnosticKind{
        "vertex_colours_ignored", warning,
        "colours that cannot be read, or of faces whose vertices have colours, are not drawn"},
    DiagnosticKind{"skin_ignored", error,
                   "its node has no size, or the skin does not exist: it is not posed by its skin"},
    DiagnosticKind{"instance_attributes_ignored", warning,
                   "an attribute of instances cannot be read: its objects lack it"},
    // of IFC
    DiagnosticKind{"cut_away_product", error, "its openings leave nothing of it"},
    DiagnosticKind{"solid_product", error,
                   "its openings could not be cut: it is solid, and doors in it are closed"},
    DiagnosticKind{"missing_product", error, "no reader could build its shape: it is missing"},
    DiagnosticKind{"opening_unchecked", note, "its opening could not be tested"},
    DiagnosticKind{"openings_unverified", warning,
                   "read by the second reader, which may leave openings closed"},
    DiagnosticKind{"uncut_opening", error,
                   "a door or window whose wall is closed behind it: it is impassable"},
    DiagnosticKind{"broken_map", warning,
                   "the file's place on a map cannot be used: it keeps its own coordinates"},
    DiagnosticKind{"broken_north", warning,
                   "a direction of north that cannot be used: it is ignored"},
    DiagnosticKind{"broken_elevation", warning,
                   "a storey's elevation is not a number: only its placement counts"},
    DiagnosticKind{"map_place", note, "where the file's own coordinates lie on a map"},
    DiagnosticKind{"storeys_by_elevation", note,
                   "the file places its storeys at one height: their stated elevations are used"},
    DiagnosticKind{"xml_not_read", warning,
                   "elements or attributes of ifcXML that its schema does not have are not read"},
    DiagnosticKind{"xml_reference_missing", error,
                   "references to ids that the ifcXML file lacks are left out; export it again"},
    DiagnosticKind{"xml_value_ignored", error,
                   "values of ifcXML that are not of their type are left out; export it again"},
    DiagnosticKind{"skipped_openings", note, "openings are air"},
    DiagnosticKind{"skipped_spaces", note, "spaces are air"},
    // bodies
    DiagnosticKind{"body_without_area", note, "a body of objects without surface: ignored"},
    DiagnosticKind{"collision_shape_alone", warning,
                   "named as the collision shape of a missing object"},
    DiagnosticKind{"extras_without_kind", warning, "walk_* without walk_kind: it is static"},
    DiagnosticKind{"unsupported_physics", warning, "the file has physics that is not simulated"},
    DiagnosticKind{"collision_suffix", note, "solid, visual or moving by the suffix of its name"},
    DiagnosticKind{"guessed_doors", note, "how they open was guessed; a sidecar can define it"},
    DiagnosticKind{"replaced_bodies", note,
                   "bodies of a source below another one, which replaces them"},
    DiagnosticKind{"still_doors", note, "doors that are static; a sidecar can move them"},
    DiagnosticKind{"still_lifts", note, "lifts that are static; a sidecar can move them"},
};

}  // namespace

const char* toString(Severity severity) {
  switch (severity) {
    case note:
      return "note";
    case warning:
      return "warning";
    case error:
      return "error";
  }
  return "";
}

std::vector<std::string_view> listDiagnosticKinds() {
  std::vector<std::string_view> names;
  for (const DiagnosticKind& kind : kCatalog) names.push_back(kind.name);
  return names;
}

DiagnosticKind findDiagnosticKind(const Diagnostic& diagnostic) {
  const auto found =
      std::find_if(kCatalog.begin(), kCatalog.end(),
                   [&](const DiagnosticKind& kind) { return kind.name == diagnostic.kind; });
  return found == kCatalog.end() ? DiagnosticKind{diagnostic.kind, warning, {}} : *found;
}

}  // namespace enfilade::scene
